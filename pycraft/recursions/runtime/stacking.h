// Vectors and blocks body by body, and what they are as a whole.
#pragma once

#include "letters.h"

namespace pycraft::written {

inline int size(const std::vector<int>& rows) { return static_cast<int>(rows.size()); }

inline Rows children_of(const std::vector<int>& parent) {
  Rows children(parent.size());
  for (int k = 0; k < size(parent); ++k)
    if (parent[k] >= 0) children[parent[k]].push_back(k);
  return children;
}

inline Rows ranges(const std::vector<int>& sizes) {  // the rows of each body where bodies follow each other
  Rows rows;
  int next = 0;
  for (int size : sizes) {
    rows.emplace_back();
    for (int i = 0; i < size; ++i) rows.back().push_back(next++);
  }
  return rows;
}

inline Matrix pick_rows(const Matrix& A, const std::vector<int>& rows) {
  Matrix out(size(rows), A.cols());
  for (int i = 0; i < size(rows); ++i) out.row(i) = A.row(rows[i]);
  return out;
}

inline Matrix pick_columns(const Matrix& A, const std::vector<int>& columns) {
  Matrix out(A.rows(), size(columns));
  for (int j = 0; j < size(columns); ++j) out.col(j) = A.col(columns[j]);
  return out;
}

inline void put(Matrix& A, const std::vector<int>& rows, const std::vector<int>& columns, const Matrix& block) {
  for (int i = 0; i < size(rows); ++i)
    for (int j = 0; j < size(columns); ++j) A(rows[i], columns[j]) = block(i, j);
}

inline Blocks cut(const Matrix& x, const Rows& rows) {  // a vector (or columns) body by body
  Blocks blocks;
  for (const auto& r : rows) blocks.push_back(pick_rows(x, r));
  return blocks;
}

inline Matrix stack(const Blocks& y, const Rows& rows, int columns) {  // blocks body by body as one vector (or columns)
  int total = 0;
  for (const auto& r : rows) total += size(r);
  Matrix out(total, columns);
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (int i = 0; i < size(rows[k]); ++i) out.row(rows[k][i]) = y[k].row(i);
  return out;
}

inline Matrix assembled(const Blocks& B, const Rows& rows, const Rows& columns) {  // blocks on the diagonal of a matrix
  int height = 0, width = 0;
  for (const auto& r : rows) height += size(r);
  for (const auto& c : columns) width += size(c);
  Matrix out = Matrix::Zero(height, width);
  for (std::size_t k = 0; k < B.size(); ++k) put(out, rows[k], columns[k], B[k]);
  return out;
}

}  // namespace pycraft::written
