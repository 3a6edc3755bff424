// Whether pivots stand out of their rounding where the estimate of pivots.h leaves a doubt: the error sweep of
// algebra/trees/sweeps/singular_pivot.h over links that are eliminated, from what the elimination keeps of them,
//
//   X(k)  = diag P(k) + Σ_{children c} E(k,c) X⁺(c) E(k,c)*,     X⁺ = diag P + τ̄Xτ̄* + G diag(y²) G*
//
// and a state is sound where of every hinge D > 2 rounding · (HXH* + J) and D > faint · y², with twice the bound of the general recursion, as
// links are other frames than bodies. A hinge that is several links has its pivots bounded together: where there is one, nothing is decided here.
// It costs about half of the elimination.
#pragma once

#include "kernels/articulated_links.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
[[gnu::always_inline]] inline S sum_of(const Vector3<S>& x) { return x[0] + x[1] + x[2]; }

// Rows and columns of A by x: A += x y* + y x*
template <class S>
[[gnu::always_inline]] inline void add_both_products(const Vector3<S>& x, const Vector3<S>& y, Symmetric3<S>& A) {
  each_of<3>([&](int r) {
    each_of<3>([&](int k) {
      if (k >= r) A(r, k) += x[r] * y[k] + y[r] * x[k];
    });
  });
}

// D > 2 rounding · (x² + J) and D > faint · felt, of a pivot by its inverse.
template <class S, class T>
[[gnu::always_inline]] inline typename S::Bits stands_out(const Links<T>& links, const S& inverse, const S& error, const S& felt) {
  return greater(inverse, S(0)) & greater(S(1), S(S(T(2) * links.plain.rounding) * error * inverse)) & greater(S(1), S(S(links.plain.faint) * felt * inverse));
}

// Of n pivots by their factors.
template <int n, class S, class T>
inline typename S::Bits stand_out(const Links<T>& links, const Factors<n, S>& factors, const S (&errors)[n], const S (&felt)[n]) {
  typename S::Bits sound = S::all();
  for (int j = 0; j < n; ++j) sound = sound & stands_out(links, factors.inverse[j], factors.reach(j, errors), factors.reach(j, felt));
  return sound;
}

// X⁺ of a hinge of one coordinate whose row is h; errors: HXH* + J.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline typename S::Bits pass_one(const Link<T>& link, const Links<T>& links, const ForwardLink<S>& w, const S& linear, Inertia<S>& X) {
  constexpr int K = Kind::row;
  const Vector3<S>&a = w.alpha, &c = w.acceleration;  // diag P
  const S J(link.J), half(T(0.5)), third(T(1) / 3);
  Vector3<S> turned, moved;  // XH*
  S error, own, felt;
  if constexpr (Kind::pin) {
    turned = {X.A(0, K), X.A(1, K), X.A(2, K)}, moved = {X.B(K, 0), X.B(K, 1), X.B(K, 2)};
    error = turned[K], own = link.oblique ? S(third * sum_of(a)) : a[K], felt = linear;
  } else {
    const S turn(link.turn), travel(link.travel);
    for (int r = 0; r < 3; ++r) turned[r] = turn * X.A(r, K) + travel * X.B(r, K), moved[r] = turn * X.B(K, r) + travel * X.C(r, K);
    error = turn * turned[K] + travel * moved[K], felt = turn * turn * linear;
    own = link.oblique ? S(third * (turn * turn * sum_of(a) + travel * travel * sum_of(c))) : S(turn * turn * a[K] + travel * travel * c[K]);
  }
  own += J;
  const typename S::Bits sound = stands_out(links, w.inverse, S(error + J), link.oblique ? S(felt + own) : felt);
  const Vector3<S> angular = w.inverse * w.angular, along = w.inverse * w.linear;  // G
  const S kept = half * (error + own);
  const Vector3<S> u = kept * angular - turned, v = kept * along - moved;
  add_both_products(u, angular, X.A), add_both_products(v, along, X.C);
  each_of<3>([&](int r) { each_of<3>([&](int k) { X.B(r, k) += u[r] * along[k] + angular[r] * v[k]; }); });
  return sound;
}

template <class S, class T>
inline typename S::Bits pass_ball(const Links<T>& links, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const S& linear, Inertia<S>& X) {
  const Vector3<S>& y = w.alpha;
  const S errors[3] = {X.A(0, 0), X.A(1, 1), X.A(2, 2)}, felt[3] = {linear, linear, linear};
  const typename S::Bits sound = stand_out(links, multiple.ball, errors, felt);
  const Matrix3<S>& gain = multiple.gain;  // G = (1; gain*)
  for (int j = 0; j < 3; ++j) {
    const Vector3<S> along{gain(j, 0), gain(j, 1), gain(j, 2)}, moved{X.B(j, 0), X.B(j, 1), X.B(j, 2)};
    const Vector3<S> turned{X.A(j, 0), X.A(j, 1), X.A(j, 2)};
    const Vector3<S> left = S(T(0.5)) * (y[j] * along + transpose_times(gain, turned)) - moved;
    add_both_products(along, left, X.C);
  }
  X.A = Symmetric3<S>::zero();
  for (int j = 0; j < 3; ++j) {
    X.A(j, j) = y[j];
    for (int r = 0; r < 3; ++r) X.B(j, r) = y[j] * gain(j, r);
  }
  return sound;
}

template <class S, class T>
inline typename S::Bits pass_free(const Links<T>& links, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const S& linear, Inertia<S>& X) {
  const S none(0), errors[6] = {X.A(0, 0), X.A(1, 1), X.A(2, 2), X.C(0, 0), X.C(1, 1), X.C(2, 2)}, felt[6] = {linear, linear, linear, none, none, none};
  const typename S::Bits sound = stand_out(links, multiple.free, errors, felt);
  X.A = X.C = Symmetric3<S>::zero(), X.B = Matrix3<S>::zero();
  for (int j = 0; j < 3; ++j) X.A(j, j) = w.alpha[j], X.C(j, j) = w.acceleration[j];
  return sound;
}

struct TellsNothing {
  template <class X>
  void operator()(int, const X&) const {}
};
// Which lanes are sound, of links first..last that are eliminated, with branches cleared; gone: what sliders add to lengths. apart: as of
// eliminate_links. tell(k, X): of link k.
template <class S, class T, class Tell = TellsNothing>
[[gnu::noinline]] typename S::Bits pivots_stand_out(const Links<T>& links, const States<T>& at, const ForwardWork<S>& w, const S& gone, int first, int last, bool apart, Tell tell = {}) {
  typename S::Bits sound = S::all();
  Inertia<S> X;
  for (int k = last - 1; k >= first; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    const ForwardLink<S>& own = w.link[k];
    start_inward(links, w, k, last, X);
    const auto add_diagonals = [&] {
      for (int i = 0; i < 3; ++i) X.A(i, i) += own.alpha[i], X.C(i, i) += own.acceleration[i];
    };
    add_diagonals();
    tell(k, X);
    const S lever = S(link.longest) + gone, linear = lever * lever * sum_of(own.acceleration);
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      if (!link.prescribed) {  // else nothing is eliminated
        if constexpr (Kind::nv == 1)
          sound = sound & pass_one<Kind>(link, links, own, linear, X);
        else if constexpr (Kind::nv == 3)
          sound = sound & pass_ball(links, own, *w.of(link), linear, X);
        else
          sound = sound & pass_free(links, own, *w.of(link), linear, X);
      }
      if (link.parent < 0) return;
      if (!link.prescribed) add_diagonals();
      const auto rotation = Kind::rotation(own.motion.place);
      rotation.template turn<-1>(X);
      shift<-1>(Kind::arm(link, own.motion.place), X);
    });
    if (apart && k == first)
      w.branch[k] = X;
    else if (link.parent >= 0 && link.parent != k - 1)
      add(w.branch[link.parent], X);
  }
  return sound;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
