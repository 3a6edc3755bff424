// What a link's hinge leaves of an articulated inertia in factors, P⁺ = U d U*, and how it comes to the parent: columns of the parent's own frame,
// beside those of its own inertia.
//
// Rows that a hinge without a rotor makes zero come first: a pin's about its axis, a slider's along it, a ball's three, all of a free link.
// Where one has a rotor, and of screws, the hinge's row is one more, and P⁺ keeps six columns. U is lower triangular in what rows are left:
// angular ones `turns`, then linear ones `slides`. On the way to the parent's origin only the linear part of a column is shifted.
//
// Of pins about coordinate axes of the parent linear rows come first, and of these those across the axis. Then columns of what pushes along the
// axis, and of couples that turn it over, have exact zeros in the pin's plane, which other pins about the same axis keep: a load that is heavy
// across the plane, where nothing lets it go, is not felt in it.
//
// A link's columns: 0 to 5 what the link that follows it leaves, 6 to 11 its own inertia's, eight for each other link that hangs on it, and its
// rotor's in a place that is left (link_factors.cpp).
#pragma once

#include "kernels/motions.h"
#include "kernels/orthogonal_rows.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// Rows n of a triangle: `turns` axes from row `turned` on and `slides` from row `moved` on, from `first` on those of the two that come first.
struct Left {
  int n, first, turns, slides;
  int turn[3], slide[3];
  bool level = false;  // slides come first
  constexpr int turned() const { return level ? first + slides : first; }
  constexpr int moved() const { return level ? first : first + turns; }
};
template <class Kind>
inline constexpr bool is_level = Kind::pin && !std::is_same_v<Kind, TurnedPin>;
template <class Kind, bool kept>
constexpr Left rows_left() {
  constexpr int K = Kind::row, i = (K + 1) % 3, j = (K + 2) % 3;
  if (is_level<Kind>) return kept ? Left{7, 1, 3, 3, {K, i, j}, {i, j, K}, true} : Left{6, 1, 2, 3, {i, j, 0}, {i, j, K}, true};
  if (Kind::pin) return kept ? Left{7, 1, 3, 3, {K, i, j}, {0, 1, 2}} : Left{6, 1, 2, 3, {i, j, 0}, {0, 1, 2}};
  if (Kind::nv == 1) return kept ? Left{7, 1, 3, 3, {0, 1, 2}, {0, 1, 2}} : Left{6, 1, 3, 2, {0, 1, 2}, {0, 1, 0}};
  return Kind::nv == 3 ? Left{6, 3, 0, 3, {0, 0, 0}, {0, 1, 2}} : Left{6, 6, 0, 0, {0, 0, 0}, {0, 0, 0}};
}

// The row about the axis of a pin whose hinge's row stands by itself.
template <class Kind>
constexpr int row_of_pin() {
  return rows_left<Kind, true>().turned();
}

// A link's columns: from where on they are counted, and where they begin.
template <class S>
struct LinkColumns {
  S *base, *at;
  int fours;
};

// Its own columns, with zeros in the places beside them.
template <class S, class T>
[[gnu::always_inline]] inline void put_own(const LinkFactors<T>& own, S* at) {
  if constexpr (S::width == 1)
    __builtin_memcpy(at + four, own.own, sizeof own.own);
  else
    for (int i = 0; i < 72; ++i) at[four + i] = S(own.own[i]);
}
template <class S>
[[gnu::always_inline]] inline void clear_four(S* at) {
  for (int i = 0; i < four; ++i) at[i] = S(0);
}
template <class S>
[[gnu::always_inline]] inline void clear_column(S* at, int c) {
  for (int row = 0; row < 9; ++row) at[c / 4 * four + 4 * row + c % 4] = S(0);
}

// The column of a rotor: nothing but in the hinge's row, with weight J or of its root.
template <bool roots, class S>
[[gnu::always_inline]] inline void put_rotor(S* at, int c, const S& J) {
  if (c == 12) clear_four(at + 3 * four);
  clear_column(at, c);
  S* const x = at + c / 4 * four + c % 4;
  x[0] = roots ? square_root(J) : S(1), x[weight_row] = J;
}

// b' = (ω × I_c ω; ω × (ω × h)) as accelerations ρ of the own columns, and what of the couple no column takes up.
template <class S, class T>
[[gnu::always_inline]] inline Vector3<S> put_own_accelerations(const LinkFactors<T>& own, const Vector3<S>& omega, S* at) {
  const auto rho = [&](int c, const S& x) { at[(c + 6) / 4 * four + rho_row + (c + 6) % 4] = x; };
  const Vector3<S> along = twice_crossed(omega, spread<S>(own.com));
  const Symmetric3<S> I{S(own.about[0]), S(own.about[1]), S(own.about[2]), S(own.about[3]), S(own.about[4]), S(own.about[5])};
  const Vector3<S> couple = gyroscopic(omega, I);
  for (int i = 0; i < 3; ++i) rho(i, -(S(own.mass_root) * along[i]));
  for (int r = 0; r < 3; ++r) rho(3 + r, S(own.acceleration[3 * r]) * couple[0] + S(own.acceleration[3 * r + 1]) * couple[1] + S(own.acceleration[3 * r + 2]) * couple[2]);
  if (own.whole) return Vector3<S>::zero();
  Matrix3<S> left;
  for (int i = 0; i < 9; ++i) left.m[i] = S(own.left[i]);
  return left * couple;
}

// f(c, n, f, ρ, d): column by column U about the parent's origin in its axes, with ρ - U* a'.
template <class Kind, bool kept, int n, class S, class Rotation, class F>
[[gnu::always_inline]] inline void move_columns(const Triangle<n, S>& L, const Rotation& rotation, const Vector3<S>& arm, const Motion<S>& m, F f) {
  constexpr Left of = rows_left<Kind, kept>();
  static_assert(of.n == n);
  each_of<of.turns>([&](int p) {
    const int r = of.turned() + p;
    Vector3<S> turned = rotation.column(of.turn[p]), moved = Vector3<S>::zero();
    S rho = L.lower[r][n] - m.turning[of.turn[p]];
    each_of<3>([&](int q) {
      if (q <= p || q >= of.turns) return;
      const S& x = L.lower[r][of.turned() + q];
      rotation.add_column(of.turn[q], x, turned), rho -= x * m.turning[of.turn[q]];
    });
    if constexpr (of.level) return f(r - of.first, turned, moved, rho, L.weight[r]);
    each_of<of.slides>([&](int q) { rotation.add_column(of.slide[q], L.lower[r][of.moved() + q], moved); });
    each_of<3>([&](int i) { rho -= moved[i] * m.sliding[i]; });
    f(r - of.first, turned + cross(arm, moved), moved, rho, L.weight[r]);
  });
  each_of<of.slides>([&](int p) {
    const int r = of.moved() + p;
    Vector3<S> moved = rotation.column(of.slide[p]), turned = Vector3<S>::zero();
    each_of<3>([&](int q) {
      if (q > p && q < of.slides) rotation.add_column(of.slide[q], L.lower[r][of.moved() + q], moved);
    });
    S rho = L.lower[r][n];
    each_of<3>([&](int i) { rho -= moved[i] * m.sliding[i]; });
    if constexpr (!of.level) return f(r - of.first, cross(arm, moved), moved, rho, L.weight[r]);
    each_of<of.turns>([&](int q) {
      const S& x = L.lower[r][of.turned() + q];
      rotation.add_column(of.turn[q], x, turned), rho -= x * m.turning[of.turn[q]];
    });
    f(r - of.first, turned + cross(arm, moved), moved, rho, L.weight[r]);
  });
}

// P⁺ of a link among the columns of its parent, from `at` on; roots: with the roots of the weights in them.
template <class Kind, bool kept, bool roots, int n, class S, class T, class Rotation>
[[gnu::always_inline]] inline void put_left(const Triangle<n, S>& L, const Rotation& rotation, const Vector3<S>& arm, const Motion<S>& m, const LinkFactors<T>& parent, S* at) {
  constexpr Left of = rows_left<Kind, kept>();
  move_columns<Kind, kept>(L, rotation, arm, m, [&](int c, const Vector3<S>& turned, const Vector3<S>& moved, const S& rho, const S& weight) {
    S* const x = at + c / 4 * four + c % 4;
    if constexpr (roots) {
      const S root = L.root[of.first + c];
      each_of<3>([&](int i) { x[4 * parent.row[i]] = root * turned[i], x[4 * parent.row[3 + i]] = root * moved[i]; });
      x[rho_row] = root * rho;
    } else {
      each_of<3>([&](int i) { x[4 * parent.row[i]] = turned[i], x[4 * parent.row[3 + i]] = moved[i]; });
      x[rho_row] = rho;
      x[weight_row] = weight;
    }
  });
  for (int c = of.turns + of.slides; c < 4; ++c) clear_column(at, c);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
