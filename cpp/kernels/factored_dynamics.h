// Forward dynamics on links in the factored form ud: recursions/articulated_body.h with P = C W C* and, of the forces that go with it, accelerations
// ρ of its columns, z = y - C W ρ*:
//
//   tip to base:  A = [h C; C; ρ] made orthogonal, so that D = a W a* + J, P_h = C W a*, P⁺ = U d U* (orthogonal_rows.h),
//                 ε = T - y_h,  y⁺ = y + G ε,  ρ⁺ = what is left of ρ, less U* a'
//   base to tip:  α⁺ = E* α(p) + a',   θ̈ = D⁻¹(ε + a W ρ* - P_h* α⁺)
//
// with h the hinge's row and a = h C. The way out, and what a correction takes, are forward_dynamics.h's own: it finds D⁻¹, P_h and ε + a W ρ*
// where that has left D⁻¹, P_h and ε.
#pragma once

#include "kernels/factored_pivots.h"
#include "kernels/forward_dynamics.h"
#include "kernels/reflected_rows.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct FactoredWork {
  ForwardWork<S> forward;
  S* columns;  // of links that branch
  S* leaking;  // of every link (factored_pivots.h)
  template <class T>
  FactoredWork(const Links<T>& links, const ForwardWork<S>& forward, T* own)
      : forward(forward), columns(reinterpret_cast<S*>(own)), leaking(columns + size_t(links.fours) * four) {}
  template <class T>
  static size_t own_size(const Links<T>& links) { return (size_t(links.fours) * four + links.count) * sizeof(S); }
  template <class T>
  static size_t size(const Links<T>& links) { return own_size(links) + ForwardWork<S>::size(links); }
  template <class T>
  static FactoredWork in(const Links<T>& links, T* work) {
    return {links, {links, work}, work + ForwardWork<S>::size(links) / sizeof(T)};
  }
};

// Of one coordinate: D⁻¹, P_h, ε + a W ρ*, and y⁺.
template <class Kind, bool kept, int n, class S, class T>
[[gnu::always_inline]] inline void innovate_factored(const Link<T>& link, const Triangle<n, S>& L, const S& tau, ForwardLink<S>& __restrict w, Inertia<S>& __restrict P) {
  constexpr int K = Kind::row;
  constexpr Left of = rows_left<Kind, kept>();
  w.inverse = L.inverse[0];
  if constexpr (Kind::pin && !kept) w.angular[K] = L.products[0];
  if constexpr (!Kind::pin && !kept) w.linear[K] = L.products[0];
  each_of<of.turns>([&](int p) { w.angular[of.turn[p]] = L.products[of.turned() + p]; });
  each_of<of.slides>([&](int p) { w.linear[of.slide[p]] = L.products[of.moved() + p]; });
  const S along = Kind::pin ? P.n[K] : S(S(link.turn) * P.n[K] + S(link.travel) * P.f[K]);
  const S innovation = tau - along, rate = innovation * w.inverse;
  w.innovation = innovation + L.products[n];
  each_of<of.turns>([&](int p) { P.n[of.turn[p]] += w.angular[of.turn[p]] * rate; });
  each_of<of.slides>([&](int p) { P.f[of.slide[p]] += w.linear[of.slide[p]] * rate; });
  if constexpr (Kind::pin) P.n[K] = kept ? S(tau - S(link.J) * rate) : tau;
  if constexpr (!Kind::pin && !kept) P.f[K] = tau;
}

// D⁻¹x of a hinge's m coordinates by the factors of D, with x(i) = force - y and what a W ρ* gives them.
template <int m, int n, class S, class Force>
[[gnu::always_inline]] inline void rates_of(const Triangle<n, S>& L, const Factors<m, S>& factors, Force innovation, S* rate) {
  for (int i = 0; i < m; ++i) rate[i] = innovation(i);
  factors.solve(rate);
  S taken[m];
  for (int i = m - 1; i >= 0; --i) {
    taken[i] = L.lower[i][n];
    for (int a = i + 1; a < m; ++a) taken[i] -= L.lower[i][a] * taken[a];
    rate[i] += taken[i];
  }
}
template <int m, int n, class S>
[[gnu::always_inline]] inline void keep_factors(const Triangle<n, S>& L, Factors<m, S>& factors) {
  for (int r = 0; r < m; ++r) {
    factors.inverse[r] = L.inverse[r];
    for (int s = r + 1; s < m; ++s) factors.lower[s][r] = L.lower[r][s];
  }
}
template <int n, class S, class Force>
[[gnu::always_inline]] inline void innovate_ball(const Triangle<n, S>& L, Force force, ForwardMultiple<S>& w, Inertia<S>& P) {
  keep_factors(L, w.ball);
  for (int i = 2; i >= 0; --i)  // G = L₂ L₁⁻¹
    for (int r = 0; r < 3; ++r) {
      w.gain(i, r) = L.lower[i][3 + r];
      for (int a = i + 1; a < 3; ++a) w.gain(i, r) -= L.lower[i][a] * w.gain(a, r);
    }
  const Vector3<S> innovation{force(0) - P.n[0], force(1) - P.n[1], force(2) - P.n[2]};
  rates_of(L, w.ball, [&](int i) { return innovation[i]; }, w.rate);
  P.f = P.f + transpose_times(w.gain, innovation);
  P.n = {force(0), force(1), force(2)};
}
template <int n, class S, class Force>
[[gnu::always_inline]] inline void innovate_free(const Triangle<n, S>& L, Force force, ForwardMultiple<S>& w, Inertia<S>& P) {
  keep_factors(L, w.free);
  rates_of(L, w.free, [&](int i) { return S(force(i) - (i < 3 ? P.n[i] : P.f[i - 3])); }, w.rate);
  P.n = {force(0), force(1), force(2)}, P.f = {force(3), force(4), force(5)};
}

// The hinge's row, where it is one more than the body's: H C.
template <class Kind, class S, class T>
[[gnu::always_inline]] inline void put_hinge_row(const Link<T>& link, const LinkFactors<T>& own, const LinkColumns<S>& C) {
  using V = Block<S>;
  for (int k = 0; k < 4 * C.fours; k += BlockOf<S>::columns) {
    S* const x = C.at + k / 4 * four + k % 4;
    const V turned = loaded<V>(x + 4 * own.row[Kind::row]);
    if constexpr (Kind::pin)
      stored(turned, x);
    else
      stored(V(V(link.turn) * turned + V(link.travel) * loaded<V>(x + 4 * own.row[3 + Kind::row])), x);
  }
}

// The hinge of link k eliminated from its columns; P: y and how sure pivots are. to: where P⁺ goes, among the columns of its parent. leaking: of
// every link.
template <bool roots, class Kind, bool kept, class S, class T>
[[gnu::flatten]] void eliminate_factored(const Link<T>& link, const LinkFactors<T>* factors, int k, const Links<T>& links, const States<T>& at, const S& gone, const LinkColumns<S>& C, S* to, ForwardLink<S>& __restrict w,
                                         ForwardMultiple<S>* __restrict multiple, S* leaking, Inertia<S>& __restrict P, typename S::Bits& sound) {
  const LinkFactors<T>& own = factors[k];
  const auto force = [&](int i) { return at.u ? gathered<S>(at.u + link.v + i, at.u_stride, at.states) : S(0); };
  Triangle<rows_left<Kind, kept>().n, S> L;
  if constexpr (kept) {
    put_hinge_row<Kind>(link, own, C);
    if (link.rotor) put_rotor<roots>(C.base, own.rotor, S(link.J));
  }
  if constexpr (roots)
    reflect(C.at, C.fours, L);
  else if constexpr (kept && Kind::pin)
    orthogonalise_with_rotor<7, row_of_pin<Kind>()>(C.at, C.fours, C.base + own.rotor / 4 * four + own.rotor % 4, S(link.J), L);
  else
    orthogonalise(C.at, C.fours, L);
  if constexpr (Kind::nv == 1) {
    sound = sound & judge_one<Kind, kept>(link, own, links, gone, L, leaking[k], P);
    if constexpr (is_level<Kind> && !(kept && roots)) pass_leak(link, own, links, L, leaking[k], leaking);
    innovate_factored<Kind, kept>(link, L, S(S(link.sign) * force(0)), w, P);
  } else if constexpr (Kind::nv == 3) {
    innovate_ball(L, force, *multiple, P);
    sound = sound & judge_several(link, own, links, gone, L, multiple->ball, P);
  } else {
    innovate_free(L, force, *multiple, P);
    sound = sound & judge_several(link, own, links, gone, L, multiple->free, P);
  }
  if (link.parent < 0) return;
  const auto rotation = Kind::rotation(w.motion.place);
  const Vector3<S> arm = Kind::arm(link, w.motion.place);
  P.f = rotation.to_parent(P.f);
  P.n = rotation.to_parent(P.n) + cross(arm, P.f);
  put_left<Kind, kept, roots>(L, rotation, arm, w.motion, factors[link.parent], to);
}

template <bool roots, class S, class T>
[[gnu::noinline]] typename S::Bits factored_tip_to_base(const Links<T>& links, const States<T>& at, const FactoredWork<S>& w) {
  const LinkFactors<T>* const factors = links.factors[roots];
  const S gone = travel<S>(links, at);
  typename S::Bits sound = S::all();
  alignas(64) S hand[2][4 * four];  // columns of links that do not branch, in turn
  const auto columns_of = [&](int k) { return links.link[k].branches ? w.columns + factors[k].room * four : hand[k % 2]; };
  // Reflections round the share of a row that a rotor keeps, and so do sliders and screws with a rotor.
  bool rotors_leak = roots;
  for (int k = 0; k < links.count; ++k) rotors_leak |= links.link[k].step == Step::helix;
  for (int k = 0; k < links.count; ++k) {
    start_leaks(links, k, rotors_leak, w.leaking);
    if (links.link[k].branches) carry_nothing(w.forward.branch[k]);
  }
  Inertia<S> P;
  carry_nothing(P);
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    const LinkFactors<T>& own = factors[k];
    ForwardLink<S>& of = w.forward.link[k];
    S* const base = columns_of(k);
    LinkColumns<S> C{base, base, own.fours};
    if (k + 1 == links.count || links.link[k + 1].parent != k) {
      put_own(own, base);
      C.at += four;
      carry_nothing(P);
    }
    if (link.branches) add_carried(P, w.forward.branch[k]);
    P.n = P.n + put_own_accelerations(own, of.motion.omega, base);
    if (at.wrenches) P.n = P.n - spread<S>(at.wrenches + 6 * k), P.f = P.f - spread<S>(at.wrenches + 6 * k + 3);
    S* to = nullptr;
    if (link.parent >= 0) {
      to = columns_of(link.parent);
      if (link.parent == k - 1)
        put_own(factors[k - 1], to);
      else
        to = w.columns + own.to * four, clear_four(to + four);
    }
    const auto eliminate = [&](auto kind, auto kept) { eliminate_factored<roots, decltype(kind), decltype(kept)::value>(link, factors, k, links, at, gone, C, to, of, w.forward.of(link), w.leaking, P, sound); };
    with_step(link.step, [&](auto kind) {
      if constexpr (decltype(kind)::nv == 1) {
        if (own.kept) return eliminate(kind, std::true_type{});
      }
      eliminate(kind, std::false_type{});
    });
    if (link.parent < 0)
      sound = sound & sure(P.error, P.growth, links.factored.growth);
    else if (link.parent != k - 1)
      add_carried(w.forward.branch[link.parent], P);
  }
  return sound;
}

template <bool roots, class S, class T>
[[gnu::always_inline]] inline typename S::Bits move_and_eliminate(const Links<T>& links, const States<T>& at, const FactoredWork<S>& w) {
  move_links(links, at, w.forward, 0, links.count);
  return factored_tip_to_base<roots>(links, at, w);
}

template <class S, bool roots>
unsigned forward_dynamics_by_factors(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar* work) {
  const auto w = FactoredWork<S>::in(links, work);
  const typename S::Bits sound = move_and_eliminate<roots>(links, at, w);
  accelerate_links(links, at, w.forward, 0, links.count, out, stride);
  return S::mask(sound);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
