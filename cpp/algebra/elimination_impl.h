// Implementation of elimination.h.
#pragma once

#include <algorithm>

namespace pycraft {

namespace elimination {

constexpr int largest_merged_front = 300, largest_dense = 6000, merges = 40;

// Rows of body k of a vector in a space, gathered in the order of its blocks.
template <class F>
void for_rows(const Space& space, int body, F f) {
  int local = 0;
  for (int b : space.layout().of_body[body])
    for (int i = 0; i < space.layout().blocks[b].size; ++i) f(local++, space.layout().blocks[b].offset + i);
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
  size_t at = 0;
  total_ = 0;
  for (Front& f : fronts_) {
    f.matrix = at;
    f.across = f.matrix + size_t(f.n) * f.n;
    f.over = f.across + size_t(f.n) * (f.width() + border_);
    at = f.over + size_t(f.height() + border_) * f.n;
    f.vector = total_;
    total_ += f.n;
  }
  A_.resize(at);
  magnitude_.resize(total_);
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

template <class S>
template <class Blocks, class Values>
void TreeElimination<S>::assemble(Blocks&& blocks, Values&& values) {
  std::fill(A_.begin(), A_.end(), S(0));
  std::fill(border_matrix_.begin(), border_matrix_.end(), S(0));
  static const Symbol edge_symbol{&sko_symbols()[SymbolId::E], nullptr, nullptr, {}, {}};
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
          add_block(row, column, blocks(t.right).at(k), r, c, S(t.coefficient));
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
      values(t.context).block(edge_symbol, k, edge_.data());
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
        multiply_add(edge_.data(), blocks(t.right).at(column_body), product_.data(), er, ec, c);
        edge_.swap(product_);
        ec = c;
      }
      if (t.left >= 0) {
        product_.assign(size_t(r) * ec, S(0));
        multiply_add(blocks(t.left).at(row_body), edge_.data(), product_.data(), r, er, ec);
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
    for (int i = 0; i < f.n; ++i) {
      S largest = S(0);
      for (int j = 0; j < f.n; ++j) largest = std::max(largest, S(abs(A_[f.matrix + size_t(i) * f.n + j])));
      magnitude_[f.vector + i] = largest;
    }
  border_magnitude_.assign(border_, S(0));
  for (int i = 0; i < border_; ++i)
    for (int j = 0; j < border_; ++j) border_magnitude_[i] = std::max(border_magnitude_[i], S(abs(border_matrix_[size_t(i) * border_ + j])));
  original_ = A_;
  border_original_ = border_matrix_;
}

template <class S>
bool TreeElimination<S>::eliminate() {
  using std::abs;
  for (int k = static_cast<int>(fronts_.size()) - 1; k >= 0; --k) {
    const Front& f = fronts_[k];
    const int across = f.width() + border_;
    S *U = A_.data() + f.across, *over = A_.data() + f.over;
    failed_ = k;
    if (!lu_[k].factor(A_.data() + f.matrix, f.n, magnitude_.data() + f.vector)) return false;
    work_.resize(std::max(work_.size(), size_t(f.n) * std::max(across, 1)));
    lu_[k].solve(U, across, work_.data());
    // Schur complement in the parent and the border
    for (int i = 0; i < f.height() + border_; ++i) {
      const bool parent_row = i < f.height();
      const Front* p = f.parent >= 0 ? &fronts_[f.parent] : nullptr;
      for (int j = 0; j < across; ++j) {
        S update = S(0);
        for (int a = 0; a < f.n; ++a) update += over[size_t(i) * f.n + a] * U[size_t(a) * across + j];
        if (update == S(0)) continue;
        const bool parent_column = j < f.width();
        if (parent_row && parent_column) {
          A_[p->matrix + size_t(f.rows[i]) * p->n + f.columns[j]] -= update;
          S& magnitude = magnitude_[p->vector + f.rows[i]];
          magnitude = std::max(magnitude, S(abs(update)));
        } else if (parent_row) {
          A_[p->across + size_t(f.rows[i]) * (p->width() + border_) + p->width() + (j - f.width())] -= update;
        } else if (parent_column) {
          A_[p->over + size_t(p->height() + (i - f.height())) * p->n + f.columns[j]] -= update;
        } else {
          border_matrix_[size_t(i - f.height()) * border_ + (j - f.width())] -= update;
          S& magnitude = border_magnitude_[i - f.height()];
          magnitude = std::max(magnitude, S(abs(update)));
        }
      }
    }
  }
  failed_ = -1;
  return border_ == 0 || border_lu_.factor(border_matrix_.data(), border_, border_magnitude_.data());
}

template <class S>
template <class Blocks, class Values>
bool TreeElimination<S>::factor(Blocks&& blocks, Values&& values) {
  for (int attempt = 0; attempt < elimination::merges; ++attempt) {
    assemble(blocks, values);
    if (eliminate()) return true;
    if (failed_ < 0) break;  // the border's own block
    const Front& f = fronts_[failed_];
    if (f.parent < 0 || f.n + fronts_[f.parent].n > elimination::largest_merged_front) break;
    merged_with_parent_[f.bodies[0]] = 1;
    lay_out(false);
  }
  const int body = failed_ >= 0 && !fronts_[failed_].bodies.empty() ? fronts_[failed_].bodies[0] : -1;
  const std::string where = body >= 0 ? "the pivot block of body '" + tree_.body_names[body] + "' is singular" : "the pivot block of the low-rank border is singular";
  if (static_cast<int>(total_) + border_ > elimination::largest_dense)
    throw SingularOperatorError(where + ", and with " + std::to_string(total_) + " states the operator is too large for a dense factorization");
  lay_out(true);
  assemble(blocks, values);
  if (!eliminate()) throw SingularOperatorError(where + ", and so is the operator as a whole: it has no inverse at this state");
  note_ = "dense: " + where + "; eliminated as one block of " + std::to_string(total_) + " states";
  return false;
}

template <class S>
void TreeElimination<S>::solve_system(S* b, int m) {
  S* border = b + total_ * m;
  for (int k = static_cast<int>(fronts_.size()) - 1; k >= 0; --k) {
    const Front& f = fronts_[k];
    S* y = b + f.vector * m;
    lu_[k].solve(y, m, work_.data());
    for (int i = 0; i < f.height() + border_; ++i) {
      S* target = i < f.height() ? b + (fronts_[f.parent].vector + f.rows[i]) * m : border + (i - f.height()) * m;
      const S* row = A_.data() + f.over + size_t(i) * f.n;
      for (int a = 0; a < f.n; ++a)
        if (!(row[a] == S(0)))
          for (int c = 0; c < m; ++c) target[c] -= row[a] * y[a * m + c];
    }
  }
  if (border_) border_lu_.solve(border, m, work_.data());
  for (size_t k = 0; k < fronts_.size(); ++k) {
    const Front& f = fronts_[k];
    S* y = b + f.vector * m;
    const int across = f.width() + border_;
    const S* U = A_.data() + f.across;
    for (int j = 0; j < across; ++j) {
      const S* s = j < f.width() ? b + (fronts_[f.parent].vector + f.columns[j]) * m : border + (j - f.width()) * m;
      for (int i = 0; i < f.n; ++i) {
        const S u = U[size_t(i) * across + j];
        if (u == S(0)) continue;
        for (int c = 0; c < m; ++c) y[i * m + c] -= u * s[c];
      }
    }
  }
}

template <class S>
void TreeElimination<S>::subtract_product(const S* s, S* r, int m) const {
  const S* border_s = s + total_ * m;
  S* border_r = r + total_ * m;
  const auto row_product = [&](const S* row, const S* v, int n, S* target) {
    for (int a = 0; a < n; ++a)
      if (!(row[a] == S(0)))
        for (int c = 0; c < m; ++c) target[c] -= row[a] * v[a * m + c];
  };
  for (const Front& f : fronts_) {
    const S* own = s + f.vector * m;
    const int across = f.width() + border_;
    for (int i = 0; i < f.n; ++i) {
      S* target = r + (f.vector + i) * m;
      row_product(original_.data() + f.matrix + size_t(i) * f.n, own, f.n, target);
      const S* line = original_.data() + f.across + size_t(i) * across;
      for (int j = 0; j < across; ++j) {
        if (line[j] == S(0)) continue;
        const S* v = j < f.width() ? s + (fronts_[f.parent].vector + f.columns[j]) * m : border_s + (j - f.width()) * m;
        for (int c = 0; c < m; ++c) target[c] -= line[j] * v[c];
      }
    }
    for (int i = 0; i < f.height() + border_; ++i) {
      S* target = i < f.height() ? r + (fronts_[f.parent].vector + f.rows[i]) * m : border_r + (i - f.height()) * m;
      row_product(original_.data() + f.over + size_t(i) * f.n, own, f.n, target);
    }
  }
  for (int i = 0; i < border_; ++i) row_product(border_original_.data() + size_t(i) * border_, border_s, border_, border_r + i * m);
}

template <class S>
template <class Blocks>
void TreeElimination<S>::solve(const S* x, S* y, int m, Blocks&& blocks) {
  const size_t size = (total_ + border_) * m;
  rhs_.assign(size, S(0));
  size_t largest = border_;
  for (const Front& f : fronts_) largest = std::max(largest, size_t(f.n));
  if (work_.size() < largest * m) work_.resize(largest * m);
  const auto at = [&](Place p, int i) { return ((p.front < 0 ? total_ : fronts_[p.front].vector) + p.position + i) * m; };
  // right-hand side from the input
  for (const Realization::Term& t : r_->inputs) {
    if (!r_->domain.belongs_to_bodies()) {
      for (int i = 0; i < r_->domain.dimension(); ++i)
        for (int c = 0; c < m; ++c) rhs_[at(equation_at_[t.row][0], i) + c] += S(t.coefficient) * x[i * m + c];
      continue;
    }
    for (int k = 0; k < tree_.bodies(); ++k) {
      const Place place = equation_at_[t.row][k];
      elimination::for_rows(r_->domain, k, [&](int local, int row) {
        if (t.right < 0) {
          for (int c = 0; c < m; ++c) rhs_[at(place, local) + c] += S(t.coefficient) * x[row * m + c];
        } else {
          const BlockStorage<S>& b = blocks(t.right);
          for (int i = 0; i < b.rows[k]; ++i) {
            const S f = S(t.coefficient) * b.at(k)[i * b.columns[k] + local];
            for (int c = 0; c < m; ++c) rhs_[at(place, i) + c] += f * x[row * m + c];
          }
        }
      });
    }
  }
  residual_ = rhs_;
  solve_system(rhs_.data(), m);
  // One step of refinement on the system itself; further ones while the correction is large and shrinks.
  using std::abs;
  S last = S(-1);
  for (int step = 0; step < 4; ++step) {
    product_ = residual_;
    subtract_product(rhs_.data(), product_.data(), m);
    solve_system(product_.data(), m);
    S correction = S(0), solution = S(0);
    for (size_t i = 0; i < size; ++i) {
      correction = std::max(correction, S(abs(product_[i])));
      solution = std::max(solution, S(abs(rhs_[i])));
    }
    if (step && !(correction < last / S(2))) break;
    for (size_t i = 0; i < size; ++i) rhs_[i] += product_[i];
    if (!(correction > S(1e6) * epsilon<S>() * solution)) break;
    last = correction;
  }
  // output
  std::fill_n(y, size_t(r_->codomain.dimension()) * m, S(0));
  for (const Realization::Term& t : r_->outputs) {
    if (!r_->codomain.belongs_to_bodies()) {
      for (int i = 0; i < r_->codomain.dimension(); ++i)
        for (int c = 0; c < m; ++c) y[i * m + c] += S(t.coefficient) * rhs_[at(state_at_[t.column][0], i) + c];
      continue;
    }
    for (int k = 0; k < tree_.bodies(); ++k)
      elimination::for_rows(r_->codomain, k, [&](int local, int row) {
        const auto source = [&](int i, int c) -> S {
          if (t.column >= 0) return rhs_[at(state_at_[t.column][k], i) + c];
          S value = S(0);
          elimination::for_rows(r_->domain, k, [&](int l, int xr) {
            if (l == i) value = x[xr * m + c];
          });
          return value;
        };
        if (t.right < 0) {
          for (int c = 0; c < m; ++c) y[row * m + c] += S(t.coefficient) * source(local, c);
        } else {
          const BlockStorage<S>& b = blocks(t.right);
          for (int i = 0; i < b.columns[k]; ++i) {
            const S f = S(t.coefficient) * b.at(k)[local * b.columns[k] + i];
            for (int c = 0; c < m; ++c) y[row * m + c] += f * source(i, c);
          }
        }
      });
  }
}

template <class S>
void TreeElimination<S>::selected_fronts() {
  z_offset_.assign(1, 0);
  for (const Front& f : fronts_) z_offset_.push_back(z_offset_.back() + size_t(f.n) * f.n + 2 * size_t(f.n) * border_);
  Z_.assign(z_offset_.back(), S(0));
  z_border_.assign(size_t(border_) * border_, S(0));
  for (int i = 0; i < border_; ++i) z_border_[size_t(i) * border_ + i] = S(1);
  size_t largest = border_;
  for (const Front& f : fronts_) largest = std::max(largest, size_t(f.n));
  if (work_.size() < largest * largest) work_.resize(largest * largest);
  if (border_) border_lu_.solve(z_border_.data(), border_, work_.data());
  std::vector<S> inverse, L, outer, UZ;
  for (size_t k = 0; k < fronts_.size(); ++k) {
    const Front& f = fronts_[k];
    const int n = f.n, w = f.width() + border_, h = f.height() + border_;
    inverse.assign(size_t(n) * n, S(0));
    for (int i = 0; i < n; ++i) inverse[size_t(i) * n + i] = S(1);
    lu_[k].solve(inverse.data(), n, work_.data());
    L.assign(size_t(h) * n, S(0));
    multiply_add(A_.data() + f.over, inverse.data(), L.data(), h, n, n);
    // Z over (the parent's touched states, border) x (the parent's touched equations, border)
    outer.assign(size_t(w) * h, S(0));
    const S *zp = nullptr, *zpb = nullptr, *zbp = nullptr;
    int np = 0;
    if (f.parent >= 0) {
      np = fronts_[f.parent].n;
      zp = Z_.data() + z_offset_[f.parent];
      zpb = zp + size_t(np) * np;
      zbp = zpb + size_t(np) * border_;
    }
    for (int i = 0; i < w; ++i)
      for (int j = 0; j < h; ++j) {
        const bool pi = i < f.width(), pj = j < f.height();
        const int bi = i - f.width(), bj = j - f.height();
        outer[size_t(i) * h + j] = pi && pj ? zp[size_t(f.columns[i]) * np + f.rows[j]]
                                   : pi     ? zpb[size_t(f.columns[i]) * border_ + bj]
                                   : pj     ? zbp[size_t(bi) * np + f.rows[j]]
                                            : z_border_[size_t(bi) * border_ + bj];
      }
    UZ.assign(size_t(n) * h, S(0));
    multiply_add(A_.data() + f.across, outer.data(), UZ.data(), n, w, h);
    S* z = Z_.data() + z_offset_[k];
    std::copy(inverse.begin(), inverse.end(), z);
    multiply_add(UZ.data(), L.data(), z, n, h, n);
    S *zkb = z + size_t(n) * n, *zbk = zkb + size_t(n) * border_;
    for (int i = 0; i < n; ++i)
      for (int b = 0; b < border_; ++b) zkb[size_t(i) * border_ + b] = -UZ[size_t(i) * h + f.height() + b];
    for (int b = 0; b < border_; ++b)
      for (int j = 0; j < n; ++j) {
        S sum = S(0);
        for (int a = 0; a < h; ++a) sum += outer[size_t(f.width() + b) * h + a] * L[size_t(a) * n + j];
        zbk[size_t(b) * n + j] = -sum;
      }
  }
}

template <class S>
template <class Blocks>
void TreeElimination<S>::selected(BlockStorage<S>& out, Blocks&&) {
  selected_fronts();
  // Inputs and outputs are states of their own (local ends): the block is read off.
  std::fill(out.data.begin(), out.data.end(), S(0));
  for (const Realization::Term& o : r_->outputs)
    for (const Realization::Term& i : r_->inputs)
      for (int k = 0; k < tree_.bodies(); ++k) {
        const Place state = state_at_[o.column][k], equation = equation_at_[i.row][k];
        const int n = fronts_[state.front].n;
        const S* z = Z_.data() + z_offset_[state.front];
        for (int a = 0; a < out.rows[k]; ++a)
          for (int b = 0; b < out.columns[k]; ++b)
            out.at(k)[a * out.columns[k] + b] +=
                S(o.coefficient) * S(i.coefficient) * z[size_t(state.position + a) * n + equation.position + b];
      }
}

template <class S>
S TreeElimination<S>::log_abs_determinant() const {
  S sum = S(0);
  for (const SmallLU<S>& lu : lu_) sum += lu.log_abs_determinant();
  if (border_) sum += border_lu_.log_abs_determinant();
  return sum;
}

}  // namespace pycraft
