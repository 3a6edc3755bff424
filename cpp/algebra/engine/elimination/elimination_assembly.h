// elimination.h: fronts, positions, and the assembly of their matrices.
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
TreeElimination<S>::TreeElimination(std::shared_ptr<const Realization> realization)
    : r_(std::move(realization)), tree_(r_->tree->structure()), merged_with_parent_(tree_.bodies(), 0) {
  lay_out(false);
}

template <class S>
void TreeElimination<S>::lay_out(bool one_front) {
  fronts_.clear();
  front_of_.assign(tree_.bodies(), -1);
  for (int k = 0; k < tree_.bodies(); ++k) {
    const int p = tree_.parent[k];
    if (one_front && k > 0) {
      front_of_[k] = 0;
    } else if (p >= 0 && merged_with_parent_[k]) {
      front_of_[k] = front_of_[p];
    } else {
      front_of_[k] = static_cast<int>(fronts_.size());
      fronts_.push_back({});
      fronts_.back().parent = p < 0 ? -1 : front_of_[p];
    }
    fronts_[front_of_[k]].bodies.push_back(k);
  }
  if (one_front && fronts_.empty()) fronts_.push_back({});
  // Positions: within a front body by body, within a body state by state.
  border_ = 0;
  const auto place = [&](const std::vector<Space>& spaces, std::vector<std::vector<Place>>& at, bool count) {
    at.assign(spaces.size(), {});
    std::vector<int> used(fronts_.size(), 0);
    for (size_t j = 0; j < spaces.size(); ++j) at[j].resize(spaces[j].belongs_to_bodies() ? tree_.bodies() : 1);
    for (size_t f = 0; f < fronts_.size(); ++f)
      for (int k : fronts_[f].bodies)
        for (size_t j = 0; j < spaces.size(); ++j) {
          if (!spaces[j].belongs_to_bodies()) continue;
          at[j][k] = {static_cast<int>(f), used[f]};
          used[f] += spaces[j].body_size(k);
        }
    int edge = 0;
    for (size_t j = 0; j < spaces.size(); ++j) {
      if (spaces[j].belongs_to_bodies()) continue;
      int& next = one_front ? used[0] : edge;
      at[j][0] = {one_front ? 0 : -1, next};
      next += spaces[j].dimension();
    }
    if (count) {
      for (size_t f = 0; f < fronts_.size(); ++f) fronts_[f].n = used[f];
      border_ = edge;
    }
  };
  place(r_->states, state_at_, true);
  place(r_->equations, equation_at_, false);
  // Which of the parent's states and equations the edges touch.
  for (size_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    if (front.parent < 0) continue;
    const int p = tree_.parent[front.bodies[0]], n = fronts_[front.parent].n;
    front.column_index.assign(n, -1);
    front.row_index.assign(n, -1);
    for (const Realization::Term& t : r_->terms) {
      const auto mark = [&](std::vector<int>& index, Place at, int size) {
        for (int i = 0; i < size; ++i) index[at.position + i] = 0;
      };
      if (t.shift == Shift::down) mark(front.column_index, state_at_[t.column][p], r_->states[t.column].body_size(p));
      if (t.shift == Shift::up) mark(front.row_index, equation_at_[t.row][p], r_->equations[t.row].body_size(p));
    }
    for (int i = 0; i < n; ++i) {
      if (front.column_index[i] == 0) {
        front.column_index[i] = front.width();
        front.columns.push_back(i);
      }
      if (front.row_index[i] == 0) {
        front.row_index[i] = front.height();
        front.rows.push_back(i);
      }
    }
  }
  size_t at = 0, sizes = 0;
  total_ = 0;
  for (Front& f : fronts_) {
    f.matrix = at;
    f.across = f.matrix + size_t(f.n) * f.n;
    f.over = f.across + size_t(f.n) * (f.width() + border_);
    at = f.over + size_t(f.height() + border_) * f.n;
    f.vector = total_;
    f.sizes = sizes;
    total_ += f.n;
    sizes += size_t(f.n) * f.n;
  }
  A_.resize(at);
  sizes_.resize(sizes);
  lu_.resize(fronts_.size());
  border_matrix_.resize(size_t(border_) * border_);
}

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
  static const Symbol edge_symbol{&sko_symbol(SymbolId::E), nullptr, nullptr, {}, {}};
  for (const Realization::Term& t : r_->terms) {
    const Space &row_space = r_->equations[t.row], &column_space = r_->states[t.column];
    if (!row_space.belongs_to_bodies()) {  // the identity of a border state
      const int n = row_space.dimension();
      block_.assign(size_t(n) * n, S(0));
      for (int i = 0; i < n; ++i) block_[size_t(i) * n + i] = S(1);
      add_block(equation_at_[t.row][0], state_at_[t.column][0], block_.data(), n, n, S(t.coefficient));
      continue;
    }
    for (int k = 0; k < tree_.bodies(); ++k) {
      const int p = tree_.parent[k];
      if (t.shift != Shift::none && p < 0) continue;
      const int row_body = t.shift == Shift::up ? p : k, column_body = t.shift == Shift::down ? p : k;
      const int r = row_space.body_size(row_body), c = column_space.body_size(column_body);
      if (r == 0 || c == 0) continue;
      const Place row = equation_at_[t.row][row_body], column = state_at_[t.column][column_body];
      if (t.shift == Shift::none) {
        if (t.right >= 0) {
          add_block(row, column, own_scalar(blocks(t.right).at(k), size_t(r) * c, right_), r, c, S(t.coefficient));
        } else {
          block_.assign(size_t(r) * c, S(0));
          for (int i = 0; i < std::min(r, c); ++i) block_[size_t(i) * c + i] = S(1);
          add_block(row, column, block_.data(), r, c, S(t.coefficient));
        }
        continue;
      }
      // left · (E or E*) · right
      const int sp = tree_.size[p], sk = tree_.size[k];
      edge_.resize(size_t(sp) * sk);
      using T = std::decay_t<decltype(*blocks(0).at(0))>;
      if constexpr (std::is_same_v<S, T>) {
        values(t.context).block(edge_symbol, k, edge_.data());
      } else {
        std::vector<T> edge(edge_.size());
        values(t.context).block(edge_symbol, k, edge.data());
        for (size_t i = 0; i < edge.size(); ++i) edge_[i] = S(edge[i]);
      }
      int er = sp, ec = sk;
      if (t.shift == Shift::down) {
        block_.resize(edge_.size());
        for (int i = 0; i < sp; ++i)
          for (int j = 0; j < sk; ++j) block_[size_t(j) * sp + i] = edge_[size_t(i) * sk + j];
        edge_.swap(block_);
        std::swap(er, ec);
      }
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
      add_block(row, column, edge_.data(), r, c, S(t.coefficient));
    }
  }
  for (const Realization::Border& t : r_->border_terms) {
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
  using std::abs;
  for (const Front& f : fronts_)
    for (size_t i = 0; i < size_t(f.n) * f.n; ++i) sizes_[f.sizes + i] = abs(A_[f.matrix + i]);
  border_sizes_.resize(border_matrix_.size());
  for (size_t i = 0; i < border_matrix_.size(); ++i) border_sizes_[i] = abs(border_matrix_[i]);
  original_ = A_;
  border_original_ = border_matrix_;
}

}  // namespace pycraft
