// When D(k) counts as singular: never by luck, but by comparison with the rounding bound of the sweep that made it.
//
// The downdate P⁺ = P - GDG* rounds at the size of P, and an error δP of P passes the hinge as τ̄ δP τ̄*. So the errors of the plain
// form are bounded by a small multiple of eps times X, where, tip to base,
//
//   X⁺(c) = diag P(c) + τ̄(c) X(c) τ̄(c)*,     X(k) = M(k) + Σ_{children c} E(k,c) X⁺(c) E(k,c)*,
//
// bound D's own error entry by entry: |δD(i,j)| <= rounding_bound · x(i) x(j), x(i)² = (H X H* + J)(i,i). Pivot j of D(k) is the Schur
// complement w* D w, w = (-D₁₁⁻¹ D₁ⱼ, 1), so its error is at most rounding_bound · (Σ |w(i)| x(i))²; at or below that it is noise, and no
// digit of D⁻¹ would be right.
// The sweep costs as much again as P's own; block policies run it only where a cheap bound on X leaves a doubt.
#pragma once

#include <cmath>
#include <string>

#include "algebra/arithmetic.h"
#include "algebra/errors.h"
#include "algebra/structure.h"
#include "spatial/scalar.h"

namespace pycraft {

// Per unit of X. A factored form rounds its columns, whose squares P is.
template <class S>
inline S rounding_bound(Form form) {
  const S column = S(64) * epsilon<S>();
  return form == Form::fast ? S(8) * epsilon<S>() : S(column * column);
}

// What the elimination of a hinge found in the pivots of D(k).
enum class Pivots { sound, doubtful, not_positive };

[[noreturn]] inline void throw_singular_hinge(const SkoStructure& tree, int k, int coordinate, double pivot, double bound, Form form) {
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "D = %.3g, rounding bound %.3g", pivot, bound);
  const std::string remedy = form == Form::fast ? "form=\"ud\" or a wider precision" : "a wider precision";
  throw SingularHingeError("hinge '" + tree.hinge_names[k] + "' of body '" + tree.body_names[k] + "' feels no inertia along coordinate '" +
                           tree.coordinate_names[tree.dof_offset[k] + coordinate] + "' (" + numbers +
                           "): give the bodies it moves a mass, or the hinge a rotor inertia, or weld it; where it carries light bodies under heavy ones, take " +
                           remedy,
                           tree.dof_offset[k] + coordinate);
}

// Throws unless every pivot of body k's D = L L* stands out of its rounding. x: diagonal of H X H* + J, n numbers, overwritten, and n more.
template <class S>
void require_pivots(const SkoStructure& tree, int k, const S* L, const S* pivots, S* x, Form form) {
  using std::abs, std::sqrt;
  const int n = tree.dof[k];
  for (int i = 0; i < n; ++i) x[i] = sqrt(x[i]);
  S* w = x + n;
  for (int j = 0; j < n; ++j) {
    // L₁₁* w₁ = -L(j, ·)*
    S reach = x[j];
    for (int back = 1; back <= j; ++back) {
      const int i = j - back;
      S sum = -L[j * n + i];
      for (int a = i + 1; a < j; ++a) sum -= L[a * n + i] * w[a];
      w[i] = sum / L[i * n + i];
      reach += abs(w[i]) * x[i];
    }
    const S bound = rounding_bound<S>(form) * reach * reach;
    if (!(pivots[j] > bound)) throw_singular_hinge(tree, k, j, to_double(pivots[j]), to_double(bound), form);
  }
}

// Throws SingularHingeError at the first hinge whose pivot is noise; of bodies before `last` nothing is asked, so that a sweep that
// has met a pivot that is not positive learns which one is to blame.
template <class Blocks>
void check_pivots_tip_to_base(const SkoStructure& tree, Blocks& blocks, int last = 0) {
  for (int k = 0; k < tree.bodies(); ++k) blocks.start_error(k);
  for (int k = tree.bodies() - 1; k >= last; --k) {
    blocks.check_pivots(k);
    if (tree.parent[k] >= 0) blocks.error_to_parent(k);
  }
}

}  // namespace pycraft
