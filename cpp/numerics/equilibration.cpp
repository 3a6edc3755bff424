#include "numerics/equilibration.h"

#include <algorithm>

namespace pycraft {

void Equilibration::zero_on_forest() {
  column_start_.assign(n_ + 1, 0);
  for (const Entry& e : entries_) ++column_start_[e.column + 1];
  for (int j = 0; j < n_; ++j) column_start_[j + 1] += column_start_[j];
  by_column_.resize(entries_.size());
  from_.assign(column_start_.begin(), column_start_.end() - 1);
  for (int i = 0; i < n_; ++i)
    for (int e = start_[i]; e < start_[i + 1]; ++e) by_column_[from_[entries_[e].column]++] = {i, entries_[e].exponent};

  row_.assign(n_, 0), column_.assign(n_, 0);
  row_part_.assign(n_, -1), column_part_.assign(n_, -1);
  parts_ = 0;
  for (int root = 0; root < n_; ++root) {
    if (row_part_[root] >= 0) continue;
    row_part_[root] = parts_;
    queue_.assign(1, root);
    for (size_t next = 0; next < queue_.size(); ++next) {
      const int i = queue_[next];
      for (int e = start_[i]; e < start_[i + 1]; ++e) {
        const int j = entries_[e].column;
        if (column_part_[j] >= 0) continue;
        column_part_[j] = parts_;
        column_[j] = -entries_[e].exponent - row_[i];
        for (int f = column_start_[j]; f < column_start_[j + 1]; ++f) {
          const int k = by_column_[f].column;
          if (row_part_[k] >= 0) continue;
          row_part_[k] = parts_;
          row_[k] = -by_column_[f].exponent - column_[j];
          queue_.push_back(k);
        }
      }
    }
    ++parts_;
  }
}

bool Equilibration::match() {
  // cost(i,j) = (largest exponent of row i) - exponent(i,j) >= u(i) + v(j), with equality on the matching
  v_.assign(n_, std::numeric_limits<int>::max());
  for (int i = 0; i < n_; ++i) {
    int largest = std::numeric_limits<int>::min();
    for (int e = start_[i]; e < start_[i + 1]; ++e) largest = std::max(largest, entries_[e].exponent += row_[i] + column_[entries_[e].column]);
    if (start_[i] < start_[i + 1]) row_[i] -= largest;
    for (int e = start_[i]; e < start_[i + 1]; ++e) {
      entries_[e].exponent = largest - entries_[e].exponent;
      v_[entries_[e].column] = std::min(v_[entries_[e].column], entries_[e].exponent);
    }
  }
  u_.assign(n_, 0);
  row_of_.assign(n_, -1);
  column_of_.assign(n_, -1);
  std::vector<int>& unmatched = queue_;
  unmatched.clear();
  for (int i = 0; i < n_; ++i) {
    if (start_[i] == start_[i + 1]) return false;
    int least = std::numeric_limits<int>::max();
    for (int e = start_[i]; e < start_[i + 1]; ++e) least = std::min(least, entries_[e].exponent - v_[entries_[e].column]);
    u_[i] = least;
    bool matched = false;
    for (int e = start_[i]; e < start_[i + 1] && !matched; ++e) {
      const int j = entries_[e].column;
      if (row_of_[j] >= 0 || entries_[e].exponent - v_[j] != least) continue;
      row_of_[j] = i;
      column_of_[i] = j;
      matched = true;
    }
    if (!matched) unmatched.push_back(i);
  }
  for (int i : unmatched)
    if (!augment(i)) return false;
  for (int i = 0; i < n_; ++i) {
    row_[i] += u_[i];
    column_[i] += v_[i];
  }
  return true;
}

// A shortest augmenting path from an unmatched row, by Dijkstra's algorithm on the reduced costs.
bool Equilibration::augment(int first) {
  constexpr int unreached = std::numeric_limits<int>::max();
  distance_.assign(n_, unreached);
  from_.resize(n_);
  done_.assign(n_, 0);
  int row = first, base = 0, nearest = -1;
  for (;;) {
    for (int e = start_[row]; e < start_[row + 1]; ++e) {
      const int j = entries_[e].column;
      if (done_[j]) continue;
      const int d = base + entries_[e].exponent - u_[row] - v_[j];
      if (d < distance_[j]) distance_[j] = d, from_[j] = row;
    }
    nearest = -1;
    for (int j = 0; j < n_; ++j)
      if (!done_[j] && distance_[j] != unreached && (nearest < 0 || distance_[j] < distance_[nearest])) nearest = j;
    if (nearest < 0) return false;
    base = distance_[nearest];
    done_[nearest] = 1;
    if (row_of_[nearest] < 0) break;
    row = row_of_[nearest];
  }
  u_[first] += base;
  for (int j = 0; j < n_; ++j)
    if (done_[j] && row_of_[j] >= 0) {
      v_[j] -= base - distance_[j];
      u_[row_of_[j]] += base - distance_[j];
    }
  for (int j = nearest, i = -1; i != first;) {
    i = from_[j];
    row_of_[j] = i;
    std::swap(column_of_[i], j);  // on to the column that i was matched with before
  }
  return true;
}

}  // namespace pycraft
