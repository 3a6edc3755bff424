// ℳ⁻¹ on columns over links that are eliminated once for a state, as forward_dynamics.h does it, D⁻¹ and P_h kept of each:
//
//   tip to base:  ε = x - z_h,   z⁺ = z + G ε,   G = P_h/D
//   base to tip:  α⁺ = E* α(p),   y = D⁻¹(ε - P_h* α⁺),   α = α⁺ + H* y
//
// Columns stand side by side, an instruction for several; a column has the same bits among any number of others. A pin without a rotor feels
// what is put on it and no more: z_h⁺ = x, and α_h = y + α⁺_h is D⁻¹ of all that is left.
#pragma once

#include "kernels/body_columns.h"
#include "kernels/forward_dynamics.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class V, class S>
[[gnu::always_inline]] inline Place<V> wide(const Place<S>& at) {
  return {wide<V>(at.c), wide<V>(at.s), wide<V>(at.R), wide<V>(at.p)};
}

// Rows of the coordinates of a link, m numbers apart.
template <class V, int n, class T>
[[gnu::always_inline]] inline void load_rows(const T* x, size_t m, V (&rows)[n]) {
  each_of<n>([&](int i) { rows[i] = from_memory<V>(x + i * m); });
}
template <class V, int n, class T>
[[gnu::always_inline]] inline void store_rows(const V (&rows)[n], T* y, size_t m) {
  each_of<n>([&](int i) { to_memory(rows[i], y + i * m); });
}

// ε to y, D⁻¹ε of several coordinates, and unless the link is a root z⁺ about the parent's origin, in its axes.
template <class Kind, class V, class S, class T>
[[gnu::always_inline]] inline void innovate(const Link<T>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Rows<V>& z, const T* x, T* y, size_t m) {
  const bool root = link.parent < 0;
  const Place<V> place = wide<V>(w.motion.place);
  const auto rotation = Kind::rotation(place);
  const Vector3<V> arm = Kind::arm(link, place);
  const auto pass = [&](int c, const Vector3<V>& n, const Vector3<V>& f) __attribute__((always_inline)) {
    const Vector3<V> moved = rotation.to_parent(f);
    z.set(c, {plus_cross(rotation.to_parent(n), arm, moved), moved});
  };
  x += link.v * m, y += link.v * m;
  if constexpr (Kind::nv == 1) {
    constexpr int K = Kind::row, i = (K + 1) % 3, j = (K + 2) % 3;
    const V sign(link.sign), turn(link.turn), travel(link.travel), inverse = wide<V>(w.inverse), left = V(link.J) * inverse;
    const Vector3<V> angular = inverse * wide<V>(w.angular), linear = inverse * wide<V>(w.linear);  // G
    z.each([&](int c) __attribute__((always_inline)) {
      Six<V> at = z[c];
      const V given = sign * from_memory<V>(x + c);
      const V e = Kind::pin ? V(given - at.angular[K]) : V(given - (turn * at.angular[K] + travel * at.linear[K]));
      to_memory(e, y + c);
      if (root) return;
      if constexpr (Kind::pin) {
        at.angular[i] += e * angular[i], at.angular[j] += e * angular[j];
        at.angular[K] = given - left * e;
      } else {
        at.angular = plus(at.angular, e, angular);
      }
      pass(c, at.angular, plus(at.linear, e, linear));
    });
  } else {
    const Matrix3<V> gain = Kind::nv == 3 ? wide<V>(multiple.gain) : Matrix3<V>{};
    z.each([&](int c) __attribute__((always_inline)) {
      const Six<V> at = z[c];
      V given[Kind::nv], e[Kind::nv];
      load_rows(x + c, m, given);
      each_of<3>([&](int r) { e[r] = given[r] - at.angular[r]; });
      Vector3<V> f = at.linear;
      if constexpr (Kind::nv == 3) {
        f = f + transpose_times(gain, Vector3<V>{e[0], e[1], e[2]});
        multiple.ball.solve(e);
      } else {
        each_of<3>([&](int r) { e[3 + r] = given[3 + r] - f[r], f[r] = given[3 + r]; });
        multiple.free.solve(e);
      }
      store_rows(e, y + c, m);
      if (!root) pass(c, {given[0], given[1], given[2]}, f);
    });
  }
}

// y and α of a link from α of its parent.
template <class Kind, class V, class S, class T>
[[gnu::always_inline]] inline void follow(const Link<T>& link, const ForwardLink<S>& w, const ForwardMultiple<S>& multiple, const Rows<V>& alpha, T* y, size_t m) {
  const bool root = link.parent < 0;
  const Place<V> place = wide<V>(w.motion.place);
  const auto rotation = Kind::rotation(place);
  const Vector3<V> arm = Kind::arm(link, place);
  const auto carried = [&](int c) __attribute__((always_inline)) {
    if (root) return Six<V>::zero();
    const Six<V> above = alpha[c];
    return Six<V>{rotation.to_child(above.angular), rotation.to_child(plus_cross(above.linear, above.angular, arm))};
  };
  y += link.v * m;
  if constexpr (Kind::nv == 1) {
    constexpr int K = Kind::row, i = (K + 1) % 3, j = (K + 2) % 3;
    const V sign(link.sign), turn(link.turn), travel(link.travel), inverse = wide<V>(w.inverse);
    const Vector3<V> angular = wide<V>(w.angular), linear = wide<V>(w.linear);
    alpha.each([&](int c) __attribute__((always_inline)) {
      Six<V> at = carried(c);
      const V beside = from_memory<V>(y + c) - angular[i] * at.angular[i] - angular[j] * at.angular[j] - dot(linear, at.linear);
      if (Kind::pin && !link.rotor) {
        const V whole = beside * inverse;
        to_memory(V(sign * (whole - at.angular[K])), y + c);
        at.angular[K] = whole;
      } else {
        const V rate = (beside - angular[K] * at.angular[K]) * inverse;
        to_memory(V(sign * rate), y + c);
        if constexpr (Kind::pin)
          at.angular[K] += rate;
        else
          at.angular[K] += turn * rate, at.linear[K] += travel * rate;
      }
      alpha.set(c, at);
    });
  } else {
    const Matrix3<V> gain = Kind::nv == 3 ? wide<V>(multiple.gain) : Matrix3<V>{};
    alpha.each([&](int c) __attribute__((always_inline)) {
      const Six<V> at = carried(c);
      V rate[Kind::nv];
      load_rows(y + c, m, rate);
      Six<V> whole = {{rate[0], rate[1], rate[2]}, at.linear};
      if constexpr (Kind::nv == 3) whole.angular = whole.angular - gain * at.linear;
      if constexpr (Kind::nv == 6) whole.linear = {rate[3], rate[4], rate[5]};
      each_of<3>([&](int r) { rate[r] = whole.angular[r] - at.angular[r]; });
      if constexpr (Kind::nv == 6) each_of<3>([&](int r) { rate[3 + r] = whole.linear[r] - at.linear[r]; });
      store_rows(rate, y + c, m);
      alpha.set(c, whole);
    });
  }
}

// y = ℳ⁻¹x, of columns as body_columns.h takes them.
struct InverseOfLinks {
  template <class V, int most, class T>
  static void run(const EliminatedLinks<T>& b, const T* x, T* y, int count, size_t m, T* scratch) {
    const Links<T>& links = *b.links;
    const ForwardWork<Lanes<T, 1>> w(links, const_cast<T*>(b.kept) + turns_size(links));
    alignas(64) T own[6 * most];
    const int columns = most == 1 ? 1 : count;
    const Rows<V> at_hand{own, columns, size_t(columns)};
    const auto of = [&](int k) { return rows_of<V>(b.room[k], scratch, columns, columns); };
    for (int k = 0; k < links.count; ++k)
      if (links.link[k].branches) clear(of(k));
    for (int k = links.count - 1; k >= 0; --k) {
      if ((k & 255) == 255) b.interrupt();
      const Link<T>& link = links.link[k];
      if (k + 1 == links.count || links.link[k + 1].parent != k) clear(at_hand);
      if (link.branches) add(at_hand, of(k));
      with_step(link.step, [&](auto kind) __attribute__((always_inline)) { innovate<decltype(kind)>(link, w.link[k], *w.of(link), at_hand, x, y, m); });
      if (link.parent >= 0 && link.parent != k - 1) add(of(link.parent), at_hand);
    }
    for (int k = 0; k < links.count; ++k) {
      if ((k & 255) == 255) b.interrupt();
      const Link<T>& link = links.link[k];
      if (link.parent >= 0 && link.parent != k - 1) copy(at_hand, of(link.parent));
      with_step(link.step, [&](auto kind) __attribute__((always_inline)) { follow<decltype(kind)>(link, w.link[k], *w.of(link), at_hand, y, m); });
      if (link.branches) copy(of(k), at_hand);
    }
  }
};

// Numbers that are kept of a state.
template <class T>
size_t kept_of_links(const Links<T>& links) {
  return turns_size(links) + (ForwardWork<Lanes<T, 1>>::size(links) + sizeof(T) - 1) / sizeof(T);
}

// Whether links eliminated at a state leave no doubt: else the general recursions decide.
template <class T>
bool eliminate_at(const Links<T>& links, const States<T>& at, T* kept) {
  using S = Lanes<T, 1>;
  const States<T> turned = with_turns(links, at, kept);
  const ForwardWork<S> w(links, kept + turns_size(links));
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) { place_link<decltype(kind)>(link, turned, w.link[k].motion.place); });
  }
  return S::everywhere(articulated_tip_to_base<false>(links, turned, w));
}
template <class T>
bool eliminate_at_q(const Links<T>& links, const T* q, void (*interrupt)(), T* kept) {
  return eliminate_at(links, States<T>{q, nullptr, nullptr, 0, 0, 0, 1, nullptr, nullptr, interrupt}, kept);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
