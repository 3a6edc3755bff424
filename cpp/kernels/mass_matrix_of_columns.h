// ℳX = HφMφ*H*X, or with J, many columns side by side (body_columns.h):
//
//   base to tip:  α(k) = E(p,k)* α(p) + H(k)* x(k)
//   tip to base:  f(k) = M(k) α(k) + Σ E(k,c) f(c),   y(k) = H(k) f(k) (+ J(k) x(k))
//
// α of every body is kept; of one that branches it becomes M α before forces of other branches are added to it.
#pragma once

#include "kernels/body_columns.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// M of a body by its ten numbers: mass m, first moment h, rotational inertia I about the frame's origin.
template <class S>
struct InertiaOf {
  S mass;
  Vector3<S> h;
  S I[6];
  template <class T>
  [[gnu::always_inline]] explicit InertiaOf(const T* ten) : mass(ten[0]), h(spread<S>(ten + 1)) {
    for (int i = 0; i < 6; ++i) I[i] = S(ten[4 + i]);
  }
  // (Iα + h × a; m a - h × α)
  [[gnu::always_inline]] Six<S> operator*(const Six<S>& x) const {
    const Vector3<S>&w = x.angular, &a = x.linear;
    const Vector3<S> n{I[0] * w[0] + I[1] * w[1] + I[2] * w[2], I[1] * w[0] + I[3] * w[1] + I[4] * w[2], I[2] * w[0] + I[4] * w[1] + I[5] * w[2]};
    return {plus_cross(n, h, a), plus_cross(Vector3<S>{mass * a[0], mass * a[1], mass * a[2]}, w, h)};
  }
};

// α <- φ* α + H* x
template <int pin, int level, class S, class T>
[[gnu::always_inline]] inline void motions(const Bodies<T>& b, int k, const Rows<S>& alpha, const T* x, const Rows<S>& kept, size_t m) {
  const int f = b.first[k], n = b.first[k + 1] - f;
  const bool root = b.parent[k] < 0;
  const Edge<level, S> edge(b.pose + size_t(12) * k);
  const S h(pin < 0 ? T(0) : b.H[6 * f + (pin < 0 ? 0 : pin)]);
  x += f * m;
  alpha.each([&](int c) __attribute__((always_inline)) {
    Six<S> a = root ? Six<S>::zero() : edge.to_child(alpha[c]);
    if constexpr (pin >= 0)
      a.angular[pin] += from_memory<S>(x + c) * h;
    else
      for (int i = 0; i < n; ++i) a = plus(a, from_memory<S>(x + i * m + c), Six<S>::spread(b.H + size_t(6) * (f + i)));
    alpha.set(c, a);
    kept.set(c, a);
  });
}

// f <- f + M α, y = H f (+ J x), and unless the body is a root f <- φ f
template <int pin, int level, class S, class T>
[[gnu::always_inline]] inline void forces(const Bodies<T>& b, int k, const Rows<S>& force, const Rows<S>& alpha, bool with_J, const T* x, T* y, size_t m) {
  const int f = b.first[k], n = b.first[k + 1] - f;
  const bool root = b.parent[k] < 0, added = b.branches[k];
  const Edge<level, S> edge(b.pose + size_t(12) * k);
  const InertiaOf<S> M(b.inertia + size_t(10) * k);
  x += f * m, y += f * m;
  force.each([&](int c) __attribute__((always_inline)) {
    Six<S> at = force[c];
    if (!added) at = at + M * alpha[c];
    for (int i = 0; i < n; ++i) {
      S yc = pin >= 0 ? S(S(b.H[6 * f + (pin < 0 ? 0 : pin)]) * at.angular[pin < 0 ? 0 : pin]) : dot(Six<S>::spread(b.H + size_t(6) * (f + i)), at);
      if (with_J) yc += S(b.J[f + i]) * from_memory<S>(x + i * m + c);
      to_memory(yc, y + i * m + c);
    }
    if (!root) force.set(c, edge.to_parent(at));
  });
}

template <bool with_J>
struct MassMatrix {
  template <class S, int most, class T>
  static void run(const Bodies<T>& b, const T* x, T* y, int count, size_t m, T* kept) {
    alignas(64) T own[6 * most];
    const int columns = most == 1 ? 1 : count;
    const Rows<S> at_hand{own, columns, size_t(columns)};
    const auto of = [&](int k) { return rows_of<S>(k, kept, columns, columns); };
    clear(at_hand);
    for (int k = 0; k < b.count; ++k) {
      if ((k & 255) == 255) b.interrupt();
      const int p = b.parent[k];
      if (p >= 0 && p != k - 1) copy(at_hand, of(p));
      with_way(b.way[k], [&]<int pin, int level>() __attribute__((always_inline)) { motions<pin, level>(b, k, at_hand, x, of(k), m); });
    }
    for (int k = 0; k < b.count; ++k)
      if (b.branches[k]) {
        const InertiaOf<S> M(b.inertia + size_t(10) * k);
        of(k).each([&](int c) __attribute__((always_inline)) { of(k).set(c, M * of(k)[c]); });
      }
    for (int k = b.count - 1; k >= 0; --k) {
      if ((k & 255) == 255) b.interrupt();
      const int p = b.parent[k];
      if (k + 1 == b.count || b.parent[k + 1] != k) clear(at_hand);
      if (b.branches[k]) add(at_hand, of(k));
      with_way(b.way[k], [&]<int pin, int level>() __attribute__((always_inline)) { forces<pin, level>(b, k, at_hand, of(k), with_J, x, y, m); });
      if (p >= 0 && p != k - 1) add(of(p), at_hand);
    }
  }
};

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
