// Operational-space compliance of nodes on links, B*ΩB by Ω = ψ*H*D⁻¹Hψ, and its inverse Λ. Unit forces at the nodes are taken to the base, through
// hinges as forces pass them that are left to themselves, with D and G of the articulated sweep (kernels/forward_dynamics.h):
//
//   tip to base:  w = H z,   B*ΩB <- B*ΩB + w* D⁻¹ w,   z <- z - G w,   z_n <- z_n + l × z_f
//
// z in the axes of one link after another, six columns a node. Cost O(N) for the sweep, and for m nodes m² of the links between them and the base.
//
// Λ in its place, pivot by pivot, by the symmetric sweep operator A <- [-d⁻¹, d⁻¹a*; d⁻¹a, A - a d⁻¹ a*], after all of which A is -A⁻¹: every step goes
// along rows, so that registers take several columns of one state. Source: J. H. Goodnight, A tutorial on the SWEEP operator, The American
// Statistician 33 (1979). The pivots are those of L d L*. Where one is less than `shared` of what stood on the diagonal, what the nodes' motions have in
// common takes too many digits: such states are left to the general way, which has factors of Hψ to take.
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
  S* diagonal;           // 6 m, of the compliance
  int columns;
  template <class T>
  static size_t size(const Links<T>&, int nodes) {
    const size_t n = size_t(6) * nodes, columns = size_t(node_columns) * nodes;
    return ((18 + n) * columns + n) * sizeof(S);
  }
  template <class T>
  NodeWork(int nodes, T* work) : z(reinterpret_cast<S*>(work)), columns(node_columns * nodes) {
    const size_t n = size_t(6) * nodes;
    w = z + size_t(6) * columns, solved = w + size_t(6) * columns, compliance = solved + size_t(6) * columns;
    diagonal = compliance + n * columns;
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

// The compliance of the nodes, in its place, to -Λ; which lanes are sound. Row k holds what stands right of the columns of nodes before its own.
template <class S>
inline typename S::Bits invert(int nodes, const NodeWork<S>& to) {
  using V = Block<S>;
  using T = typename S::Scalar;
  const size_t row = to.columns;
  const auto column = [](int i) { return node_columns * (i / 6) + i % 6; };
  S* const a = to.w;  // the pivot's row, whole
  typename S::Bits sound = S::all();
  for (int c = 0; c < to.columns; ++c) a[c] = S(0);
  for (int i = 0; i < 6 * nodes; ++i) to.diagonal[i] = to.compliance[i * row + column(i)];
  for (int k = 0; k < 6 * nodes; ++k) {
    const int own = k / 6, at = column(k);
    S* const pivots = to.compliance + k * row;
    for (int i = 0; i < 6 * own; ++i) a[column(i)] = to.compliance[i * row + at];
    to.each(own, nodes, [&](int c) __attribute__((always_inline)) { stored(loaded<V>(pivots + c), a + c); });
    const S pivot = a[at], inverse = S(1) / pivot;
    sound = sound & greater(pivot, S(shared<T>) * to.diagonal[k]);
    for (int i = 0; i < 6 * nodes; ++i) {
      S* const x = to.compliance + i * row;
      const S scaled = inverse * a[column(i)];
      const V by = wide<V>(scaled);
      if (i == k)
        to.each(own, nodes, [&](int c) __attribute__((always_inline)) { stored(V(wide<V>(inverse) * loaded<V>(a + c)), x + c); });
      else
        to.each(i / 6, nodes, [&](int c) __attribute__((always_inline)) { stored(V(loaded<V>(x + c) - by * loaded<V>(a + c)), x + c); });
      if (i / 6 <= own) x[at] = i == k ? -inverse : scaled;
    }
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
  if constexpr (inverse) sound = sound & invert(at.nodes, to);
  const int n = 6 * at.nodes;
  const auto place = [&](int i) { return 6 * at.node[i / 6].place + i % 6; };
  for (int i = 0; i < n; ++i)
    for (int j = i; j < n; ++j) {
      const S& found = to.compliance[size_t(i) * to.columns + node_columns * (j / 6) + j % 6];
      const S x = inverse ? S(-found) : found;
      scattered(x, out + size_t(place(i)) * n + place(j), stride, at.states);
      if (j > i) scattered(x, out + size_t(place(j)) * n + place(i), stride, at.states);
    }
  return S::mask(sound);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
