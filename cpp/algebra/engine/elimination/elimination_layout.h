// elimination.h: fronts, and where states and equations lie in them.
#pragma once

#include <algorithm>

namespace pycraft {

template <class S>
TreeElimination<S>::TreeElimination(std::shared_ptr<const Realization> realization)
    : r_(std::move(realization)), tree_(r_->tree->structure()), merged_with_parent_(tree_.bodies(), 0) {
  lay_out(false);
}

template <class S>
void TreeElimination<S>::lay_out(bool one_front) {
  make_fronts(one_front);
  std::vector<int> used;
  border_ = place(r_->states, one_front, state_at_, used);
  for (size_t f = 0; f < fronts_.size(); ++f) fronts_[f].n = used[f];
  place(r_->equations, one_front, equation_at_, used);
  join_fronts();
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
void TreeElimination<S>::make_fronts(bool one_front) {
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
}

// Positions: within a front body by body, within a body space by space. used: how many in each front; returned: in the border.
template <class S>
int TreeElimination<S>::place(const std::vector<Space>& spaces, bool one_front, std::vector<std::vector<Place>>& at, std::vector<int>& used) const {
  at.assign(spaces.size(), {});
  used.assign(fronts_.size(), 0);
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
  return edge;
}

template <class S>
void TreeElimination<S>::join_fronts() {
  for (Front& front : fronts_) {
    if (front.parent < 0) continue;
    const int p = tree_.parent[front.bodies[0]], n = fronts_[front.parent].n;
    front.column_index.assign(n, -1);
    front.row_index.assign(n, -1);
    for (const Realization::Term& t : r_->terms) {
      const auto mark = [](std::vector<int>& index, Place at, int size) { std::fill_n(index.begin() + at.position, size, 0); };
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
}

}  // namespace pycraft
