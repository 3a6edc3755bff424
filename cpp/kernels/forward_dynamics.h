// Forward dynamics on links: the articulated-body algorithm of recursions/articulated_body.h, the equations written out for each kind of step.
//
//   tip to base:  D = P_hh + J,  ε = T - z_h,  G = P_h/D,  P⁺ = P - G P_h*,  z⁺ = z + G ε + P⁺ a'
//   base to tip:  α⁺ = E* α(p) + a',   θ̈ = D⁻¹(ε - P_h* α⁺)
//
// with P_h the column of the hinge's axis. What projecting out a hinge without J makes zero is neither stored nor computed: a pin's row of A
// and B. The inertia of a chain stays at hand from link to link; only branches are laid aside, at their parent.
//
// Where the estimate of pivots.h leaves a doubt of a pivot, that of carried_inertias.h may not, and else the errors of pivot_errors.h decide.
#pragma once

#include "kernels/carried_inertias.h"
#include "kernels/pivot_errors.h"
#include "kernels/prescribed_links.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// Three numbers of what acts from outside.
template <class S, class T>
[[gnu::always_inline]] inline Vector3<S> acting(const T* x, size_t stride, int states) {
  if constexpr (std::is_same_v<T, double> && S::width > 1)
    if (stride) [[unlikely]] return {gathered<S>(x, stride, states), gathered<S>(x + 1, stride, states), gathered<S>(x + 2, stride, states)};
  return spread<S>(x);
}
// P += M, z += b' - what is applied. forces: whether z is wanted at all, here and below.
template <bool forces, class S, class T>
[[gnu::always_inline]] inline void add_own(const Link<T>& link, const States<T>& at, int k, const Vector3<S>& omega, Inertia<S>& P) {
  const Symmetric3<S> I = rotational_of<S>(link);
  const Vector3<S> h = spread<S>(link.moment);
  const S m(link.mass);
  for (int i = 0; i < 6; ++i) P.A.s[i] += I.s[i];
  P.B(0, 1) -= h[2], P.B(0, 2) += h[1], P.B(1, 0) += h[2], P.B(1, 2) -= h[0], P.B(2, 0) -= h[1], P.B(2, 1) += h[0];
  P.C(0, 0) += m, P.C(1, 1) += m, P.C(2, 2) += m;
  if constexpr (!forces) return;
  P.n = P.n + gyroscopic(omega, I);
  P.f = P.f + twice_crossed(omega, h);
  if (!at.wrenches) return;
  const T* const wrench = at.wrenches + 6 * k;
  P.n = P.n - acting<S>(wrench, at.wrench_stride, at.states), P.f = P.f - acting<S>(wrench + 3, at.wrench_stride, at.states);
}

// P⁺ and z⁺ of a pin, P in its axes and of it.
template <int K, bool rotor, bool forces, class S>
[[gnu::always_inline]] inline void project_pin(const S& ratio, const Vector3<S>& turning, const S& force, const ForwardLink<S>& __restrict w, Inertia<S>& __restrict P) {
  constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  const S gi = w.angular[i] * w.inverse, gj = w.angular[j] * w.inverse;
  const Vector3<S> gf = w.inverse * w.linear;
  P.A(i, i) -= gi * w.angular[i], P.A(i, j) -= gi * w.angular[j], P.A(j, j) -= gj * w.angular[j];
  for (int r = 0; r < 3; ++r) {
    P.B(i, r) -= gi * w.linear[r], P.B(j, r) -= gj * w.linear[r];
    for (int k = r; k < 3; ++k) P.C(r, k) -= gf[r] * w.linear[k];
  }
  if constexpr (forces) {
    P.n[i] += gi * w.innovation + P.A(i, i) * turning[i] + P.A(i, j) * turning[j];
    P.n[j] += gj * w.innovation + P.A(i, j) * turning[i] + P.A(j, j) * turning[j];
    P.f = P.f + w.innovation * gf;
    each_of<3>([&](int r) { P.f[r] += P.B(i, r) * turning[i] + P.B(j, r) * turning[j]; });
    P.n[K] = force;
  }
  if constexpr (rotor) {  // what the rotor keeps of the row: J/D of it
    P.A(K, K) *= ratio, P.A(i, K) *= ratio, P.A(j, K) *= ratio;
    for (int r = 0; r < 3; ++r) P.B(K, r) *= ratio;
    if constexpr (forces) P.n[K] = force - ratio * w.innovation + P.A(i, K) * turning[i] + P.A(j, K) * turning[j];
  }
}

// P⁺ and ε's part of z⁺ of a slider or a screw.
template <bool forces, class S>
[[gnu::always_inline]] inline void project_out(const LinkOf<S>& link, const ForwardLink<S>& __restrict w, Inertia<S>& __restrict P) {
  const Vector3<S> turned = w.inverse * w.angular, moved = w.inverse * w.linear;
  for (int r = 0; r < 3; ++r)
    for (int k = 0; k < 3; ++k) {
      if (k >= r) P.A(r, k) -= turned[r] * w.angular[k], P.C(r, k) -= moved[r] * w.linear[k];
      P.B(r, k) -= turned[r] * w.linear[k];
    }
  if constexpr (forces) P.n = P.n + w.innovation * turned, P.f = P.f + w.innovation * moved;
  if (link.turn == 0 && !link.rotor)
    for (int r = 0; r < 3; ++r) P.C(r, 2) = P.B(r, 2) = S(0);
}

// D⁻¹B of a ball, from the factors of D.
template <class S>
[[gnu::always_inline]] inline void find_gain(const Inertia<S>& P, ForwardMultiple<S>& w) {
  for (int r = 0; r < 3; ++r) {
    S column[3] = {P.B(0, r), P.B(1, r), P.B(2, r)};
    w.ball.solve(column);
    for (int i = 0; i < 3; ++i) w.gain(i, r) = column[i];
  }
}

// P⁺ of a ball.
template <class S>
[[gnu::always_inline]] inline void project_ball(const ForwardMultiple<S>& w, Inertia<S>& P) {
  for (int r = 0; r < 3; ++r)
    for (int k = r; k < 3; ++k) P.C(r, k) -= P.B(0, r) * w.gain(0, k) + P.B(1, r) * w.gain(1, k) + P.B(2, r) * w.gain(2, k);
  P.A = Symmetric3<S>::zero(), P.B = Matrix3<S>::zero();
}

// A ball eliminated. `force` and `rotation` as below.
template <bool forces, class S, class T, class Force, class Rotation>
[[gnu::always_inline]] inline void eliminate_ball(const Link<T>& link, const Links<T>& links, const S& gone, const Motion<S>& m, const Rotation& rotation, const Vector3<S>& arm, Force force,
                                                  ForwardMultiple<S>& multiple, Inertia<S>& P, typename S::Bits& sound) {
  sound = sound & factor_ball(P, link, gone, links, multiple.ball);
  find_gain(P, multiple);
  if constexpr (forces) {
    for (int i = 0; i < 3; ++i) multiple.rate[i] = force(i) - P.n[i];
    multiple.ball.solve(multiple.rate);
    P.f = P.f + transpose_times(P.B, Vector3<S>{multiple.rate[0], multiple.rate[1], multiple.rate[2]});
  }
  if (link.parent < 0) return;
  project_ball(multiple, P);
  rotation.turn_symmetric(P.C);
  if constexpr (forces) {
    P.f = rotation.to_parent(P.f) + P.C * m.sliding;
    P.n = rotation.to_parent(Vector3<S>{force(0), force(1), force(2)}) + cross(arm, P.f);
  }
  shift<-1>(arm, P);
}
// A free link eliminated: nothing but the force that is put on it is left.
template <bool forces, class S, class T, class Force, class Rotation>
[[gnu::always_inline]] inline void eliminate_free(const Link<T>& link, const Links<T>& links, const S& gone, const Rotation& rotation, const Vector3<S>& arm, Force force, ForwardMultiple<S>& multiple,
                                                  Inertia<S>& P, typename S::Bits& sound) {
  sound = sound & factor_free(P, link, gone, links, multiple.free);
  if constexpr (forces) {
    for (int i = 0; i < 3; ++i) multiple.rate[i] = force(i) - P.n[i], multiple.rate[3 + i] = force(3 + i) - P.f[i];
    multiple.free.solve(multiple.rate);
    P.f = rotation.to_parent(Vector3<S>{force(3), force(4), force(5)});
    P.n = rotation.to_parent(Vector3<S>{force(0), force(1), force(2)}) + cross(arm, P.f);
  }
  if (link.parent < 0) return;
  P.A = P.C = Symmetric3<S>::zero(), P.B = Matrix3<S>::zero();
}

// The hinge of link k eliminated: D⁻¹, ε, P_h, and unless it is a root P⁺ and z⁺ about the parent's origin, in its axes.
template <class Kind, bool rotor, bool forces, class S, class T>
[[gnu::flatten]] void eliminate(const Link<T>& link, const Links<T>& links, const States<T>& at, const S& gone, ForwardLink<S>& __restrict w, ForwardMultiple<S>* __restrict multiple, Inertia<S>& __restrict P,
                                             typename S::Bits& sound) {
  const Motion<S>& m = w.motion;
  const auto force = [&](int i) { return forces && at.u ? gathered<S>(at.u + link.v + i, at.u_stride, at.states) : S(0); };
  const bool root = link.parent < 0;
  const auto rotation = Kind::rotation(m.place);
  constexpr int K = Kind::row;
  w.keep_diagonals(P);
  if constexpr (Kind::nv == 1) {
    const S J(link.J), tau = S(link.sign) * force(0);
    S D(J), along;
    if constexpr (Kind::pin) {
      w.angular = {P.A(0, K), P.A(1, K), P.A(2, K)}, w.linear = {P.B(K, 0), P.B(K, 1), P.B(K, 2)};
      D += w.angular[K], along = P.n[K];
    } else {
      const S turn(link.turn), travel(link.travel);
      for (int r = 0; r < 3; ++r) w.angular[r] = turn * P.A(r, K) + travel * P.B(r, K), w.linear[r] = turn * P.B(K, r) + travel * P.C(r, K);
      D += turn * w.angular[K] + travel * w.linear[K], along = turn * P.n[K] + travel * P.f[K];
    }
    const auto own = [&]() -> S {
      const S turn(link.turn), travel(link.travel);
      return Kind::pin ? S(mean_of_diagonal(P.A) + J) : S(turn * turn * mean_of_diagonal(P.A) + travel * travel * mean_of_diagonal(P.C) + J);
    };
    const S most = carried_inertia<Kind>(link, gone);
    w.inverse = S(1) / D;
    sound = sound & greater(D, S(links.plain.faint) * most) & estimate_one<Kind>(link, links, D, w.inverse, most, own, P);
    if constexpr (forces) w.innovation = tau - along;
    if (root) return;
    constexpr int zero = Kind::pin && !rotor ? K : -1;
    if constexpr (Kind::pin) {
      project_pin<K, rotor, forces>(S(J * w.inverse), m.turning, tau, w, P);
    } else {
      project_out<forces>(link, w, P);
      if constexpr (forces) P.n = P.n + P.A * m.turning, P.f = P.f + transpose_times(P.B, m.turning);
    }
    rotation.template turn<zero>(P);
    constexpr int left = decltype(rotation)::template turned_zero<zero>;
    if constexpr (forces) {
      P.n = rotation.to_parent(P.n), P.f = rotation.to_parent(P.f) + P.C * m.sliding;
      each_of<3>([&](int r) {
        if (r != left) P.n[r] += P.B(r, 0) * m.sliding[0] + P.B(r, 1) * m.sliding[1] + P.B(r, 2) * m.sliding[2];
      });
      P.n = P.n + cross(Kind::arm(link, m.place), P.f);
    }
    shift<left>(Kind::arm(link, m.place), P);
  } else if constexpr (Kind::nv == 3) {
    eliminate_ball<forces>(link, links, gone, m, rotation, Kind::arm(link, m.place), force, *multiple, P, sound);
  } else {
    eliminate_free<forces>(link, links, gone, rotation, Kind::arm(link, m.place), force, *multiple, P, sound);
  }
}

// A link's acceleration (alpha; acceleration) from its parent's, with the terms a' of motion or, as of a correction, without. innovation: ε; rate:
// D⁻¹ε of several coordinates. give(i, x, absorbed): θ̈ + x of coordinate i, and where its hinge absorbs its own terms (motions.h) those.
template <class Kind, bool moving, class S, class T, class Give>
[[gnu::always_inline]] inline void accelerate_link(const Link<T>& link, const ForwardLink<S>& w, const S& innovation, const S* rate, const ForwardMultiple<S>* multiple, Vector3<S>& alpha,
                                                   Vector3<S>& acceleration, Give give) {
  const Motion<S>& m = w.motion;
  const auto rotation = Kind::rotation(m.place);
  Vector3<S> linear = acceleration + cross(alpha, Kind::arm(link, m.place));
  if constexpr (moving && Kind::nv < 6) linear = linear + m.sliding;
  acceleration = rotation.to_child(linear);
  alpha = rotation.to_child(alpha);
  const S* const nothing = nullptr;
  if constexpr (Kind::nv == 1) {
    constexpr int K = Kind::row, i = (K + 1) % 3, j = (K + 2) % 3;
    if constexpr (Kind::pin) {
      if constexpr (moving) alpha[i] += m.turning[i], alpha[j] += m.turning[j];
      const S left = innovation - w.angular[i] * alpha[i] - w.angular[j] * alpha[j] - dot(w.linear, acceleration);
      // D θ̈ = left - P_KK α_K. Without a rotor D is P_KK, and the link turns as if nothing turned its parent.
      if (link.rotor) {
        const S rate = (left - w.angular[K] * alpha[K]) * w.inverse;
        give(0, S(S(link.sign) * rate), nothing);
        alpha[K] += rate;
      } else {
        const S whole = left * w.inverse;
        give(0, S(S(link.sign) * (whole - alpha[K])), nothing);
        alpha[K] = whole;
      }
    } else {
      if constexpr (moving) alpha = alpha + m.turning;
      const S rate = (innovation - dot(w.angular, alpha) - dot(w.linear, acceleration)) * w.inverse;
      alpha[K] += S(link.turn) * rate, acceleration[K] += S(link.travel) * rate;
      give(0, S(S(link.sign) * rate), nothing);
    }
  } else if constexpr (Kind::nv == 3) {
    if constexpr (moving) alpha = alpha + m.turning;
    const Vector3<S> whole = Vector3<S>{rate[0], rate[1], rate[2]} - multiple->gain * acceleration;
    each_of<3>([&](int i) { give(i, S(whole[i] - alpha[i]), nothing); });
    alpha = whole;
  } else {
    if constexpr (moving) alpha = alpha + m.turning;
    for (int i = 0; i < 3; ++i) give(i, S(rate[i] - alpha[i]), nothing), give(3 + i, S(rate[3 + i] - acceleration[i]), &m.sliding[i]);
    alpha = {rate[0], rate[1], rate[2]}, acceleration = {rate[3], rate[4], rate[5]};
  }
}

// θ̈ of a link to out.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void accelerate(const Link<T>& link, const States<T>& at, const ForwardLink<S>& w, const ForwardMultiple<S>* multiple, Vector3<S>& alpha, Vector3<S>& acceleration,
                                              double* out, size_t stride) {
  accelerate_link<Kind, true>(link, w, w.innovation, multiple->rate, multiple, alpha, acceleration, [&](int i, const S& x, const S* absorbed) {
    scattered(absorbed ? S(x - *absorbed) : x, out + link.v + i, stride, at.states);
  });
}

struct KeepsNothing {
  template <class P>
  void operator()(int, const P&) const {}
};
template <class S, class T>
inline void clear_branches(const Links<T>& links, const ForwardWork<S>& w, int first, int last) {
  for (int k = first; k < last; ++k)
    if (links.link[k].branches) w.branch[k] = no_inertia<S>();
}
// Articulated inertias, and the forces that go with them, tip to base, of links first..last, which are placed; branches are cleared. Which lanes
// are sound. apart: a subtree whose P⁺ is left in its root's branch (join_parent). keep(k, P): P⁺ of link k about its parent's origin, in the
// parent's axes.
template <bool forces, class S, class T, class Keep = KeepsNothing>
[[gnu::always_inline]] inline typename S::Bits eliminate_links(const Links<T>& links, const States<T>& at, const ForwardWork<S>& w, const S& gone, int first, int last, bool apart, Keep keep = {}) {
  typename S::Bits sound = S::all();
  Inertia<S> P;
  for (int k = last - 1; k >= first; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    ForwardLink<S>& own = w.link[k];
    start_inward(links, w, k, last, P);
    add_own<forces>(link, at, k, own.motion.omega, P);
    if (forces && link.prescribed) [[unlikely]]
      pass_inward(link, own, w.of(link), P);
    else if (link.rotor)
      with_step(link.step, [&](auto kind) { eliminate<decltype(kind), decltype(kind)::pin, forces>(link, links, at, gone, own, w.of(link), P, sound); });
    else
      with_step(link.step, [&](auto kind) { eliminate<decltype(kind), false, forces>(link, links, at, gone, own, w.of(link), P, sound); });
    keep(k, P);
    if (link.parent < 0)
      sound = sound & sure(P.error, P.growth, links.plain.growth);
    else if (apart && k == first)
      w.branch[k] = P;
    else if (link.parent != k - 1)
      add(w.branch[link.parent], P);
  }
  return sound;
}
// Which lanes a closer look at links that are eliminated calls sound.
template <class S, class T>
[[gnu::noinline]] typename S::Bits closer_look(const Links<T>& links, const States<T>& at, const ForwardWork<S>& w, const S& gone) {
  clear_branches(links, w, 0, links.count);
  const typename S::Bits sound = carried_inertias_leave_no_doubt(links, at, w, gone);
  if (S::everywhere(sound)) return sound;
  clear_branches(links, w, 0, links.count);
  return sound | pivots_stand_out(links, at, w, gone, 0, links.count, false);
}
// The same of all links, with a closer look where that is needed.
template <bool forces, class S, class T, class Keep = KeepsNothing>
[[gnu::noinline]] typename S::Bits articulated_tip_to_base(const Links<T>& links, const States<T>& at, const ForwardWork<S>& w, Keep keep = {}) {
  const S gone = travel<S>(links, at);
  clear_branches(links, w, 0, links.count);
  const typename S::Bits sound = eliminate_links<forces>(links, at, w, gone, 0, links.count, false, keep);
  if constexpr (!S::recorded)
    if (!links.several && S::mask(sound) != S::mask(S::all())) return sound | closer_look(links, at, w, gone);
  return sound;
}

template <class S, class T>
[[gnu::always_inline]] inline void move_links(const Links<T>& links, const States<T>& at, const ForwardWork<S>& w, int first, int last) {
  for (int k = first; k < last; ++k) {
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      Motion<S>& m = w.link[k].motion;
      place_link<Kind>(link, at, m.place);
      move_link<Kind>(link, at, link.parent < 0 ? nullptr : &w.link[link.parent].motion.omega, m);
    });
    if (link.prescribed) [[unlikely]] prescribe(link, at, w.link[k]);
  }
}
// Where links are and how they move, and what is eliminated. Which lanes are sound.
template <class S, class T>
[[gnu::always_inline]] inline typename S::Bits move_and_eliminate(const Links<T>& links, const States<T>& at, const ForwardWork<S>& w) {
  move_links(links, at, w, 0, links.count);
  return articulated_tip_to_base<true>(links, at, w);
}

// Accelerations, base to tip, of links first..last, those of a chain at hand: visit(k, alpha, acceleration) makes a parent's the link's. kept: those
// of links that branch or end the piece, with alpha and acceleration; base: of what carries the roots.
template <class S, class T, class Kept, class Visit>
[[gnu::always_inline]] inline void outward(const Links<T>& links, int first, int last, const Vector3<S>& base, Kept* kept, Visit visit) {
  Vector3<S> alpha, acceleration;
  for (int k = first; k < last; ++k) {
    const Link<T>& link = links.link[k];
    if (link.parent < 0)
      alpha = Vector3<S>::zero(), acceleration = base;
    else if (link.parent != k - 1 || k == first)
      alpha = kept[link.parent].alpha, acceleration = kept[link.parent].acceleration;
    visit(k, alpha, acceleration);
    if (link.branches || k + 1 == last) kept[k].alpha = alpha, kept[k].acceleration = acceleration;
  }
}

template <class S, class T>
[[gnu::always_inline]] inline void accelerate_links(const Links<T>& links, const States<T>& at, const ForwardWork<S>& w, int first, int last, double* out, size_t stride) {
  outward(links, first, last, Vector3<S>(-acting<S>(at.gravity, at.gravity_stride, at.states)), w.link, [&](int k, Vector3<S>& alpha, Vector3<S>& acceleration) {
    const Link<T>& link = links.link[k];
    if (link.prescribed) [[unlikely]] return pass_outward(link, at, w.link[k], w.of(link), alpha, acceleration, out, stride);
    with_step(link.step, [&](auto kind) { accelerate<decltype(kind)>(link, at, w.link[k], w.of(link), alpha, acceleration, out, stride); });
  });
}

template <class S>
unsigned forward_dynamics(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar* work) {
  const ForwardWork<S> w(links, work);
  const typename S::Bits sound = move_and_eliminate(links, at, w);
  accelerate_links(links, at, w, 0, links.count, out, stride);
  return S::mask(sound);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
