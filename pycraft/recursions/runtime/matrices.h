// Dense matrices, those without rows included.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "letters.h"

namespace pycraft::written {

inline Matrix matrix(int rows, int columns, const std::vector<double>& entries) {  // row after row
  return Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(entries.data(), rows, columns);
}

inline Matrix solve(const Matrix& A, const Matrix& b) {  // A⁻¹ b
  return A.size() && b.size() ? Matrix(A.partialPivLu().solve(b)) : b;
}

inline Matrix inverse(const Matrix& A) { return solve(A, Matrix::Identity(A.rows(), A.cols())); }  // A⁻¹

inline Matrix symmetric(const Matrix& A) { return (A + A.transpose()) / 2; }  // without the rounding that makes it unsymmetric

inline Matrix root(const Matrix& A) {  // L, lower triangular, with A = L L*; columns of zeros where A is singular
  const int n = static_cast<int>(A.rows());
  Matrix L = Matrix::Zero(n, n);
  const double bound = 16 * n * std::numeric_limits<double>::epsilon() * (n ? std::max(A.diagonal().maxCoeff(), 0.0) : 0.0);
  for (int j = 0; j < n; ++j) {
    const double pivot = A(j, j) - L.row(j).head(j).squaredNorm();
    if (pivot < -bound) throw std::domain_error("a block is not positive semidefinite: it has no square root");
    if (!(pivot > bound)) continue;
    L(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < n; ++i) L(i, j) = (A(i, j) - L.row(i).head(j).dot(L.row(j).head(j))) / L(j, j);
  }
  return L;
}

inline Matrix lower_half(const Matrix& A) {  // the lower triangle of A with half its diagonal
  Matrix L = A.triangularView<Eigen::Lower>();
  L.diagonal() /= 2;
  return L;
}

inline Matrix diagonal(const Matrix& A) { return A.diagonal(); }  // as a column

inline double trace(const Matrix& A) { return A.trace(); }

inline double norm(const Matrix& A) { return A.norm(); }

inline double square_root(double x) { return std::sqrt(std::max(x, 0.0)); }  // what rounding left below zero is zero

inline double logdet(const Matrix& A) {  // ln|det A|
  return A.size() ? Matrix(A.partialPivLu().matrixLU()).diagonal().array().abs().log().sum() : 0.0;
}

}  // namespace pycraft::written
