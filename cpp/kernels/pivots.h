// Pivots of a hinge's inertia D = L d L*, and whether they stand out of what rounding may make of them: the estimate of
// rigid/rigid_elimination.h, with bounds of what a hinge carries that hold at every configuration. With `most` the inertia that a coordinate
// might feel if all masses outboard of it lay as far away as they can reach, and `own` what its row of P rounds at, from the tips inward
//
//   error(k)  = max over children + rounding · most/d,   growth(k) = max over children · max(1, own/d / 16)
//
// A row of a coordinate axis rounds at its own pivot; of an oblique axis at what lies along all three.
//
// A state is sound where every d > faint · most, a slider's also d > 4 error · most of those outboard, and at the roots 4 error growth < 1 and
// growth is below its bound. Else the errors of pivot_errors.h decide; what does not stand out by those is left to the general recursion.
#pragma once

#include "kernels/motions.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// The most that a turn of the link about its origin can feel; `gone`: what sliders add to lengths.
template <class S>
[[gnu::always_inline]] inline S turned_inertia(const LinkOf<S>& link, const S& gone) {
  const S furthest = S(link.furthest) + gone;
  return S(4) * (S(link.carried_rotational) + S(link.carried_mass) * furthest * furthest);
}
// Of a hinge's one coordinate.
template <class Kind, class S>
[[gnu::always_inline]] inline S carried_inertia(const LinkOf<S>& link, const S& gone) {
  const S turned = turned_inertia(link, gone), turn(link.turn), travel(link.travel);
  if constexpr (Kind::pin)
    return S(link.J) + turned;
  else
    return S(link.J) + turn * turn * turned + S(2) * travel * travel * S(link.carried_mass);
}

template <class S>
[[gnu::always_inline]] inline S mean_of_diagonal(const Symmetric3<S>& A) {
  return S(typename S::Scalar(1) / 3) * (A(0, 0) + A(1, 1) + A(2, 2));
}

// What the pivot of one coordinate adds to the estimate. most: what the coordinate can feel; own(): what its row of P rounds at; which lanes are sound.
template <class Kind, class S, class T, class Own>
[[gnu::always_inline]] inline typename S::Bits estimate_one(const Link<T>& link, const Links<T>& links, const S& D, const S& inverse, const S& most, Own own, Inertia<S>& P) {
  typename S::Bits sound = S::all();
  // What a slider moves may all have been taken up outboard: then what those pivots are unsure of is left.
  if constexpr (!Kind::pin) sound = sound & greater(D, S(4) * most * P.error);
  P.error += S(links.plain.rounding) * most * inverse;
  if (link.oblique) P.growth *= larger(S(1), S(S(T(0.0625)) * own() * inverse));
  return sound;
}
// Whether what was estimated of all links of a root leaves no doubt.
template <class S, class T>
[[gnu::always_inline]] inline typename S::Bits sure(const S& error, const S& growth, const T& largest_growth) {
  return greater(S(largest_growth), growth) & greater(S(1), S(T(4)) * error * growth);
}

template <int n, class S>
struct Factors {
  S lower[n][n], inverse[n];  // L below its unit diagonal; 1/d

  // Of a symmetric matrix, its lower triangle.
  void factor(const S (&D)[n][n]) {
    for (int j = 0; j < n; ++j) {
      S scaled[n];  // row j of L times d
      S pivot = D[j][j];
      for (int i = 0; i < j; ++i) {
        scaled[i] = D[j][i];
        for (int a = 0; a < i; ++a) scaled[i] -= lower[i][a] * scaled[a];
        lower[j][i] = scaled[i] * inverse[i];
        pivot -= lower[j][i] * scaled[i];
      }
      inverse[j] = S(1) / pivot;
    }
  }
  // (j + 1) Σ_{i<=j} w(i)² squares(i), w = (-D₁₁⁻¹ D₁ⱼ, 1).
  S reach(int j, const S (&squares)[n]) const {
    S w[n], sum = squares[j];
    for (int back = 1; back <= j; ++back) {
      const int i = j - back;
      w[i] = -lower[j][i];
      for (int a = i + 1; a < j; ++a) w[i] -= lower[a][i] * w[a];
      sum += w[i] * w[i] * squares[i];
    }
    return S(typename S::Scalar(j + 1)) * sum;
  }
  // What its pivots add to the estimate, of which coordinate i can feel carried[i] at most and its row rounds at own[i]; which lanes are sound: where
  // more than a faint part of that is left.
  template <class T>
  typename S::Bits estimate(const S (&carried)[n], const S (&own)[n], const T& faint, const T& rounding, Inertia<S>& P) const {
    typename S::Bits sound = S::all();
    S fresh(0), grown(1);
    for (int j = 0; j < n; ++j) {
      const S most = reach(j, carried) * inverse[j];
      sound = sound & greater(inverse[j], S(0)) & greater(S(1), S(faint) * most);
      fresh = larger(fresh, most), grown = larger(grown, S(reach(j, own) * inverse[j]));
    }
    P.error += S(rounding) * fresh;
    P.growth *= larger(S(1), S(S(T(0.0625)) * grown));
    return sound;
  }
  // V: S, or several of its numbers.
  template <class V>
  void solve(V* x) const {
    each_of<n>([&](int i) {
      for (int a = 0; a < i; ++a) x[i] -= wide<V>(lower[i][a]) * x[a];
    });
    each_of<n>([&](int i) { x[i] *= wide<V>(inverse[i]); });
    each_of<n>([&](int b) {
      const int i = n - 1 - b;
      for (int a = i + 1; a < n; ++a) x[i] -= wide<V>(lower[a][i]) * x[a];
    });
  }
};

// Of a ball, whose D is A; of a free link, whose D is all of P.
template <class S, class T>
inline typename S::Bits factor_ball(Inertia<S>& P, const Link<T>& link, const S& gone, const Links<T>& links, Factors<3, S>& factors) {
  const S turned = turned_inertia(link, gone), carried[3] = {turned, turned, turned}, own[3] = {P.A(0, 0), P.A(1, 1), P.A(2, 2)};
  S D[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j) D[i][j] = P.A(i, j);
  factors.factor(D);
  return factors.estimate(carried, own, links.plain.faint, links.plain.rounding, P);
}
template <class S, class T>
inline typename S::Bits factor_free(Inertia<S>& P, const Link<T>& link, const S& gone, const Links<T>& links, Factors<6, S>& factors) {
  const S turned = turned_inertia(link, gone), moved = S(2) * S(link.carried_mass), carried[6] = {turned, turned, turned, moved, moved, moved};
  const S own[6] = {P.A(0, 0), P.A(1, 1), P.A(2, 2), P.C(0, 0), P.C(1, 1), P.C(2, 2)};
  S D[6][6];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      if (j <= i) D[i][j] = P.A(i, j), D[3 + i][3 + j] = P.C(i, j);
      D[3 + i][j] = P.B(j, i);
    }
  factors.factor(D);
  return factors.estimate(carried, own, links.plain.faint, links.plain.rounding, P);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
