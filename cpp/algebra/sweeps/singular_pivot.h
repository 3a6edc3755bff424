// When D(k) counts as singular: never by luck, but by comparison with the rounding bound of the sweep that made it.
//
// The downdate P⁺ = P - GDG* rounds at the size of P, and an error δP of P passes the hinge as τ̄ δP τ̄*. So the errors of the plain
// form are bounded by a small multiple of eps times X, where, tip to base,
//
//   X⁺(c) = P(c) + τ̄(c) X(c) τ̄(c)*,     X(k) = M(k) + Σ_{children c} E(k,c) X⁺(c) E(k,c)*,
//
// and a Cholesky pivot of D(k) at or below rounding_bound · (H X H* + J) is noise: no digit of D⁻¹ would be right.
// The sweep costs as much again as P's own; block policies run it only where a cheap bound on X leaves a doubt.
#pragma once

#include <string>

#include "algebra/errors.h"
#include "algebra/structure.h"
#include "spatial/scalar.h"

namespace pycraft {

template <class S>
inline S rounding_bound() {
  return S(8) * epsilon<S>();
}

[[noreturn]] inline void throw_singular_hinge(const SkoStructure& tree, int k, int coordinate, double pivot, double bound) {
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "D = %.3g, rounding bound %.3g", pivot, bound);
  throw SingularHingeError("hinge '" + tree.hinge_names[k] + "' of body '" + tree.body_names[k] + "' feels no inertia along coordinate '" +
                           tree.coordinate_names[tree.dof_offset[k] + coordinate] + "' (" + numbers +
                           "): give the bodies it moves a mass, or the hinge a rotor inertia, or weld it");
}

// Throws SingularHingeError at the first hinge whose pivot is noise.
template <class Blocks>
void check_pivots_tip_to_base(const SkoStructure& tree, Blocks& blocks) {
  for (int k = 0; k < tree.bodies(); ++k) blocks.start_error(k);
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    blocks.check_pivots(k);
    if (tree.parent[k] >= 0) blocks.error_to_parent(k);
  }
}

}  // namespace pycraft
