// elimination.h: the assembly of the fronts' matrices.
#pragma once

#include <algorithm>

namespace pycraft {

namespace elimination {

constexpr int largest_merged_front = 400, largest_dense = 4000, merges = 60;

// Rows of body k of a vector in a space, gathered in the order of its blocks.
template <class F>
void for_rows(const Space& space, int body, F f) {
  int local = 0;
  for (int b : space.layout().of_body[body])
    for (int i = 0; i < space.layout().blocks[b].size; ++i) f(local++, space.layout().blocks[b].offset + i);
}

// How many decimal digits a relative error of the solution stands for, beyond epsilon.
template <class S>
std::string digits(const S& error) {
  using std::log10;
  const double lost = to_double(S(log10(S(error / epsilon<S>()))));
  return std::isfinite(lost) ? std::to_string(static_cast<int>(lost + 0.5)) : "all";
}

}  // namespace elimination

template <class S>
void TreeElimination<S>::add_block(Place row, Place column, const S* block, int r, int c, S factor) {
  for (int i = 0; i < r; ++i) {
    S* target = nullptr;
    if (row.front == column.front) {
      target = row.front < 0 ? border_matrix_.data() + size_t(row.position + i) * border_ + column.position
                             : A_.data() + fronts_[row.front].matrix + size_t(row.position + i) * fronts_[row.front].n + column.position;
    } else if (column.front < 0) {
      const Front& f = fronts_[row.front];
      target = A_.data() + f.across + size_t(row.position + i) * (f.width() + border_) + f.width() + column.position;
    } else if (row.front < 0) {
      const Front& f = fronts_[column.front];
      target = A_.data() + f.over + size_t(f.height() + row.position + i) * f.n + column.position;
    } else if (fronts_[row.front].parent == column.front) {
      const Front& f = fronts_[row.front];
      S* line = A_.data() + f.across + size_t(row.position + i) * (f.width() + border_);
      for (int j = 0; j < c; ++j) line[f.column_index[column.position + j]] += factor * block[i * c + j];
      continue;
    } else {
      const Front& f = fronts_[column.front];
      target = A_.data() + f.over + size_t(f.row_index[row.position + i]) * f.n + column.position;
    }
    for (int j = 0; j < c; ++j) target[j] += factor * block[i * c + j];
  }
}

// The block itself, or, where it is of a narrower scalar, a copy of it.
template <class S>
template <class T>
const S* TreeElimination<S>::own_scalar(const T* block, size_t entries, std::vector<S>& converted) const {
  if constexpr (std::is_same_v<S, T>) {
    return block;
  } else {
    converted.resize(entries);
    for (size_t i = 0; i < entries; ++i) converted[i] = S(block[i]);
    return converted.data();
  }
}

template <class S>
template <class Blocks, class Values>
void TreeElimination<S>::assemble(Blocks&& blocks, Values&& values) {
  std::fill(A_.begin(), A_.end(), S(0));
  std::fill(border_matrix_.begin(), border_matrix_.end(), S(0));
  for (const Realization::Term& t : r_->terms) {
    if (t.shift == Shift::none)
      add_term(t, blocks);
    else
      add_edge_term(t, blocks, values);
  }
  for (const Realization::Border& t : r_->border_terms) add_border(t);
  using std::abs;
  for (const Front& f : fronts_)
    for (size_t i = 0; i < size_t(f.n) * f.n; ++i) sizes_[f.sizes + i] = abs(soft(A_[f.matrix + i]));
  border_sizes_.resize(border_matrix_.size());
  for (size_t i = 0; i < border_matrix_.size(); ++i) border_sizes_[i] = abs(soft(border_matrix_[i]));
  original_ = A_;
  border_original_ = border_matrix_;
}

// A block of its own on every body, or the identity; of a border state the identity.
template <class S>
template <class Blocks>
void TreeElimination<S>::add_term(const Realization::Term& t, Blocks&& blocks) {
  const Space &row_space = r_->equations[t.row], &column_space = r_->states[t.column];
  const auto add_identity = [&](Place row, Place column, int r, int c) {
    block_.assign(size_t(r) * c, S(0));
    for (int i = 0; i < std::min(r, c); ++i) block_[size_t(i) * c + i] = S(1);
    add_block(row, column, block_.data(), r, c, S(t.coefficient));
  };
  if (!row_space.belongs_to_bodies()) return add_identity(equation_at_[t.row][0], state_at_[t.column][0], row_space.dimension(), row_space.dimension());
  for (int k = 0; k < tree_.bodies(); ++k) {
    const int r = row_space.body_size(k), c = column_space.body_size(k);
    if (r == 0 || c == 0) continue;
    const Place row = equation_at_[t.row][k], column = state_at_[t.column][k];
    if (t.right >= 0)
      add_block(row, column, own_scalar(blocks(t.right).at(k), size_t(r) * c, right_), r, c, S(t.coefficient));
    else
      add_identity(row, column, r, c);
  }
}

// left · (E or E*) · right
template <class S>
template <class Blocks, class Values>
void TreeElimination<S>::add_edge_term(const Realization::Term& t, Blocks&& blocks, Values&& values) {
  const Space &row_space = r_->equations[t.row], &column_space = r_->states[t.column];
  for (int k = 0; k < tree_.bodies(); ++k) {
    const int p = tree_.parent[k];
    if (p < 0) continue;
    const int row_body = t.shift == Shift::up ? p : k, column_body = t.shift == Shift::down ? p : k;
    const int r = row_space.body_size(row_body), c = column_space.body_size(column_body);
    if (r == 0 || c == 0) continue;
    load_edge(t, k, values);
    int er = tree_.size[row_body], ec = tree_.size[column_body];
    if (t.right >= 0) {
      product_.assign(size_t(er) * c, S(0));
      multiply_add(edge_.data(), own_scalar(blocks(t.right).at(column_body), size_t(ec) * c, right_), product_.data(), er, ec, c);
      edge_.swap(product_);
      ec = c;
    }
    if (t.left >= 0) {
      product_.assign(size_t(r) * ec, S(0));
      multiply_add(own_scalar(blocks(t.left).at(row_body), size_t(r) * er, left_), edge_.data(), product_.data(), r, er, ec);
      edge_.swap(product_);
    }
    add_block(equation_at_[t.row][row_body], state_at_[t.column][column_body], edge_.data(), r, c, S(t.coefficient));
  }
}

// edge_ = E(p,k), or its transpose where the term carries to the child.
template <class S>
template <class Values>
void TreeElimination<S>::load_edge(const Realization::Term& t, int k, Values&& values) {
  static const Symbol symbol{&sko_symbol(SymbolId::E), nullptr, nullptr, {}, {}};
  const int sp = tree_.size[tree_.parent[k]], sk = tree_.size[k];
  edge_.resize(size_t(sp) * sk);
  using T = typename std::decay_t<decltype(values(0))>::Scalar;
  if constexpr (std::is_same_v<S, T>) {
    values(t.context).block(symbol, k, edge_.data());
  } else {
    std::vector<T> edge(edge_.size());
    values(t.context).block(symbol, k, edge.data());
    for (size_t i = 0; i < edge.size(); ++i) edge_[i] = S(edge[i]);
  }
  if (t.shift != Shift::down) return;
  block_.resize(edge_.size());
  for (int i = 0; i < sp; ++i)
    for (int j = 0; j < sk; ++j) block_[size_t(j) * sp + i] = edge_[size_t(i) * sk + j];
  edge_.swap(block_);
}

template <class S>
void TreeElimination<S>::add_border(const Realization::Border& t) {
  const Space &row_space = r_->equations[t.row], &column_space = r_->states[t.column];
  const int rows = row_space.dimension(), columns = column_space.dimension();
  const auto entry = [&](int i, int j) { return S(t.transposed ? t.constant->dense[size_t(j) * rows + i] : t.constant->dense[size_t(i) * columns + j]); };
  const auto each = [&](const Space& space, const std::vector<Place>& at, auto f) {  // f(place, row of the vector)
    if (!space.belongs_to_bodies()) {
      for (int i = 0; i < space.dimension(); ++i) f(Place{at[0].front, at[0].position + i}, i);
      return;
    }
    for (int k = 0; k < tree_.bodies(); ++k)
      elimination::for_rows(space, k, [&](int local, int row) { f(Place{at[k].front, at[k].position + local}, row); });
  };
  each(row_space, equation_at_[t.row], [&](Place row, int i) {
    each(column_space, state_at_[t.column], [&](Place column, int j) {
      const S value = entry(i, j);
      add_block(row, column, &value, 1, 1, S(t.coefficient));
    });
  });
}

}  // namespace pycraft
