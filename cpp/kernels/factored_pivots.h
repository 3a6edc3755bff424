// Whether pivots stand out of their rounding in the factored forms, which round columns: the estimate of pivots.h with the square of a column's
// rounding, and what algebra/trees/sweeps/singular_pivot.h asks of these forms beside it, with twice its bounds, as links are other frames than bodies.
//
//   D > gain · own             of G, a first power of the columns, some digits are left; of axes that are no coordinate axes
//   D > faint · l² tr C        the coordinate feels more than a vanishing part of what its body does along others: C the linear part of P, l the
//                              longest piece of what it carries
//
// What fails is in doubt, and the general recursions decide.
#pragma once

#include "kernels/factored_columns.h"
#include "kernels/pivots.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// Entry (s, s) of P, of the row s of a triangle.
template <int n, class S>
[[gnu::always_inline]] inline S diagonal_of(const Triangle<n, S>& L, int s) {
  S sum = L.weight[s];
  for (int r = 0; r < s; ++r) sum += S(L.weight[r] * L.lower[r][s]) * L.lower[r][s];
  return sum;
}
template <int n, class S>
[[gnu::always_inline]] inline S trace_of_rows(const Triangle<n, S>& L, int a, int b, int c) {
  return diagonal_of(L, a) + diagonal_of(L, b) + diagonal_of(L, c);
}
// l² tr C
template <int n, class S, class T>
[[gnu::noinline]] S linear_part(const Link<T>& link, const LinkFactors<T>& own, const S& gone, const Triangle<n, S>& L) {
  const S lever = S(link.longest) + gone;
  return lever * lever * trace_of_rows(L, own.row[3], own.row[4], own.row[5]);
}

// Of a hinge of one coordinate: which lanes are sound.
template <class Kind, bool kept, int n, class S, class T>
[[gnu::always_inline]] inline typename S::Bits judge_one(const Link<T>& link, const LinkFactors<T>& factors, const Links<T>& links, const S& gone, const Triangle<n, S>& L, Inertia<S>& P) {
  const Bounds<T>& bounds = links.factored;
  const S& inverse = L.inverse[0];
  const S most = carried_inertia<Kind>(link, gone) + S(factors.uncertain);
  const bool askew = link.oblique || links.several;
  S own(0);
  if (askew) {
    const S turn(link.turn), travel(link.travel), third(T(1) / 3);
    if constexpr (Kind::pin)
      own = third * trace_of_rows(L, kept, kept + 1, kept + 2) + S(link.J);
    else if constexpr (kept)
      own = third * (turn * turn * trace_of_rows(L, 1, 2, 3) + travel * travel * trace_of_rows(L, 4, 5, 6)) + S(link.J);
    else
      own = third * trace_of_rows(L, 0, 4, 5);
  }
  typename S::Bits sound = greater(L.weight[0], S(0)) & greater(S(1), S(S(T(2) * bounds.gain) * own * inverse));
  P.error += S(bounds.rounding) * most * inverse;
  if (link.oblique) P.growth *= larger(S(1), S(S(T(0.0625)) * own * inverse));
  const auto faint = greater(S(1), S(S(bounds.faint) * most * inverse));
  if (__builtin_expect(!S::everywhere(faint), 0)) {
    S felt = linear_part(link, factors, gone, L);
    if constexpr (!Kind::pin) felt *= S(link.turn) * S(link.turn);
    sound = sound & (faint | greater(S(1), S(S(T(2) * bounds.faint) * (felt + own) * inverse)));
  }
  return sound;
}

// Of a ball or a free link.
template <int m, int n, class S, class T>
[[gnu::noinline]] typename S::Bits judge_several(const Link<T>& link, const LinkFactors<T>& own_factors, const Links<T>& links, const S& gone, const Triangle<n, S>& L, const Factors<m, S>& factors, Inertia<S>& P) {
  const Bounds<T>& bounds = links.factored;
  const S turned = turned_inertia(link, gone) + S(own_factors.uncertain), moved = S(2) * S(link.carried_mass), none(0);
  const S linear = linear_part(link, own_factors, gone, L);
  S carried[m], own[m], felt[m];
  for (int i = 0; i < m; ++i) {
    carried[i] = i < 3 ? turned : moved, own[i] = diagonal_of(L, i), felt[i] = i < 3 ? linear : none;
    if (links.several) felt[i] += own[i];
  }
  typename S::Bits sound = factors.estimate(carried, own, T(0), bounds.rounding, P);
  for (int j = 0; j < m; ++j)
    sound = sound & greater(S(1), S(S(T(2) * bounds.gain) * factors.reach(j, own) * factors.inverse[j])) & greater(S(1), S(S(T(2) * bounds.faint) * factors.reach(j, felt) * factors.inverse[j]));
  return sound;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
