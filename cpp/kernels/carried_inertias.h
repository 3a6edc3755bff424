// The estimate of pivots.h once more, where it leaves a doubt, with what hinges carry where it is and not where it could be: the trace of its
// inertia about a link's origin, tip to base,
//
//   m(k) = Σ m,   h(k) = Σ h,   t(k) = Σ tr I,     of a child about the parent's origin:  t + 2 l·(2h + ml),  h + ml,  l and h in the parent's axes
//
// It grows as the square of a chain's length at most where it is folded, and takes a tenth of what the errors of pivot_errors.h do. Coordinates are
// faint where those say so.
#pragma once

#include "kernels/articulated_links.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// D > faint · (l² tr C), and of an axis that is no coordinate axis what its row rounds at beside it.
template <class S, class T>
[[gnu::always_inline]] inline typename S::Bits not_faint(const Links<T>& links, const S& inverse, const S& felt) {
  return greater(inverse, S(0)) & greater(S(1), S(S(links.plain.faint) * felt * inverse));
}

template <class Kind, class S, class T>
[[gnu::always_inline]] inline typename S::Bits estimate_carried(const Link<T>& link, const Links<T>& links, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const S& trace, const S& gone, Inertia<S>& P) {
  const Vector3<S>&a = w.alpha, &c = w.acceleration;  // diag P
  const S turned = S(2) * trace, moved = S(2) * S(link.carried_mass), third(T(1) / 3), lever = S(link.longest) + gone;
  const S linear = lever * lever * (c[0] + c[1] + c[2]);
  if constexpr (Kind::nv == 1) {
    const S turn(Kind::pin ? T(1) : link.turn), travel(Kind::pin ? T(0) : link.travel), J(link.J), turns = turn * turn;
    const S own = third * (turns * (a[0] + a[1] + a[2]) + travel * travel * (c[0] + c[1] + c[2])) + J, felt = turns * linear;
    return estimate_one<Kind>(link, links, S(S(1) / w.inverse), w.inverse, S(J + turns * turned + travel * travel * moved), [&] { return own; }, P) & not_faint(links, w.inverse, link.oblique ? S(felt + own) : felt);
  } else {
    const S carried[6] = {turned, turned, turned, moved, moved, moved}, own[6] = {a[0], a[1], a[2], c[0], c[1], c[2]}, felt[6] = {linear, linear, linear, S(0), S(0), S(0)};
    const auto several = [&](const auto& factors, auto& carried, auto& own, auto& felt) {
      typename S::Bits sound = factors.estimate(carried, own, T(0), links.plain.rounding, P);
      for (int j = 0; j < Kind::nv; ++j) sound = sound & not_faint(links, factors.inverse[j], factors.reach(j, felt));
      return sound;
    };
    if constexpr (Kind::nv == 6) return several(multiple.free, carried, own, felt);
    const S carried3[3] = {turned, turned, turned}, own3[3] = {a[0], a[1], a[2]}, felt3[3] = {linear, linear, linear};
    if constexpr (Kind::nv == 3) return several(multiple.ball, carried3, own3, felt3);
  }
}

// Which lanes are sound, of links that are eliminated, with branches cleared. h is kept in the place of n, t in that of f's first number.
template <class S, class T>
[[gnu::noinline]] typename S::Bits carried_inertias_leave_no_doubt(const Links<T>& links, const States<T>& at, const ForwardWork<S>& w, const S& gone) {
  typename S::Bits sound = S::all();
  Inertia<S> P;
  carry_nothing(P);
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    const ForwardLink<S>& own = w.link[k];
    if (k + 1 == links.count || links.link[k + 1].parent != k) carry_nothing(P);
    if (link.branches) add_carried(P, w.branch[k]);
    P.n = P.n + spread<S>(link.moment);
    P.f[0] += S(link.rotational[0] + link.rotational[3] + link.rotational[5]);
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      sound = sound & estimate_carried<Kind>(link, links, own, *w.of(link), P.f[0], gone, P);
      if (link.parent < 0) return;
      const Vector3<S> arm = Kind::arm(link, own.motion.place), h = Kind::rotation(own.motion.place).to_parent(P.n), ml = S(link.carried_mass) * arm;
      P.f[0] += S(2) * dot(arm, S(2) * h + ml);
      P.n = h + ml;
    });
    if (link.parent < 0)
      sound = sound & sure(P.error, P.growth, links.plain.growth);
    else if (link.parent != k - 1)
      add_carried(w.branch[link.parent], P);
  }
  return sound;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
