// Whether pivots stand out of their rounding in the factored forms, which round columns: the estimate of pivots.h with the square of a column's
// rounding, and what algebra/trees/sweeps/singular_pivot.h asks of these forms beside it, with twice its bounds, as links are other frames than bodies.
//
//   D > gain · own             of G, a first power of the columns, some digits are left; of axes that are no coordinate axes
//   D > faint · l² tr C        the coordinate feels more than a vanishing part of what its body does along others: C the linear part of P, l the
//                              longest piece of what it carries
//
// Of a pin on which nothing hangs but pins about the same axis the part of C along that axis is left out: no rounding of a length brings it into the
// row of the hinge. Columns that came from elsewhere still may, and leak: each has entries in the plane and across it, and where pivots in the
// plane have taken up all that is heavy in it rounding of what is heavy across is left there. Where a pin finds both linear pivots in the plane
// more than a vanishing part of C, columns are apart from there on (factored_columns.h), and it leaks no more.
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
template <class S, class T>
[[gnu::always_inline]] inline S lever_squared(const Link<T>& link, const S& gone) {
  const S lever = S(link.longest) + gone;
  return lever * lever;
}
// l² tr C
template <int n, class S, class T>
[[gnu::noinline]] S linear_part(const Link<T>& link, const LinkFactors<T>& own, const S& gone, const Triangle<n, S>& L) {
  return lever_squared(link, gone) * trace_of_rows(L, own.row[3], own.row[4], own.row[5]);
}
// The same of a pin about axis K, of what lies along it only the leaking part, 0 or 1.
template <int K, int n, class S, class T>
[[gnu::noinline]] S linear_part_across(const Link<T>& link, const LinkFactors<T>& own, const S& gone, const Triangle<n, S>& L, const S& leaking) {
  const S plane = diagonal_of(L, own.row[3 + (K + 1) % 3]) + diagonal_of(L, own.row[3 + (K + 2) % 3]);
  return lever_squared(link, gone) * (plane + leaking * diagonal_of(L, own.row[3 + K]));
}

// Whether link k leaks, before its outboard links are seen: 1 where one of those is no pin about the same axis, or has a rotor of which rounding is
// left: a share of the hinge's row, J/D of it. Links come from the base outward.
template <class S, class T>
[[gnu::always_inline]] inline void start_leaks(const Links<T>& links, int k, bool rotors_leak, S* leaking) {
  const Link<T>& link = links.link[k];
  const auto axis = [](Step pin) { return pin < Step::turned_pin ? static_cast<int>(pin) : 2; };
  leaking[k] = S(T(link.step <= Step::turned_pin ? 0 : 1));
  if (link.parent < 0) return;
  const Step above = links.link[link.parent].step;
  if (above <= Step::turned_pin && !(link.step < Step::turned_pin && axis(link.step) == axis(above) && !(rotors_leak && link.rotor))) leaking[link.parent] = S(1);
}
// What a pin leaks to its parent; its linear pivots in the plane are the first after the hinge's.
template <int n, class S, class T>
[[gnu::always_inline]] inline void pass_leak(const Link<T>& link, const LinkFactors<T>& own, const Links<T>& links, const Triangle<n, S>& L, const S& leaking, S* leaking_of) {
  if (link.parent < 0 || S::everywhere(greater(S(1), leaking)) || S::everywhere(greater(leaking_of[link.parent], S(0)))) return;
  const S least = S(T(2) * links.factored.faint) * trace_of_rows(L, own.row[3], own.row[4], own.row[5]);
  const S left = S::choose(greater(L.weight[1], least) & greater(L.weight[2], least), S(0), leaking);
  leaking_of[link.parent] = larger(leaking_of[link.parent], left);
}

// Of a hinge of one coordinate: which lanes are sound.
template <class Kind, bool kept, int n, class S, class T>
[[gnu::always_inline]] inline typename S::Bits judge_one(const Link<T>& link, const LinkFactors<T>& factors, const Links<T>& links, const S& gone, const Triangle<n, S>& L, const S& leaking, Inertia<S>& P) {
  const Bounds<T>& bounds = links.factored;
  const S& inverse = L.inverse[0];
  const S most = carried_inertia<Kind>(link, gone) + S(factors.uncertain);
  const bool askew = link.oblique || links.several;
  S own(0);
  if (askew) {
    constexpr int turned = rows_left<Kind, kept>().turned();
    const S turn(link.turn), travel(link.travel), third(T(1) / 3);
    if constexpr (Kind::pin)  // of one that does not leak the row is one of a coordinate axis
      own = leaking * third * trace_of_rows(L, kept ? turned + 2 : 0, turned, turned + 1) + S(link.J);
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
    S felt;
    if constexpr (Kind::pin)
      felt = linear_part_across<Kind::row>(link, factors, gone, L, leaking);
    else
      felt = S(link.turn) * S(link.turn) * linear_part(link, factors, gone, L);
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
