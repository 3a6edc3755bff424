// What refinement of forward dynamics keeps of links, and the sweeps that a correction takes. With the factors of forward_dynamics.h kept, and
// forces f(k) = M α + b' - w at accelerations x, the residual and what is solved from it are gathered in one sweep tip to base:
//
//   y(k) = f(k) + Σ_{children c} φ y⁺(c),   ε = T - H y - J x,   y⁺ = y + G ε;    base to tip:  δ = D⁻¹ε - G* α⁺
//
// y is all that a hinge would carry after the correction. It rounds as the forces of x do, from which it differs by those of δ, and may be in
// wider numbers V than the state.
#pragma once

#include "kernels/forward_dynamics.h"
#include "kernels/inverse_dynamics.h"
#include "kernels/wide_numbers.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class V>
struct Force {
  Vector3<V> n, f;
  static Force zero() { return {{V(0), V(0), V(0)}, {V(0), V(0), V(0)}}; }
  [[gnu::always_inline]] friend Force operator+(const Force& a, const Force& b) { return {a.n + b.n, a.f + b.f}; }
};

template <class S, class V>
struct RefinedLink {
  Force<V> force;                  // f, with y⁺ of links that hang on it and do not follow it
  Vector3<S> alpha, acceleration;  // of x
  Force<S> total, carried, motion; // y; of a sweep; sizes (residual_rounding_of_links.h)
  S innovation, off;               // ε; dω
};
template <class S>
struct Response {  // of links that branch
  Vector3<S> alpha, acceleration;
};

template <class S, class V>
struct RefinedWork {
  RefinedLink<S, V>* link;
  Response<S>* response;
  S *x, *delta, *rates;  // θ̈ + what hinges absorb, and that; δ; D⁻¹ε of links with several coordinates
  S* absorbed;
  ForwardWork<S> forward;
  template <class T>
  static size_t own_size(const Links<T>& links) {
    return links.count * (sizeof(RefinedLink<S, V>) + sizeof(Response<S>)) + (size_t(3) * links.nv + size_t(6) * links.multiple) * sizeof(S);
  }
  template <class T>
  static size_t size(const Links<T>& links) { return own_size(links) + ForwardWork<S>::size(links); }
  template <class T>
  RefinedWork(const Links<T>& links, T* work) : forward(links, work + own_size(links) / sizeof(T)) {
    link = reinterpret_cast<RefinedLink<S, V>*>(work);
    response = reinterpret_cast<Response<S>*>(link + links.count);
    x = reinterpret_cast<S*>(response + links.count), delta = x + links.nv, absorbed = delta + links.nv, rates = absorbed + links.nv;
  }
  template <class T>
  S* rate(const Link<T>& link) const { return rates + 6 * (link.multi < 0 ? 0 : link.multi); }
};

template <class S>
[[gnu::always_inline]] inline S length(const Vector3<S>& x) {
  S square = dot(x, x);
  for (int b = 0; b < S::width; ++b) square.set(b, __builtin_sqrt(square.lane(b)));
  return square;
}

// Forces, tip to base, those of a chain at hand: visit(k, y) makes a link's its parent's. own(k): of the link, and what else hangs on it.
template <class V, class T, class Own, class Visit>
[[gnu::always_inline]] inline void inward(const Links<T>& links, const States<T>& at, Own own, Visit visit) {
  Force<V> at_hand;
  for (int k = links.count - 1; k >= 0; --k) {
    stay_open(at, k);
    const bool leaf = k + 1 == links.count || links.link[k + 1].parent != k;
    at_hand = leaf ? own(k) : at_hand + own(k);
    visit(k, at_hand);
    if (const int p = links.link[k].parent; p >= 0 && p != k - 1) own(p) = own(p) + at_hand;
  }
}

// In the parent's axes. Wide numbers of one state are turned side by side, n with f.
template <class V, class Rotation>
[[gnu::always_inline]] inline void turn(const Rotation& rotation, Force<V>& y) {
  y.n = rotation.to_parent(y.n), y.f = rotation.to_parent(y.f);
}
template <class V, int K, class S>
[[gnu::always_inline]] inline Vector3<Wide<V>> turned(const Planar<K, S>& rotation, const Vector3<Wide<V>>& x) {
  return Planar<K, V>{wide<V>(rotation.c), wide<V>(rotation.s)}.to_parent(x);
}
template <class V, class S>
[[gnu::always_inline]] inline Vector3<Wide<V>> turned(const Full<S>& rotation, const Vector3<Wide<V>>& x) {
  const Matrix3<V> R = wide<V>(rotation.R);
  return Full<V>{R}.to_parent(x);
}
template <class Rotation>
[[gnu::always_inline]] inline void turn(const Rotation& rotation, Force<Wide<Lanes<double, 1>>>& y) {
  using Both = Lanes<double, 2>;
  const auto both = [](const Lanes<double, 1>& n, const Lanes<double, 1>& f) {
    Both x;
    x.set(0, n.v), x.set(1, f.v);
    return x;
  };
  Vector3<Wide<Both>> x;
  each_of<3>([&](int i) { x[i] = {both(y.n[i].v, y.f[i].v), both(y.n[i].rest, y.f[i].rest)}; });
  x = turned(rotation, x);
  each_of<3>([&](int i) { y.n[i] = {x[i].v.lane(0), x[i].rest.lane(0)}, y.f[i] = {x[i].v.lane(1), x[i].rest.lane(1)}; });
}
// About the parent's origin, in its axes.
template <class Kind, class V, class S, class T>
[[gnu::always_inline]] inline void to_parent(const Link<T>& link, const Motion<S>& m, Force<V>& y) {
  turn(Kind::rotation(m.place), y);
  y.n = y.n + arm_times(Kind::arm(link, m.place), y.f);
}

// ε, and y⁺ as the parent's. force(i): T - J x along the link's own axes.
template <class Kind, class V, class W, class S, class T, class TheForce>
[[gnu::always_inline]] inline void innovate(const Link<T>& link, const RefinedWork<S, W>& work, int k, TheForce force, Force<V>& y) {
  const ForwardLink<S>& w = work.forward.link[k];
  if constexpr (Kind::nv == 1) {
    constexpr int K = Kind::row, i = (K + 1) % 3, j = (K + 2) % 3;
    const V wanted = force(0);
    const V along = Kind::pin ? y.n[K] : V(S(link.turn) * y.n[K] + S(link.travel) * y.f[K]);
    const S e = work.link[k].innovation = narrowed<S>(V(wanted - along));
    if (link.parent < 0) return;
    const S rate = e * w.inverse;
    if constexpr (Kind::pin) {
      y.n[i] += widened<V>(S(rate * w.angular[i])), y.n[j] += widened<V>(S(rate * w.angular[j]));
      y.n[K] = link.rotor ? V(wanted - widened<V>(S(S(link.J) * rate))) : wanted;
    } else {
      each_of<3>([&](int r) { y.n[r] += widened<V>(S(rate * w.angular[r])); });
    }
    each_of<3>([&](int r) { y.f[r] += widened<V>(S(rate * w.linear[r])); });
  } else {
    const ForwardMultiple<S>& multiple = *work.forward.of(link);
    S* const rate = work.rate(link);
    each_of<3>([&](int i) {
      const V wanted = force(i);
      rate[i] = narrowed<S>(V(wanted - y.n[i])), y.n[i] = wanted;
      if constexpr (Kind::nv == 6) {
        const V along = force(3 + i);
        rate[3 + i] = narrowed<S>(V(along - y.f[i])), y.f[i] = along;
      }
    });
    if constexpr (Kind::nv == 3) {
      const Vector3<S> f = transpose_times(multiple.gain, Vector3<S>{rate[0], rate[1], rate[2]});
      each_of<3>([&](int r) { y.f[r] += widened<V>(f[r]); });
      multiple.ball.solve(rate);
    } else {
      multiple.free.solve(rate);
    }
    if (link.parent < 0) return;
  }
  to_parent<Kind>(link, w.motion, y);
}

// α of x, and forces f of links.
template <class V, class S, class T>
[[gnu::always_inline]] inline void push_links(const Links<T>& links, const States<T>& at, const RefinedWork<S, V>& w) {
  outward(links, 0, links.count, Vector3<S>(-spread<S>(at.gravity)), w.link, [&](int k, Vector3<S>& alpha, Vector3<S>& acceleration) {
    const Link<T>& link = links.link[k];
    const Motion<S>& m = w.forward.link[k].motion;
    RefinedLink<S, V>& own = w.link[k];
    with_step(link.step, [&](auto kind) {
      using Kind = decltype(kind);
      carry<Kind, false>(link, m, alpha, acceleration);
      add_rates<Kind>(link, [&](int i) { return w.x[link.v + i]; }, alpha, acceleration);
    });
    own.alpha = alpha, own.acceleration = acceleration;
    const T* const wrench = at.wrenches ? at.wrenches + 6 * k : nullptr;
    if constexpr (std::is_same_v<S, V>) {
      own_force(link, m.omega, wrench, alpha, acceleration, own.force.n, own.force.f);
    } else {
      // b' of velocities that are no wider: what rounding makes of it is an acceleration of the link's masses, as of motions.
      const Vector3<S> n = gyroscopic(m.omega, rotational_of<S>(link)), f = twice_crossed(m.omega, spread<S>(link.moment));
      each_of<3>([&](int i) { own.force.n[i] = V(n[i]), own.force.f[i] = V(f[i]); });
      for (int i = 0; i < 3 && wrench; ++i) own.force.n[i] -= V(S(wrench[i])), own.force.f[i] -= V(S(wrench[3 + i]));
      add_wide_force(links.wide_masses + 20 * k, alpha, acceleration, own.force.n, own.force.f);
    }
  });
}

// δ of the residual of x.
template <class V, class S, class T>
[[gnu::always_inline]] inline void correction(const Links<T>& links, const States<T>& at, const RefinedWork<S, V>& w) {
  push_links<V>(links, at, w);
  inward<V>(links, at, [&](int k) -> Force<V>& { return w.link[k].force; }, [&](int k, Force<V>& y) {
    const Link<T>& link = links.link[k];
    each_of<3>([&](int i) { w.link[k].total.n[i] = narrowed<S>(y.n[i]), w.link[k].total.f[i] = narrowed<S>(y.f[i]); });
    with_step(link.step, [&](auto kind) {
      const auto force = [&](int i) {
        S tau = gathered<S>(at.u + link.v + i, at.u_stride, at.states);
        if constexpr (decltype(kind)::nv == 1) {
          tau = S(link.sign) * tau;
          if (link.rotor) return V(widened<V>(tau) - S(link.J) * widened<V>(S(S(link.sign) * w.x[link.v])));
        }
        return widened<V>(tau);
      };
      innovate<decltype(kind)>(link, w, k, force, y);
    });
  });
  outward(links, 0, links.count, Vector3<S>::zero(), w.response, [&](int k, Vector3<S>& alpha, Vector3<S>& acceleration) {
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) {
      accelerate_link<decltype(kind), false>(link, w.forward.link[k], w.link[k].innovation, w.rate(link), w.forward.of(link), alpha, acceleration,
                                             [&](int i, const S& y, const S*) { w.delta[link.v + i] = y; });
    });
  });
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
