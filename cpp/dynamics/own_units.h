// Rows of loops certified in their own units, and what is not sure in one scalar settled in the next wider one.
//
// Ranks are decided in units of energy, in which a row that a light body shares with heavy ones is nearly all the light body's: of two such rows the
// difference is lost where masses differ by 1/ε, and a row may be missed whole by what is nothing in those units. What the tree alone would do there is
// no measure of it: accelerations that are asked of 1e-9 kg by itself are of 1e9 m/s².
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <vector>

#include "numerics/rank_factors.h"
#include "numerics/scalar.h"
#include "recursions/loop_columns.h"

namespace pycraft {

// Whether there is a wider scalar that loops are solved in. Numbers that are written down leave it to who runs them.
template <class S>
inline constexpr bool settles = !std::is_same_v<S, Quad> && !is_recorded<S>;

// The same of these loops: a user's functions are in double precision alone.
template <class S>
bool settles_rows_of(const ResolvedLoops& loops) {
  return settles<S> && std::none_of(loops.loops.begin(), loops.loops.end(), [](const ResolvedLoop& loop) { return bool(loop.loop->coupling.function); });
}

// The longest of a row's entries, by what they are the sums of.
template <class S>
S longest_entry(const LoopRows<S>& rows, int row) {
  S size = S(0);
  for (const auto& e : rows.entries[row]) size = maximum(size, e.size);
  return size;
}

// What is left of Q x + target, row by row of each group: allowed is `certified` of the row's own terms, as they are and not as lengths, and of `bias`,
// beside the rounding of what has cancelled, in the row's lengths and, by `free`, in rows of the group. In units of the row to `off`, and the largest;
// zero where none is off. A row of which every entry is noise, by `certified`/64 of what it is the sum of, as data are off by, asks nothing here.
template <class S>
S off_in_own_units(const LoopRows<S>& rows, const std::vector<std::vector<int>>& groups, const S* x, const S* target, const S* bias, const S* free, const S& certified,
                   std::vector<S>& off) {
  using std::abs;
  off.assign(rows.entries.size(), S(0));
  S worst = S(0);
  for (const auto& group : groups) {
    S fastest = S(0);
    for (const int row : group)
      if (const S size = longest_entry(rows, row); size > S(0)) fastest = maximum(fastest, S(free[row] / size));
    for (const int row : group) {
      const S size = longest_entry(rows, row), left = abs(rows.product(row, x) + target[row]);
      S own = bias[row], most = S(0);
      for (const auto& e : rows.entries[row]) own += abs(e.value * x[e.coordinate]), most = maximum(most, S(abs(e.value)));
      if (S(64) * most <= certified * size) continue;
      if (left <= certified * own + S(64) * epsilon<S>() * (rows.product_size(row, x) + size * fastest)) continue;
      off[row] = size > S(0) ? S(left / size) : left;
      worst = maximum(worst, off[row]);
    }
  }
  return worst;
}

// Factors of the rank that a wider scalar found, in the place of those that lost it.
template <class S>
void stand_for(int rank, std::vector<MinimumNormSystem<S>>& systems) {
  const std::vector<S> ones(rank, S(1));
  for (MinimumNormSystem<S>& system : systems) {
    system.begin(rank);
    for (int i = 0; i < rank; ++i) system.add_column(), system.add_entry(i, S(1), S(1));
    system.factor(ones.data(), S(0.5));
    rank = 0;
  }
}

}  // namespace pycraft
