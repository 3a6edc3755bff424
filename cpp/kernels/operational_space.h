// Operational-space compliance of nodes on links, B*ΩB by Ω = ψ*H*D⁻¹Hψ, and its inverse Λ. Unit forces at the nodes are taken to the base, through
// hinges as forces pass them that are left to themselves, with D and G of the articulated sweep (kernels/forward_dynamics.h):
//
//   tip to base:  w = H z,   B*ΩB <- B*ΩB + w* D⁻¹ w,   z <- z - G w,   z_n <- z_n + l × z_f
//
// z in the axes of one link after another, six columns a node. Cost O(N) for the sweep, and for m nodes m² of the links between them and the base.
//
// Λ by L d L*. Where a pivot is less than `shared` of what stands on the diagonal, what the nodes' motions have in common takes too many digits: such
// states are left to the general way, which has factors of Hψ to take.
#pragma once

#include "kernels/columns.h"
#include "kernels/forward_dynamics.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

inline constexpr int node_columns = 8;  // of memory, so that registers' grid is that of the nodes
template <class T>
inline constexpr T shared = T(1) / (1 << 14);

template <class S>
struct NodeWork {
  S *z, *w, *solved;     // six rows of columns each
  S *compliance;         // (6 m, columns); of nodes in the order of their links, from their own columns on
  S *inverse, *pivots;   // (6 m, 6 m), 6 m
  int columns;
  template <class T>
  static size_t size(const Links<T>&, int nodes) {
    const size_t n = size_t(6) * nodes, columns = size_t(node_columns) * nodes;
    return ((18 + n) * columns + n * n + n) * sizeof(S);
  }
  template <class T>
  NodeWork(int nodes, T* work) : z(reinterpret_cast<S*>(work)), columns(node_columns * nodes) {
    const size_t n = size_t(6) * nodes;
    w = z + size_t(6) * columns, solved = w + size_t(6) * columns, compliance = solved + size_t(6) * columns;
    inverse = compliance + n * columns, pivots = inverse + n * n;
  }
  // f(c) of the nodes from `first` to `last`: six columns each, as many at a time as fit.
  template <class F>
  [[gnu::always_inline]] static void each(int first, int last, F f) {
    for (int p = first; p < last; ++p)
      for (int c = 0; c < 6; c += BlockOf<S>::columns) f(node_columns * p + c);
  }
};

template <class V, int K, class S>
[[gnu::always_inline]] inline Vector3<V> wide_to_parent(const Planar<K, S>& R, const Vector3<V>& x) {
  return Planar<K, V>{wide<V>(R.c), wide<V>(R.s)}.to_parent(x);
}
template <class V, class S>
[[gnu::always_inline]] inline Vector3<V> wide_to_parent(const Full<S>& R, const Vector3<V>& x) {
  return wide<V>(R.R) * x;
}

// Of w = H z: what D⁻¹ makes of it, and z - G w.
template <class Kind, class S, class V>
[[gnu::always_inline]] inline void pass_hinge(const LinkOf<S>& link, const ForwardLink<S>& own, const ForwardMultiple<S>& multiple, V (&w)[6], V (&solved)[6], Vector3<V>& n, Vector3<V>& f) {
  if constexpr (Kind::nv == 1) {
    constexpr int K = Kind::row;
    w[0] = n[K];
    if constexpr (!Kind::pin) w[0] = wide<V>(S(link.turn)) * n[K] + wide<V>(S(link.travel)) * f[K];
    solved[0] = wide<V>(own.inverse) * w[0];
    const V gone = -solved[0];
    n = n + gone * wide<V>(own.angular), f = f + gone * wide<V>(own.linear);
    if (Kind::pin && !link.rotor) n[K] = V(typename V::Scalar(0));
  } else {
    each_of<3>([&](int i) {
      w[i] = n[i];
      if constexpr (Kind::nv == 6) w[3 + i] = f[i];
    });
    each_of<Kind::nv>([&](int i) { solved[i] = w[i]; });
    n = Vector3<V>::zero();
    if constexpr (Kind::nv == 3) {
      f = f - transpose_times(wide<V>(multiple.gain), Vector3<V>{w[0], w[1], w[2]});
      multiple.ball.solve(solved);
    } else {
      f = Vector3<V>::zero();
      multiple.free.solve(solved);
    }
  }
}

// Unit forces at a node, at the origin of its link.
template <class S, class T>
inline void begin_node(const OnLink<T>& node, int first, const NodeWork<S>& to) {
  for (int c = 0; c < node_columns; ++c) {
    Vector3<S> n = Vector3<S>::zero(), f = Vector3<S>::zero();
    if (c < 6) (c < 3 ? n : f) = Vector3<S>{S(node.R[c % 3]), S(node.R[3 + c % 3]), S(node.R[6 + c % 3])};
    n = n + cross(spread<S>(node.p), f);
    for (int r = 0; r < 3; ++r) to.z[size_t(r) * to.columns + first + c] = n[r], to.z[size_t(3 + r) * to.columns + first + c] = f[r];
  }
}

// The columns of the nodes from `first` to `last`, past a link's hinge, and what it adds to their compliance.
template <class Kind, class S>
[[gnu::always_inline]] inline void pass_link(const LinkOf<S>& link, const ForwardLink<S>& own, const ForwardMultiple<S>& multiple, int first, int last, const NodeWork<S>& to) {
  using V = Block<S>;
  const auto rotation = Kind::rotation(own.motion.place);
  const Vector3<S> arm = Kind::arm(link, own.motion.place);
  const size_t row = to.columns;
  to.each(first, last, [&](int c) __attribute__((always_inline)) {
    S* const z = to.z + c;
    Vector3<V> n{loaded<V>(z), loaded<V>(z + row), loaded<V>(z + 2 * row)}, f{loaded<V>(z + 3 * row), loaded<V>(z + 4 * row), loaded<V>(z + 5 * row)};
    V w[6], solved[6];
    pass_hinge<Kind>(link, own, multiple, w, solved, n, f);
    each_of<Kind::nv>([&](int i) { stored(w[i], to.w + i * row + c), stored(solved[i], to.solved + i * row + c); });
    if (link.parent < 0) return;
    f = wide_to_parent(rotation, f), n = wide_to_parent(rotation, n) + cross(wide<V>(arm), f);
    each_of<3>([&](int r) { stored(n[r], z + r * row), stored(f[r], z + (3 + r) * row); });
  });
  for (int p = first; p < last; ++p)
    for (int a = 0; a < 6; ++a) {
      S* const sum = to.compliance + (size_t(6) * p + a) * row;
      V by[Kind::nv];
      each_of<Kind::nv>([&](int i) { by[i] = wide<V>(to.solved[i * row + node_columns * p + a]); });
      to.each(p, last, [&](int c) __attribute__((always_inline)) {
        V x = loaded<V>(sum + c);
        each_of<Kind::nv>([&](int i) { x += by[i] * loaded<V>(to.w + i * row + c); });
        stored(x, sum + c);
      });
    }
}

// Along the links that carry nodes: which stand in the order of their links, so that those that a link carries follow each other.
template <class S, class T>
inline void nodes_to_base(const Links<T>& links, const States<T>& at, const ForwardWork<S>& forward, const NodeWork<S>& to) {
  for (size_t i = 0; i < size_t(6) * at.nodes * to.columns; ++i) to.compliance[i] = S(0);
  int first = at.nodes, last = at.nodes;
  for (int k = at.nodes ? at.node[at.nodes - 1].link : -1; k >= 0; --k) {
    stay_open(at, k);
    const Link<T>& link = links.link[k];
    for (; first > 0 && at.node[first - 1].link == k; --first) begin_node(at.node[first - 1], node_columns * (first - 1), to);
    const auto carried = [&](int p) { return links.link[at.node[p].link].v < link.end; };
    for (last = first; last < at.nodes && carried(last);) ++last;
    if (first == last) continue;
    with_step(link.step, [&](auto kind) { pass_link<decltype(kind)>(link, forward.link[k], *forward.of(link), first, last, to); });
  }
}

// A <- A⁻¹ of n rows; which lanes are sound. size: n, or a constant of its kind.
template <class S, class Size>
inline typename S::Bits invert(S* A, S* pivots, Size size) {
  using T = typename S::Scalar;
  const int n = size;
  typename S::Bits sound = S::all();
  for (int j = 0; j < n; ++j) {  // L below the diagonal, d⁻¹ apart
    S pivot = A[j * n + j];
    for (int a = 0; a < j; ++a) {
      const S scaled = A[j * n + a];  // times d
      A[j * n + a] = scaled * pivots[a];
      pivot -= A[j * n + a] * scaled;
    }
    sound = sound & greater(pivot, S(shared<T>) * A[j * n + j]);
    pivots[j] = S(1) / pivot;
    for (int i = j + 1; i < n; ++i) {
      S x = A[i * n + j];
      for (int a = 0; a < j; ++a) x -= A[i * n + a] * A[j * n + a];
      A[i * n + j] = x;
    }
  }
  for (int i = 0; i < n; ++i)  // L⁻¹ in its place
    for (int j = 0; j < i; ++j) {
      S x = -A[i * n + j];
      for (int a = j + 1; a < i; ++a) x -= A[i * n + a] * A[a * n + j];
      A[i * n + j] = x;
    }
  for (int i = 0; i < n; ++i)
    for (int j = i; j < n; ++j) {
      S x = j == i ? pivots[j] : S(A[j * n + i] * pivots[j]);
      for (int a = j + 1; a < n; ++a) x += S(A[a * n + i] * pivots[a]) * A[a * n + j];
      A[i * n + j] = x;
    }
  return sound;
}

// B*ΩB, or Λ.
template <class S, bool inverse>
unsigned operational_space(const Links<typename S::Scalar>& links, const States<typename S::Scalar>& at, double* out, size_t stride, typename S::Scalar* work) {
  using T = typename S::Scalar;
  const ForwardWork<S> forward(links, work);
  const NodeWork<S> to(at.nodes, work + ForwardWork<S>::size(links) / sizeof(T));
  for (int k = 0; k < links.count; ++k) {
    const Link<T>& link = links.link[k];
    with_step(link.step, [&](auto kind) { place_link<decltype(kind)>(link, at, forward.link[k].motion.place); });
  }
  typename S::Bits sound = articulated_tip_to_base<false>(links, at, forward);
  nodes_to_base(links, at, forward, to);
  const int n = 6 * at.nodes;
  const auto found = [&](int i, int j) -> const S& { return to.compliance[size_t(i) * to.columns + node_columns * (j / 6) + j % 6]; };
  if constexpr (inverse) {
    for (int i = 0; i < n; ++i)
      for (int j = i; j < n; ++j) to.inverse[size_t(j) * n + i] = found(i, j);
    if (n == 6)
      sound = sound & invert(to.inverse, to.pivots, std::integral_constant<int, 6>());
    else
      sound = sound & invert(to.inverse, to.pivots, n);
  }
  const auto place = [&](int i) { return 6 * at.node[i / 6].place + i % 6; };
  for (int i = 0; i < n; ++i)
    for (int j = i; j < n; ++j) {
      const S& x = inverse ? to.inverse[size_t(i) * n + j] : found(i, j);
      scattered(x, out + size_t(place(i)) * n + place(j), stride, at.states);
      if (j > i) scattered(x, out + size_t(place(j)) * n + place(i), stride, at.states);
    }
  return S::mask(sound);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
