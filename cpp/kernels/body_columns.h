// What sweeps over the bodies of a tree with several columns side by side, an instruction for all, are made of, and ℳ⁻¹X by them:
// algebra/trees/sweeps/mass_matrix.h, with products fused as lanes.h says. A column has the same bits among any number of others. What a body's
// numbers make exactly zero is left out.
#pragma once

#include "kernels/bodies.h"
#include "kernels/rotations.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct Six {  // (n; f) or (α; a)
  Vector3<S> angular, linear;
  [[gnu::always_inline]] static Six zero() { return {Vector3<S>::zero(), Vector3<S>::zero()}; }
  template <class T>
  [[gnu::always_inline]] static Six spread(const T* x) { return {kernels::PYCRAFT_INSTRUCTION_SET::spread<S>(x), kernels::PYCRAFT_INSTRUCTION_SET::spread<S>(x + 3)}; }
};
template <class S>
[[gnu::always_inline]] inline Six<S> operator+(const Six<S>& a, const Six<S>& b) {
  return {a.angular + b.angular, a.linear + b.linear};
}
// a + c b, products fused.
template <class S>
[[gnu::always_inline]] inline Vector3<S> plus(const Vector3<S>& a, const S& c, const Vector3<S>& b) {
  return {a[0] + c * b[0], a[1] + c * b[1], a[2] + c * b[2]};
}
template <class S>
[[gnu::always_inline]] inline Six<S> plus(const Six<S>& a, const S& c, const Six<S>& b) {
  return {plus(a.angular, c, b.angular), plus(a.linear, c, b.linear)};
}
// a + l × f
template <class S>
[[gnu::always_inline]] inline Vector3<S> plus_cross(const Vector3<S>& a, const Vector3<S>& l, const Vector3<S>& f) {
  return {a[0] + l[1] * f[2] - l[2] * f[1], a[1] + l[2] * f[0] - l[0] * f[2], a[2] + l[0] * f[1] - l[1] * f[0]};
}
template <class S>
[[gnu::always_inline]] inline S dot(const Six<S>& a, const Six<S>& b) {
  return dot(a.angular, b.angular) + dot(a.linear, b.linear);
}

// R of a body, which is zero besides R(K, K) and between the two other axes (K = -1: any R). As rounded as it is: R(K, K) may differ from one.
template <int K, class S>
struct Turn {
  static constexpr int i = (K + 1) % 3, j = (K + 2) % 3;
  S ii, ij, ji, jj, kk;
  template <class T>
  [[gnu::always_inline]] explicit Turn(const T* R) : ii(R[4 * i]), ij(R[3 * i + j]), ji(R[3 * j + i]), jj(R[4 * j]), kk(R[4 * K]) {}
  [[gnu::always_inline]] Vector3<S> to_parent(const Vector3<S>& x) const {
    Vector3<S> y;
    y[i] = ii * x[i] + ij * x[j], y[j] = ji * x[i] + jj * x[j], y[K] = kk * x[K];
    return y;
  }
  [[gnu::always_inline]] Vector3<S> to_child(const Vector3<S>& x) const {
    Vector3<S> y;
    y[i] = ii * x[i] + ji * x[j], y[j] = ij * x[i] + jj * x[j], y[K] = kk * x[K];
    return y;
  }
};
template <class S>
struct Turn<-1, S> {
  Matrix3<S> R;
  template <class T>
  [[gnu::always_inline]] explicit Turn(const T* from) {
    for (int r = 0; r < 9; ++r) R.m[r] = S(from[r]);
  }
  [[gnu::always_inline]] Vector3<S> to_parent(const Vector3<S>& x) const { return R * x; }
  [[gnu::always_inline]] Vector3<S> to_child(const Vector3<S>& x) const { return transpose_times(R, x); }
};

// The edge of a body: φ takes forces to the parent, φ* motions to the child.
template <int K, class S>
struct Edge {
  Turn<K, S> turn;
  Vector3<S> arm;
  template <class T>
  [[gnu::always_inline]] explicit Edge(const T* pose) : turn(pose), arm(spread<S>(pose + 9)) {}
  [[gnu::always_inline]] Six<S> to_parent(const Six<S>& z) const {
    const Vector3<S> f = turn.to_parent(z.linear);
    return {plus_cross(turn.to_parent(z.angular), arm, f), f};
  }
  [[gnu::always_inline]] Six<S> to_child(const Six<S>& a) const { return {turn.to_child(a.angular), turn.to_child(plus_cross(a.linear, a.angular, arm))}; }
};

// f<pin, level>: the coordinate axis of the pin and that of the turn, -1 where there is none.
template <class F>
[[gnu::always_inline]] inline void with_way(Way way, F&& f) {
  switch (way) {
    case Way::any: return f.template operator()<-1, -1>();
    case Way::pin_x: return f.template operator()<0, -1>();
    case Way::pin_y: return f.template operator()<1, -1>();
    case Way::pin_z: return f.template operator()<2, -1>();
    case Way::level_x: return f.template operator()<0, 0>();
    case Way::level_y: return f.template operator()<1, 1>();
    case Way::level_z: return f.template operator()<2, 2>();
  }
}

// x <- D(k)⁻¹ x of n rows m apart, as small_ldl.h.
template <class S, class T>
inline void solve_D(const T* L, const T* pivots, int n, T* x, size_t m) {
  const auto row = [&](int i) { return from_memory<S>(x + i * m); };
  for (int i = 1; i < n; ++i)
    for (int j = 0; j < i; ++j) to_memory(row(i) - S(L[i * n + j]) * row(j), x + i * m);
  for (int i = 0; i < n; ++i) to_memory(row(i) / S(pivots[i]), x + i * m);
  for (int i = n - 2; i >= 0; --i)
    for (int j = i + 1; j < n; ++j) to_memory(row(i) - S(L[j * n + i]) * row(j), x + i * m);
}

// Six rows of columns, `stride` apart in memory.
template <class S, class Number = typename S::Scalar>
struct Rows {
  Number* base;
  int columns;
  size_t stride;
  [[gnu::always_inline]] Six<S> operator[](int c) const {
    Six<S> a;
    for (int r = 0; r < 3; ++r) a.angular[r] = from_memory<S>(base + r * stride + c), a.linear[r] = from_memory<S>(base + (3 + r) * stride + c);
    return a;
  }
  [[gnu::always_inline]] void set(int c, const Six<S>& a) const {
    for (int r = 0; r < 3; ++r) to_memory(a.angular[r], base + r * stride + c), to_memory(a.linear[r], base + (3 + r) * stride + c);
  }
  template <class F>
  [[gnu::always_inline]] void each(F&& f) const {
    for (int c = 0; c < columns; c += S::width) f(c);
  }
};

// ν = D⁻¹(x - H z), z <- z + G ε, and unless the body is a root z <- φ z
template <int pin, int level, class S, class T>
[[gnu::always_inline]] inline void innovations(const Bodies<T>& b, int k, const Rows<S>& z, const T* x, T* nu, size_t m) {
  const int f = b.first[k], n = b.first[k + 1] - f;
  const bool root = b.parent[k] < 0;
  const Edge<level, S> edge(b.pose + size_t(12) * k);
  x += f * m, nu += f * m;
  if constexpr (pin >= 0) {
    const S h(b.H[6 * f + pin]), D(b.D[b.at[k]]);
    const Six<S> G = Six<S>::spread(b.G + size_t(6) * f);
    if (root) return z.each([&](int c) __attribute__((always_inline)) { to_memory((from_memory<S>(x + c) - h * z[c].angular[pin]) / D, nu + c); });
    z.each([&](int c) __attribute__((always_inline)) {
      const Six<S> zc = z[c];
      const S e = from_memory<S>(x + c) - h * zc.angular[pin];
      to_memory(e / D, nu + c);
      z.set(c, edge.to_parent(plus(zc, e, G)));
    });
  } else {
    z.each([&](int c) __attribute__((always_inline)) {
      const Six<S> zc = z[c];
      Six<S> moved = zc;
      for (int i = 0; i < n; ++i) {
        const S e = from_memory<S>(x + i * m + c) - dot(Six<S>::spread(b.H + size_t(6) * (f + i)), zc);
        to_memory(e, nu + i * m + c);
        moved = plus(moved, e, Six<S>::spread(b.G + size_t(6) * (f + i)));
      }
      if (!root) z.set(c, edge.to_parent(moved));
      if (n == 1)
        to_memory(from_memory<S>(nu + c) / S(b.D[b.at[k]]), nu + c);
      else
        solve_D<S>(b.L + b.at[k], b.pivots + f, n, nu + c, m);
    });
  }
}

// α⁺ = φ* α of the parent, y = ν - G* α⁺, α = α⁺ + H* y
template <int pin, int level, class S, class T>
[[gnu::always_inline]] inline void accelerations(const Bodies<T>& b, int k, const Rows<S>& alpha, T* y, size_t m) {
  const int f = b.first[k], n = b.first[k + 1] - f;
  const bool root = b.parent[k] < 0;
  const Edge<level, S> edge(b.pose + size_t(12) * k);
  y += f * m;
  if constexpr (pin >= 0) {
    const S h(b.H[6 * f + pin]);
    const Six<S> G = Six<S>::spread(b.G + size_t(6) * f);
    if (root) {
      alpha.each([&](int c) __attribute__((always_inline)) {
        Six<S> a = Six<S>::zero();
        a.angular[pin] = from_memory<S>(y + c) * h;
        alpha.set(c, a);
      });
      return;
    }
    alpha.each([&](int c) __attribute__((always_inline)) {
      Six<S> a = edge.to_child(alpha[c]);
      const S yc = from_memory<S>(y + c) - dot(G, a);
      to_memory(yc, y + c);
      a.angular[pin] += yc * h;
      alpha.set(c, a);
    });
  } else {
    alpha.each([&](int c) __attribute__((always_inline)) {
      const Six<S> carried = root ? Six<S>::zero() : edge.to_child(alpha[c]);
      Six<S> a = carried;
      for (int i = 0; i < n; ++i) {
        S yc = from_memory<S>(y + i * m + c);
        if (!root) yc -= dot(Six<S>::spread(b.G + size_t(6) * (f + i)), carried), to_memory(yc, y + i * m + c);
        a = plus(a, yc, Six<S>::spread(b.H + size_t(6) * (f + i)));
      }
      alpha.set(c, a);
    });
  }
}

// to <- to + from, or from, or zero: six rows.
template <class S>
[[gnu::always_inline]] inline void add(const Rows<S>& to, const Rows<S>& from) {
  to.each([&](int c) __attribute__((always_inline)) { to.set(c, to[c] + from[c]); });
}
template <class S>
[[gnu::always_inline]] inline void copy(const Rows<S>& to, const Rows<S>& from) {
  to.each([&](int c) __attribute__((always_inline)) { to.set(c, from[c]); });
}
template <class S>
[[gnu::always_inline]] inline void clear(const Rows<S>& to) {
  to.each([&](int c) __attribute__((always_inline)) { to.set(c, Six<S>::zero()); });
}

// Six rows a body, as many columns as are at hand and `stride` apart.
template <class S, class T>
[[gnu::always_inline]] inline Rows<S, T> rows_of(int k, T* all, int columns, size_t stride) {
  return {all + size_t(6) * k * stride, columns, stride};
}

// Sweeps over the bodies, six rows at hand from body to body: those of one that branches are kept.
template <class S, class T, class F>
[[gnu::always_inline]] inline void tip_to_base(const Bodies<T>& b, const Rows<S>& at_hand, T* kept, F&& f) {
  const auto of = [&](int k) { return rows_of<S>(k, kept, at_hand.columns, at_hand.stride); };
  for (int k = 0; k < b.count; ++k)
    if (b.branches[k]) clear(of(k));
  for (int k = b.count - 1; k >= 0; --k) {
    if ((k & 255) == 255) b.interrupt();
    const int p = b.parent[k];
    if (k + 1 == b.count || b.parent[k + 1] != k) clear(at_hand);
    if (b.branches[k]) add(at_hand, of(k));
    f(k);
    if (p >= 0 && p != k - 1) add(of(p), at_hand);
  }
}
template <class S, class T, class F>
[[gnu::always_inline]] inline void base_to_tip(const Bodies<T>& b, const Rows<S>& at_hand, T* kept, F&& f) {
  const auto of = [&](int k) { return rows_of<S>(k, kept, at_hand.columns, at_hand.stride); };
  for (int k = 0; k < b.count; ++k) {
    if ((k & 255) == 255) b.interrupt();
    const int p = b.parent[k];
    if (p >= 0 && p != k - 1) copy(at_hand, of(p));
    f(k);
    if (b.branches[k]) copy(of(k), at_hand);
  }
}

// y = [I-HψK]* D⁻¹ [I-HψK] x
struct MassMatrixInverse {
  template <class S, int most, class T>
  static void run(const Bodies<T>& b, const T* x, T* y, int count, size_t m, T* kept) {
    alignas(64) T own[6 * most];
    const int columns = most == 1 ? 1 : count;
    const Rows<S> at_hand{own, columns, size_t(columns)};
    tip_to_base(b, at_hand, kept, [&](int k) __attribute__((always_inline)) {
      with_way(b.way[k], [&]<int pin, int level>() __attribute__((always_inline)) { innovations<pin, level>(b, k, at_hand, x, y, m); });
    });
    base_to_tip(b, at_hand, kept, [&](int k) __attribute__((always_inline)) {
      with_way(b.way[k], [&]<int pin, int level>() __attribute__((always_inline)) { accelerations<pin, level>(b, k, at_hand, y, m); });
    });
  }
};

// W columns in an instruction, a block of them at once. What is left over overlaps those before it, or goes by fewer.
template <class Sweep, class T, int W, class Of>
void of_columns(const Of& b, const T* x, T* y, int m, T* scratch) {
  constexpr int block = W == 1 ? 1 : 64;
  if constexpr (W > 1) {
    if (m < W) return of_columns<Sweep, T, W == 8 ? 4 : 1>(b, x, y, m, scratch);
  }
  for (int c = 0; c < m;) {
    if (c > 0) b.interrupt();
    const int count = m - c < W ? W : m - c < block ? (m - c) / W * W : block, at = c + count <= m ? c : m - count;
    Sweep::template run<Lanes<T, W>, block>(b, x + at, y + at, count, size_t(m), scratch);
    c = at + count;
  }
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
