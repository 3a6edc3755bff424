// When D(k) counts as singular: never by luck, but by comparison with the rounding bound of the sweep that made it.
//
// Entries of P(k) round at sqrt(P(i,i) P(j,j)), whatever cancels in them, and so does the downdate; D = HPH* + J and PH* round at
// y(i) = (Σ_a H(i,a)² P(a,a) + J(i,i))^½. An error δP passes the hinge as τ̄ δP τ̄*, one of D as G δD G*. So the errors of the plain form
// are bounded by a small multiple of eps times X, where, tip to base,
//
//   X(k)  = diag P(k) + Σ_{children c} E(k,c) X⁺(c) E(k,c)*,     X⁺(c) = diag P(c) + τ̄(c) X(c) τ̄(c)* + G(c) diag(y²) G(c)*
//
// bound D's own error entry by entry: |δD(i,j)| <= rounding_bound · x(i) x(j), x(i)² = (H X H* + J)(i,i). Pivot j of D(k) is the Schur
// complement w* D w, w = (-D₁₁⁻¹ D₁ⱼ, 1), so its error is at most rounding_bound · (j + 1) Σ w(i)² x(i)²; at or below that it is noise,
// and no digit of D⁻¹ would be right.
//
// Factored forms round columns, and their D is good to (64 eps)². But G = PH*D⁻¹ is a first power: of HC and C, each right to eps of the
// lengths y and P(a,a)^½ of its rows, a product that should vanish leaves eps y P(a,a)^½, and so G and with it the innovations are off by
// eps y²/D of what they could be at all. At one no digit of what a motion of the parent makes of θ̈ would be right, however good D is.
//
// Beside what a hinge moves along other directions, D may be so faint that the value keeps few digits and yet some: the errors of G, of forces
// and of gyroscopic terms enter θ̈ by their ratio to D, and how much of θ̈ they are hangs on the forces. No bound of D alone can say: forward
// dynamics measures it, where `faint_ratio` leaves a doubt, by a residual in wider scalars, corrects θ̈ so, and refuses what does not come to
// `faint_limit` so (dynamics/rigid_dynamics.cpp). The plain form owes fewer: it is in doubt where not three digits are sure.
//
// The sweep costs as much again as P's own; block policies run it only where an estimate of X leaves a doubt.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>

#include "algebra/language/structure.h"
#include "numerics/arithmetic.h"
#include "numerics/scalar.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

// Per unit of X. A factored form rounds its columns, whose squares P is.
template <class S>
inline S rounding_bound(Form form) {
  const S column = S(64) * epsilon<S>();
  return form == Form::fast ? S(8) * epsilon<S>() : S(column * column);
}

// What a hinge coordinate feels, D, and how much more its body feels along others: `ratio` times eps is what its θ̈ may be off by.
struct FaintPivot {
  int body = -1, coordinate = 0;
  double pivot = 0, ratio = 0;
};
// Of θ̈ that may be off by more than 2⁻²⁶ (in single precision √eps), in the plain form by more than 2⁻¹⁰, a residual is formed; what stays off by
// more than 64 times the first of these is refused.
template <class S>
inline S faint_error() {
  using std::sqrt;
  static const double root = std::sqrt(std::max(to_double(epsilon<S>()), 0x1p-52));
  return S(root);
}
template <class S>
inline S faint_ratio(Form form) {
  return epsilon<S>() / (form == Form::fast ? S(0x1p-10) : faint_error<S>());
}
template <class S>
inline S faint_limit() {
  return S(64) * faint_error<S>();
}

// What the elimination of a hinge found in the pivots of D(k).
enum class Pivots { sound, doubtful, not_positive };

[[noreturn]] inline void throw_singular_hinge(const SkoStructure& tree, int k, int coordinate, double pivot, double bound, Form form) {
  if (!std::isfinite(pivot) || !std::isfinite(bound))
    throw EvaluationError("the articulated inertia of body '" + tree.body_names[k] +
                          "' overflows: its masses, lengths or velocities are beyond the range of this precision; take other units or a wider precision");
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "D = %.3g, rounding bound %.3g", pivot, bound);
  const std::string remedy = form == Form::fast ? "form=\"ud\" or a wider precision" : "a wider precision";
  throw SingularHingeError("hinge '" + tree.hinge_names[k] + "' of body '" + tree.body_names[k] + "' feels no inertia along coordinate '" +
                           tree.coordinate_names[tree.dof_offset[k] + coordinate] + "' (" + numbers +
                           "): give the bodies it moves a mass, or the hinge a rotor inertia, or weld it; where it carries light bodies under heavy ones, take " +
                           remedy,
                           tree.dof_offset[k] + coordinate);
}

[[noreturn]] inline void throw_faint_hinge(const SkoStructure& tree, const FaintPivot& faint) {
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "D = %.3g, and %.1g times as much along others", faint.pivot, faint.ratio);
  throw SingularHingeError("hinge '" + tree.hinge_names[faint.body] + "' of body '" + tree.body_names[faint.body] + "' feels too little inertia along coordinate '" +
                             tree.coordinate_names[tree.dof_offset[faint.body] + faint.coordinate] + "' (" + numbers +
                             "): of the accelerations here fewer than six digits would be right; take a wider precision, or give the bodies it moves more "
                             "inertia, or the hinge a rotor inertia",
                           tree.dof_offset[faint.body] + faint.coordinate);
}

// (j + 1) Σ_i w(i)² squares(i), w = (-D₁₁⁻¹ D₁ⱼ, 1) for D = L d L*, L with a unit diagonal; w: n numbers of scratch.
template <class S>
inline S pivot_reach(const S* L, int n, int j, const S* squares, S* w) {
  S sum = squares[j];
  for (int back = 1; back <= j; ++back) {  // L₁₁* w₁ = -L(j, ·)*
    const int i = j - back;
    S solved = -L[j * n + i];
    for (int a = i + 1; a < j; ++a) solved -= L[a * n + i] * w[a];
    w[i] = solved;
    sum += w[i] * w[i] * squares[i];
  }
  return S(j + 1) * sum;
}

// Throws unless every pivot of body k's D = L d L* stands out of its rounding. squares: x(i)², n numbers, and n more of scratch.
template <class S>
void require_pivots(const SkoStructure& tree, int k, const S* L, const S* pivots, S* squares, Form form) {
  const int n = tree.dof[k];
  for (int j = 0; j < n; ++j) {
    const S bound = rounding_bound<S>(form) * pivot_reach(L, n, j, squares, squares + n);
    if (!(pivots[j] > bound)) throw_singular_hinge(tree, k, j, to_double(pivots[j]), to_double(bound), form);
  }
}

// A pivot at or below `gain_bound` of its reach over y² leaves no digit of G in a factored form; the plain one is refused before.
template <class S>
inline S gain_bound(Form form) {
  return form == Form::fast ? S(0) : S(S(4) * epsilon<S>());
}

// Throws unless every column of body k's G has a digit. squares: y(i)², n numbers, and n more of scratch.
template <class S>
void require_gain(const SkoStructure& tree, int k, const S* L, const S* pivots, S* squares, Form form) {
  const int n = tree.dof[k];
  for (int j = 0; j < n && form != Form::fast; ++j) {
    const S bound = gain_bound<S>(form) * pivot_reach(L, n, j, squares, squares + n);
    if (!(pivots[j] > bound)) throw_singular_hinge(tree, k, j, to_double(pivots[j]), to_double(bound), form);
  }
}

// Throws SingularHingeError at the first hinge whose pivot is noise; of bodies before `last` nothing is asked, so that a sweep that
// has met a pivot that is not positive learns which one is to blame.
template <class Blocks>
void check_pivots_tip_to_base(const SkoStructure& tree, Blocks& blocks, int last = 0) {
  for (int k = 0; k < tree.bodies(); ++k) blocks.start_error(k);
  for (int k = tree.bodies() - 1; k >= last; --k) {
    check_interrupt_at(k);
    blocks.check_pivots(k);
    if (tree.parent[k] >= 0) blocks.error_to_parent(k);
  }
}

}  // namespace pycraft
