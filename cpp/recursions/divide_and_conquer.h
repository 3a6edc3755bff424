// Forward dynamics by divide and conquer: a segment is a run of bodies with all that branches off them, hinge of the first body and all, of
// which two handles are left, the body p that it hangs on and its own last body j. Whatever is inside, accelerations and forces at the handles
// are related as those of one body are:
//
//   f    = P α(p) + ψ F + z       the force on p, in p, of what the segment does to it (that with which it resists)
//   α(j) = ψ* α(p) - Υ F + y      F the force on j of what will hang there
//
// P: V → F the articulated inertia P⁺ of the segment as p feels it, ψ: F → F and Υ: F → V the book's operators within the segment, z the bias
// force, y the bias acceleration. Eliminating rows h(1..n) with an inertia J(i) of their own from an inertia P is the same everywhere:
//
//   D = hPh* + J = L x L*,   b = L⁻¹h,   p = Pb*,   P⁺ = P - Σ p(i)p(i)*/x(i),   τ̄ = I - Σ p(i)b(i)*/x(i),   Υ = Σ b(i)*b(i)/x(i)
//
// One body k, P(k) = M + S + Σ P of its branches, z(k) = P(k)a + b - w + Σ z of its branches, rows H, rotor inertia J, η = L⁻¹(T - Hz):
//
//   P = E P⁺ E*,   ψ = E τ̄,   Υ,   z = E(z(k) + Σ p η/x),   y = Σ b*η/x + a
//
// Two segments, 2 hanging on the last body j of 1, Υ₁ = Σ u(i) h(i)*h(i) the rows with J = 1/u, eliminated from P̃ = P₂ - S(j); with g = z₂ + P̃y₁:
//
//   P = P₁ + ψ₁ P̃⁺ ψ₁*,   ψ = ψ₁ τ̄ ψ₂,   Υ = Υ₂ + Σ (ψ₂*b)(ψ₂*b)*/x,   z = z₁ + ψ₁ τ̄ g,   y = y₂ + ψ₂*(y₁ - Σ b*(b g)/x)
//
// so that a hinge and an end of a segment are eliminated alike, and all that is inverted is D, symmetric and positive. Outwards then:
//
//   join:  s = -b(P̃(ψ₁*α(p) + y₁) + ψ₂F₂ + z₂)/x,   α(j) = ψ₁*α(p) + y₁ + b*s,   hF₁ = -J L⁻*s
//   body:  s = (η - bF - p*α⁺)/x,   θ̈ = L⁻*s,   α = α⁺ + b*s + a,   α⁺ = E*α(p)
//
// Of F₁ = P̃α(j) + ψ₂F₂ + z₂ nothing is felt but hF₁, which is found without the large forces that a heavy segment makes on what only carries it.
//
// S(j) is an inertia lent to the last body of a segment while nothing hangs on it, and taken back from what comes to hang there: any positive
// one, and the equations are the same. Without it a segment that ends in a massless link, or in a rod that turns about itself, would be singular
// where the whole is not; with it a segment is singular only where the whole is, because a motion of it that moves neither a mass nor its end is
// one of the whole. It is of the size of what follows, so that little cancels.
//
// Velocities are put together likewise: ω(j) = R*ω(p) + w along a segment.
//
// Sources: R. Featherstone, A divide-and-conquer articulated-body algorithm for parallel O(log(n)) calculation of rigid-body dynamics, Int. J.
// Robotics Research 18(9), 1999, there with forces at both handles; A. Jain, Robot and Multibody Dynamics, Springer 2011 (ψ, P⁺, Υ). Cost
// O(N), 1400 to 4000 floating-point operations a join.
#pragma once

#include <algorithm>

#include "algebra/trees/sweeps/singular_pivot.h"
#include "numerics/small_ldl.h"
#include "spatial/pose.h"
#include "spatial/symmetric6.h"

namespace pycraft {

// 6x6, F → F, row-major.
template <class S>
struct Transition {
  S m[36];
  S& operator()(int i, int j) { return m[6 * i + j]; }
  const S& operator()(int i, int j) const { return m[6 * i + j]; }
};
template <class S>
inline Vector6<S> operator*(const Transition<S>& A, const Vector6<S>& f) {
  Vector6<S> g = Vector6<S>::zero();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) g[i] += A(i, j) * f[j];
  return g;
}
template <class S>
inline Vector6<S> transpose_times(const Transition<S>& A, const Vector6<S>& V) {
  Vector6<S> W = Vector6<S>::zero();
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) W[j] += A(i, j) * V[i];
  return W;
}
template <class S>
inline Transition<S> operator*(const Transition<S>& A, const Transition<S>& B) {
  Transition<S> C;
  for (int i = 0; i < 6; ++i) {
    S row[6] = {};
    for (int k = 0; k < 6; ++k)
      for (int j = 0; j < 6; ++j) row[j] += A(i, k) * B(k, j);
    std::copy_n(row, 6, C.m + 6 * i);
  }
  return C;
}
// A P A*
template <class S>
inline Symmetric6<S> congruence(const Transition<S>& A, const Symmetric6<S>& P) {
  Transition<S> full;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) full(i, j) = P(i, j);
  const Transition<S> AP = A * full;
  return symmetric6_of<S>([&](int i, int j) {
    S sum = S(0);
    for (int k = 0; k < 6; ++k) sum += AP(i, k) * A(j, k);
    return sum;
  });
}

// The inertia S(j): a sphere about the frame's origin.
template <class S>
struct LentInertia {
  S mass = S(0), rotational = S(0);
};
template <class S>
inline void add(Symmetric6<S>& P, const LentInertia<S>& lent, const S& sign) {
  for (int i = 0; i < 3; ++i) P.A(i, i) += sign * lent.rotational, P.C(i, i) += sign * lent.mass;
}

// Rows that are eliminated, as many as n: h and J before, b, p and x after. L: n x n.
template <class S>
struct Rows {
  int n;
  Vector6<S>*b, *p;
  S *x, *L;
};

// Overwrites h by b and J by x. The least ratio of a pivot to what was added up in it, at most 1: eps over that is what D⁻¹ may be off by;
// zero or less where a pivot is not positive, and nothing else is then of use. sizes: what P is rounded at, diag P or more.
template <class S>
S eliminate(const Symmetric6<S>& P, const Vector6<S>& sizes, const Rows<S>& rows, S* work) {
  const auto& [n, b, p, x, L] = rows;
  S *squares = work, *w = work + n;
  for (int i = 0; i < n; ++i) {
    p[i] = P * b[i];
    squares[i] = x[i];
    for (int a = 0; a < 6; ++a) squares[i] += b[i][a] * b[i][a] * sizes[a];
    for (int j = 0; j <= i; ++j) L[i * n + j] = dot(b[j], p[i]) + (i == j ? x[i] : S(0));
  }
  if (ldl_in_place(L, n, x) < n) return S(0);
  S least = S(1);
  for (int i = 0; i < n; ++i) {
    for (int a = 0; a < i; ++a) {
      b[i] = b[i] - L[i * n + a] * b[a];
      p[i] = p[i] - L[i * n + a] * p[a];
    }
    least = std::min(least, S(x[i] / pivot_reach(L, n, i, squares, w)));
  }
  return least;
}

// P⁺, from P
template <class S>
inline void take_out(const Rows<S>& rows, Symmetric6<S>& P) {
  for (int i = 0; i < rows.n; ++i) downdate(P, rows.p[i], (S(1) / rows.x[i]) * rows.p[i]);
}
// τ̄f = f - Σ p (b f)/x
template <class S>
inline Vector6<S> passed(const Rows<S>& rows, const Vector6<S>& f) {
  Vector6<S> left = f;
  for (int i = 0; i < rows.n; ++i) left = left - (dot(rows.b[i], f) / rows.x[i]) * rows.p[i];
  return left;
}

template <class S>
struct Segment {
  Symmetric6<S> P, Y;  // Y: Υ
  Transition<S> psi;
  Vector6<S> z, y;
  Vector6<S> sizes;  // what P is rounded at: its diagonal before anything cancelled in it that was joined last
};

template <class S>
inline Vector6<S> diagonal(const Symmetric6<S>& P) {
  return {{P.A(0, 0), P.A(1, 1), P.A(2, 2)}, {P.C(0, 0), P.C(1, 1), P.C(2, 2)}};
}

// What hangs on one body, or several times that.
template <class S>
inline void add_branch(const Segment<S>& branch, Symmetric6<S>& P, Vector6<S>& z, Vector6<S>& sizes) {
  add(P, branch.P);
  z = z + branch.z;
  sizes = sizes + branch.sizes;
}

// z and y of one body, of which the rows are eliminated; z: z(k). eta: T, then η.
template <class S>
void bias_of_body(const Pose<S>& X, const Vector6<S>& z, const Vector6<S>& a, const Rows<S>& rows, S* eta, Segment<S>& out) {
  forward_substitute(rows.L, rows.n, eta, 1);
  Vector6<S> plus = z;
  out.y = a;
  for (int i = 0; i < rows.n; ++i) {
    eta[i] -= dot(rows.b[i], z);
    plus = plus + (eta[i] / rows.x[i]) * rows.p[i];
    out.y = out.y + eta[i] * ((S(1) / rows.x[i]) * rows.b[i]);
  }
  out.z = force_to_parent(X, plus);
}

// Of one body, but for its biases. rows: its hinge's. annihilates(i): whether row i of P⁺ and τ̄ is exactly zero. Returns what eliminate() does.
template <class S, class Annihilates>
S segment_of_body(const Pose<S>& X, Symmetric6<S> P, const Vector6<S>& sizes, const Rows<S>& rows, S* work, const Annihilates& annihilates, Segment<S>& out) {
  const S least = eliminate(P, sizes, rows, work);
  if (!(least > S(0))) return least;
  take_out(rows, P);
  out.Y = Symmetric6<S>::zero();
  for (int i = 0; i < rows.n; ++i) add_symmetric_product(out.Y, S(0.5) * ((S(1) / rows.x[i]) * rows.b[i]), rows.b[i]);
  for (int i = 0; i < 6; ++i)
    if (annihilates(i)) annihilate(P, i);
  out.P = to_parent(X, P);
  Symmetric6<S> rounded = Symmetric6<S>::zero();
  for (int i = 0; i < 3; ++i) rounded.A(i, i) = sizes.angular[i], rounded.C(i, i) = sizes.linear[i];
  out.sizes = diagonal(to_parent(X, rounded));
  for (int c = 0; c < 6; ++c) {
    Vector6<S> unit = Vector6<S>::zero();
    unit[c] = S(1);
    Vector6<S> column = passed(rows, unit);
    for (int i = 0; i < 6; ++i)
      if (annihilates(i)) column[i] = S(0);
    column = force_to_parent(X, column);
    for (int i = 0; i < 6; ++i) out.psi(i, c) = column[i];
  }
  return least;
}

// Rows h of an end of a segment, and what they become where another segment is joined to it: six at most.
template <class S>
struct End {
  int n = 0, pivot[6];
  Vector6<S> h[6], b[6], p[6];
  S J[6], x[6], L[36];
  Rows<S> rows() {
    std::copy_n(h, n, b), std::copy_n(J, n, x);
    return {n, b, p, x, L};
  }
};

// Υ = Σ h*h/J. The pivot that has kept most of its entry comes first, which no unit changes; what has cancelled to rounding is zero. Row i is zero
// at the pivots of rows before it.
template <class S>
void rows_of_compliance(const Symmetric6<S>& Y, End<S>& end) {
  S A[36];
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) A[6 * i + j] = Y(i, j);
  for (end.n = 0; end.n < 6; ++end.n) {
    int pivot = -1;
    S most = S(6) * epsilon<S>();
    for (int i = 0; i < 6; ++i)
      if (const S own = Y(i, i); own > S(0) && A[7 * i] > most * own) pivot = i, most = A[7 * i] / own;
    if (pivot < 0) return;
    Vector6<S>& h = end.h[end.n];
    for (int i = 0; i < 6; ++i) h[i] = A[6 * i + pivot];
    const S inverse = S(1) / h[pivot];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) A[6 * i + j] -= h[i] * (inverse * h[j]);
    for (int i = 0; i < 6; ++i) A[6 * i + pivot] = A[6 * pivot + i] = S(0);
    end.J[end.n] = h[pivot], end.pivot[end.n] = pivot;
  }
}
// A force F with hF = f, for such rows: nothing else of a force is felt through Υ.
template <class S>
Vector6<S> felt_force(const End<S>& end, const S* f) {
  Vector6<S> F = Vector6<S>::zero();
  for (int i = end.n - 1; i >= 0; --i) F[end.pivot[i]] = (f[i] - dot(end.h[i], F)) / end.h[i][end.pivot[i]];
  return F;
}

// P̃, and what it is rounded at.
template <class S>
inline Symmetric6<S> without(const LentInertia<S>& lent, const Segment<S>& segment, Vector6<S>& sizes) {
  Symmetric6<S> P = segment.P;
  sizes = segment.sizes;
  for (int i = 0; i < 3; ++i) sizes.angular[i] += lent.rotational, sizes.linear[i] += lent.mass;
  add(P, lent, S(-1));
  return P;
}

// z and y of two, P̃ that of the outboard one, of which the rows are eliminated.
template <class S>
void join_biases(const Segment<S>& one, const Segment<S>& two, const Symmetric6<S>& P, const Rows<S>& rows, Segment<S>& out) {
  const Vector6<S> g = two.z + P * one.y;
  Vector6<S> y = one.y;
  for (int i = 0; i < rows.n; ++i) y = y - dot(rows.b[i], g) * ((S(1) / rows.x[i]) * rows.b[i]);
  out.z = one.z + one.psi * passed(rows, g);
  out.y = two.y + transpose_times(two.psi, y);
}

// end: with the rows of Υ₁, from rows_of_compliance, or of the one body that 1 is. Returns what eliminate() does.
template <class S>
S join(const Segment<S>& one, const Segment<S>& two, const LentInertia<S>& lent, End<S>& end, Segment<S>& out) {
  Vector6<S> sizes;
  Symmetric6<S> P = without(lent, two, sizes);
  const Rows<S> rows = end.rows();
  S work[12];
  const S least = eliminate(P, sizes, rows, work);
  if (!(least > S(0))) return least;
  join_biases(one, two, P, rows, out);
  Transition<S> through = two.psi;  // τ̄ψ₂
  out.Y = two.Y;
  for (int i = 0; i < rows.n; ++i) {
    const Vector6<S> seen = transpose_times(two.psi, rows.b[i]), seen_scaled = (S(1) / rows.x[i]) * seen;
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c) through(r, c) -= rows.p[i][r] * seen_scaled[c];
    add_symmetric_product(out.Y, S(0.5) * seen_scaled, seen);
  }
  take_out(rows, P);
  out.P = congruence(one.psi, P);
  add(out.P, one.P);
  out.sizes = one.sizes;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) out.sizes[i] += one.psi(i, j) * one.psi(i, j) * sizes[j];
  out.psi = one.psi * through;
  return least;
}

// The biases alone again, of other forces.
template <class S>
void join_again(const Segment<S>& one, const Segment<S>& two, const LentInertia<S>& lent, End<S>& end, Segment<S>& out) {
  Vector6<S> sizes;
  const Symmetric6<S> P = without(lent, two, sizes);
  const Rows<S> rows = end.rows();
  S work[12];
  eliminate(P, sizes, rows, work);
  join_biases(one, two, P, rows, out);
}

// From motion and force at the handles of both: the motion between them, and felt = hF₁ = -Jt of the force that the outboard one puts on the other.
template <class S>
inline Vector6<S> part(const Segment<S>& one, const Segment<S>& two, const LentInertia<S>& lent, End<S>& end, const Vector6<S>& motion, const Vector6<S>& force,
                       S* felt) {
  Vector6<S> sizes;
  const Symmetric6<S> P = without(lent, two, sizes);
  const Rows<S> rows = end.rows();
  S work[12];
  eliminate(P, sizes, rows, work);
  const Vector6<S> y = transpose_times(one.psi, motion) + one.y, resisting = P * y + two.psi * force + two.z;
  Vector6<S> between = y;
  for (int i = 0; i < rows.n; ++i) {
    felt[i] = -dot(rows.b[i], resisting) / rows.x[i];
    between = between + felt[i] * rows.b[i];
  }
  back_substitute(rows.L, rows.n, felt, 1);
  for (int i = 0; i < rows.n; ++i) felt[i] *= -end.J[i];
  return between;
}

// θ̈ of one body's hinge and its motion, from that of what it hangs on and the force of what hangs on it.
template <class S>
inline Vector6<S> accelerate(const Pose<S>& X, const Vector6<S>& a, const Rows<S>& rows, const S* eta, const Vector6<S>& motion, const Vector6<S>& force, S* vdot) {
  const Vector6<S> carried = motion_to_child(X, motion);
  Vector6<S> alpha = carried + a;
  for (int i = 0; i < rows.n; ++i) {
    vdot[i] = (eta[i] - dot(rows.b[i], force) - dot(rows.p[i], carried)) / rows.x[i];
    alpha = alpha + vdot[i] * rows.b[i];
  }
  back_substitute(rows.L, rows.n, vdot, 1);
  return alpha;
}

}  // namespace pycraft
