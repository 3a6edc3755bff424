// What the rounding of a residual can make of the correction that is solved from it, on links: algebra/trees/sweeps/residual_rounding.h with
// the sizes of recursions/newton_euler_sizes.h, summed up where they are met. Along d, with y = ℳ⁻¹d, g = φ*H* y and e = φM g,
//
//   Σ |e|* A + Σ |g|* F + Σ |y|* T
//
// A free link's own velocity is in no motion, as it absorbs what that makes.
#pragma once

#include "kernels/refined_links.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
[[gnu::always_inline]] inline Vector3<S> magnitudes(const Vector3<S>& x) {
  return {magnitude(x[0]), magnitude(x[1]), magnitude(x[2])};
}
template <class S>
[[gnu::always_inline]] inline Symmetric3<S> magnitudes(Symmetric3<S> A) {
  for (S& x : A.s) x = magnitude(x);
  return A;
}
// |x × y|, of sizes.
template <class S>
[[gnu::always_inline]] inline Vector3<S> crossed(const Vector3<S>& a, const Vector3<S>& b) {
  return {a[1] * b[2] + a[2] * b[1], a[2] * b[0] + a[0] * b[2], a[0] * b[1] + a[1] * b[0]};
}

// |R|
template <class S>
struct TurnedSizes {
  Matrix3<S> R;
  explicit TurnedSizes(const Full<S>& of) {
    each_of<9>([&](int i) { R.m[i] = magnitude(of.R.m[i]); });
  }
  [[gnu::always_inline]] Vector3<S> to_child(const Vector3<S>& x) const { return transpose_times(R, x); }
  [[gnu::always_inline]] Vector3<S> to_parent(const Vector3<S>& x) const { return R * x; }
  // Whether R was not rounded: a turn by right angles.
  bool exact() const {
    for (const S& x : R.m)
      if (S::mask(greater(x, S(0)) & greater(S(1), x)) != 0) return false;
    return true;
  }
};
template <int K, class S>
struct PlanarSizes {
  static constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  S c, s;
  explicit PlanarSizes(const Planar<K, S>& of) : c(magnitude(of.c)), s(magnitude(of.s)) {}
  [[gnu::always_inline]] Vector3<S> to_child(const Vector3<S>& x) const {
    Vector3<S> y;
    y[i] = c * x[i] + s * x[j], y[j] = c * x[j] + s * x[i], y[K] = x[K];
    return y;
  }
  [[gnu::always_inline]] Vector3<S> to_parent(const Vector3<S>& x) const { return to_child(x); }
  bool exact() const { return S::mask(greater(c, S(0)) & greater(s, S(0))) == 0; }
};
template <class S>
[[gnu::always_inline]] inline TurnedSizes<S> sizes_of(const Full<S>& rotation) { return TurnedSizes<S>(rotation); }
template <int K, class S>
[[gnu::always_inline]] inline PlanarSizes<K, S> sizes_of(const Planar<K, S>& rotation) { return PlanarSizes<K, S>(rotation); }

// Two sums, of motions and of forces, each in its unit.
template <class S>
struct Rounding {
  S motions{0}, forces{0};
  void add(const S& size, bool rounded_as_motions) { (rounded_as_motions ? motions : forces) += size; }
};

// A(k), with dω of the link.
template <class Kind, class V, class S, class T, class Sizes>
[[gnu::always_inline]] inline Force<S> motion_sizes(const Link<T>& link, const States<T>& at, const Motion<S>& m, const RefinedLink<S, V>* above, const Vector3<S>* omega_above, const Sizes& rotation, const S* x, RefinedLink<S, V>& own) {
  const auto velocity = [&](int i) { return magnitude(gathered<S>(at.v + link.v + i, at.v_stride, at.states)); };
  const Vector3<S> arm = magnitudes(Kind::arm(link, m.place)), none = Vector3<S>::zero(), omega = magnitudes(m.omega);
  Vector3<S> turn = none, slide = none;
  Force<S> A{magnitudes(own.alpha) + magnitudes(m.turning), magnitudes(own.acceleration)};
  if constexpr (Kind::nv == 1) {
    constexpr int K = Kind::row;
    const S turned = Kind::pin ? S(1) : magnitude(S(link.turn)), rate = magnitude(x[link.v]);
    turn[K] = turned * velocity(0), A.n[K] += turned * rate;
    if constexpr (!Kind::pin) slide[K] = magnitude(S(link.travel)) * velocity(0), A.f[K] += magnitude(S(link.travel)) * rate;
  } else {
    each_of<3>([&](int i) { turn[i] = velocity(i), A.n[i] += magnitude(x[link.v + i]); });
    if constexpr (Kind::nv == 6) each_of<3>([&](int i) { A.f[i] += magnitude(x[link.v + 3 + i]); });
  }
  own.off = length(omega) + length(turn);
  Vector3<S> carried = above ? magnitudes(above->acceleration) + crossed(arm, magnitudes(above->alpha)) : magnitudes(spread<S>(at.gravity));
  if (above) {
    const Vector3<S> before = magnitudes(*omega_above), W{before[0] + above->off, before[1] + above->off, before[2] + above->off};
    own.off += above->off + length(before);
    if constexpr (Kind::nv < 6) carried = carried + magnitudes(m.sliding) + crossed(W, crossed(W, arm));
    A.n = A.n + rotation.to_child(magnitudes(above->alpha));
  }
  const Vector3<S> W{omega[0] + own.off, omega[1] + own.off, omega[2] + own.off};
  A.n = A.n + crossed(W, turn);
  A.f = A.f + rotation.to_child(carried) + S(2) * crossed(W, slide);
  return A;
}

// Σ |g|* F of what the link adds itself, (gn; gf) the sizes of g.
template <class V, class S, class T>
[[gnu::always_inline]] inline void add_force_sizes(const Link<T>& link, const T* wrench, const Vector3<S>& omega, const RefinedLink<S, V>& own, const Vector3<S>& gn, const Vector3<S>& gf, Rounding<S>& sum) {
  const Symmetric3<S> I = rotational_of<S>(link), sizes = magnitudes(I);
  const Vector3<S> h = spread<S>(link.moment), moment = magnitudes(h), alpha = magnitudes(own.alpha), acceleration = magnitudes(own.acceleration);
  Vector3<S> n = S(2) * (sizes * alpha + crossed(moment, acceleration)) + magnitudes(own.total.n);
  Vector3<S> f = S(2) * (S(link.mass) * acceleration + crossed(moment, alpha)) + magnitudes(own.total.f);
  if (wrench) n = n + magnitudes(spread<S>(wrench)), f = f + magnitudes(spread<S>(wrench + 3));
  sum.forces += dot(gn, n) + dot(gf, f);
  sum.motions += dot(gn, magnitudes(gyroscopic(omega, I))) + dot(gf, magnitudes(twice_crossed(omega, h)));
  const Vector3<S> size = magnitudes(omega), W{size[0] + own.off, size[1] + own.off, size[2] + own.off};
  sum.motions += dot(gn, crossed(W, sizes * W)) + dot(gf, crossed(W, crossed(W, moment)));
}

// |y|* T of one coordinate of a link.
template <class Kind, class V, class S, class T>
[[gnu::always_inline]] inline void add_coordinate_sizes(const Link<T>& link, const States<T>& at, const RefinedLink<S, V>& own, const S* x, int i, const S& y, Rounding<S>& sum) {
  const S tau = magnitude(gathered<S>(at.u + link.v + i, at.u_stride, at.states));
  if constexpr (Kind::nv == 1) {
    constexpr int K = Kind::row;
    const S n = magnitude(own.total.n[K]), f = magnitude(own.total.f[K]);
    const S size = Kind::pin ? n : S(magnitude(S(link.turn)) * n + magnitude(S(link.travel)) * f);
    sum.add(y * size, !Kind::pin && link.turn != 0);
    sum.forces += y * (S(link.J) * magnitude(x[link.v]) + tau);
  } else {
    sum.forces += y * (magnitude(i < 3 ? own.total.n[i] : own.total.f[i - 3]) + tau);
  }
}

// Along `scale` times the correction. units: of motions and of forces.
template <class V, class S, class T>
[[gnu::noinline]] S rounding_along_correction(const Links<T>& links, const States<T>& at, const RefinedWork<S, V>& w, const S& scale, T motion_unit, T force_unit) {
  Rounding<S> sum;
  for (int k = 0; k < links.count; ++k) w.link[k].carried = Force<S>::zero();
  const auto carried = [&](int k) -> Force<S>& { return w.link[k].carried; };
  inward<S>(links, at, carried, [&](int k, Force<S>& z) {
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) {
      const auto force = [&](int i) { return S(scale * (decltype(kind)::nv == 1 ? S(S(link.sign) * w.delta[link.v]) : w.delta[link.v + i])); };
      innovate<decltype(kind)>(link, w, k, force, z);
    });
  });
  outward(links, 0, links.count, Vector3<S>::zero(), w.response, [&](int k, Vector3<S>& alpha, Vector3<S>& acceleration) {
    const Link<T>& link = links.link[k];
    RefinedLink<S, V>& own = w.link[k];
    const Motion<S>& m = w.forward.link[k].motion;
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      const auto rotation = sizes_of(Kind::rotation(m.place));
      if (link.parent >= 0) {
        const Vector3<S> f = rotation.to_parent(magnitudes(own.total.f)), n = rotation.to_parent(magnitudes(own.total.n)) + crossed(magnitudes(Kind::arm(link, m.place)), f);
        sum.add(dot(magnitudes(alpha), n) + dot(magnitudes(acceleration), f), !(Kind::pin && rotation.exact()));
      }
      accelerate_link<Kind, false>(link, w.forward.link[k], own.innovation, w.rate(link), w.forward.of(link), alpha, acceleration,
                                   [&](int i, const S& y, const S*) { add_coordinate_sizes<Kind>(link, at, own, w.x, i, magnitude(y), sum); });
      const bool root = link.parent < 0;
      const RefinedLink<S, V>* const above = root ? nullptr : w.link + link.parent;
      own.motion = motion_sizes<Kind>(link, at, m, above, root ? nullptr : &w.forward.link[link.parent].motion.omega, rotation, w.x, own);
      add_force_sizes(link, at.wrenches ? at.wrenches + 6 * k : nullptr, m.omega, own, magnitudes(alpha), magnitudes(acceleration), sum);
      const Vector3<S> h = spread<S>(link.moment);
      own.carried = {rotational_of<S>(link) * alpha + cross(h, acceleration), S(link.mass) * acceleration + cross(alpha, h)};
    });
  });
  inward<S>(links, at, carried, [&](int k, Force<S>& e) {
    const Link<T>& link = links.link[k];
    const RefinedLink<S, V>& own = w.link[k];
    sum.motions += dot(magnitudes(e.n), own.motion.n) + dot(magnitudes(e.f), own.motion.f);
    with_step(link.step, [&](auto kind) { to_parent<decltype(kind)>(link, w.forward.link[k].motion, e); });
  });
  return S(motion_unit) * sum.motions + S(force_unit) * sum.forces;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
