// What the articulated-body algorithm keeps of a link (forward_dynamics.h has the equations).
#pragma once

#include "kernels/motions.h"
#include "kernels/pivots.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class S>
struct ForwardLink {
  Motion<S> motion;
  S inverse, innovation;      // D⁻¹, ε
  Vector3<S> angular, linear;  // P_h
  Vector3<S> alpha, acceleration;  // of the link; on the way to the base the diagonals of P's A and C

  [[gnu::always_inline]] void keep_diagonals(const Inertia<S>& P) { alpha = {P.A(0, 0), P.A(1, 1), P.A(2, 2)}, acceleration = {P.C(0, 0), P.C(1, 1), P.C(2, 2)}; }
};
template <class S>
struct ForwardMultiple {  // hinges of several coordinates
  S rate[6];              // D⁻¹ε
  Matrix3<S> gain;        // ball: D⁻¹B
  Factors<3, S> ball;     // of D
  Factors<6, S> free;
};

template <class S>
struct ForwardWork {
  ForwardLink<S>* link;
  Inertia<S>* branch;
  ForwardMultiple<S>* multiple;
  template <class T>
  static size_t size(const Links<T>& links) {
    return links.count * (sizeof(ForwardLink<S>) + sizeof(Inertia<S>)) + links.multiple * sizeof(ForwardMultiple<S>);
  }
  template <class T>
  ForwardWork(const Links<T>& links, T* work) {
    link = reinterpret_cast<ForwardLink<S>*>(work);
    branch = reinterpret_cast<Inertia<S>*>(link + links.count);
    multiple = reinterpret_cast<ForwardMultiple<S>*>(branch + links.count);
  }
  template <class T>
  ForwardMultiple<S>* of(const Link<T>& link) const { return multiple + (link.multi < 0 ? 0 : link.multi); }
};

// What inertias, of whatever sort, link k begins with on the way to the base, of those first..last that are swept at once: P of the link that
// follows it, or what that has left in its branch where it is not among them.
template <class S, class T>
[[gnu::always_inline]] inline void start_inward(const Links<T>& links, const ForwardWork<S>& w, int k, int last, Inertia<S>& P) {
  if (k + 1 == links.count || links.link[k + 1].parent != k)
    P = no_inertia<S>();
  else if (k + 1 == last)
    P = w.branch[last];
  if (links.link[k].branches) add(P, w.branch[k]);
}
// Where nothing but the force that goes with an inertia is carried, and how sure it is.
template <class S>
[[gnu::always_inline]] inline void carry_nothing(Inertia<S>& P) {
  P.n = P.f = Vector3<S>::zero(), P.error = S(0), P.growth = S(1);
}
template <class S>
[[gnu::always_inline]] inline void add_carried(Inertia<S>& P, const Inertia<S>& Q) {
  P.n = P.n + Q.n, P.f = P.f + Q.f;
  P.error = larger(P.error, Q.error), P.growth = larger(P.growth, Q.growth);
}
// What a subtree apart has left goes to its parent, whose own branches are cleared; a link that follows its parent is met by that itself.
template <class S, class T>
inline void join_parent(const Links<T>& links, const ForwardWork<S>& w, int root) {
  const int parent = links.link[root].parent;
  if (parent >= 0 && parent != root - 1) add(w.branch[parent], w.branch[root]);
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
