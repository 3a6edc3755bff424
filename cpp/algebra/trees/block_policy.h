// What the sweeps ask of the blocks of a tree: numbers of each body k, and what travels along the edge from k to its parent p.
//
//   DenseBlocks   any size, as matrices (dense_blocks.h)
//   RigidBlocks   six rows of 3x3 structure (rigid/rigid_blocks.h)
//   MixedBlocks   bodies of both kinds in one tree, chosen body by body (mixed_blocks.h)
//
// Vectors are m columns of the rows of one body, row-major. A sweep is compiled for its policy: nothing is asked at run time in trees of one kind.
#pragma once

#include <concepts>

#include "algebra/language/residual_sizes.h"
#include "algebra/language/structure.h"
#include "algebra/trees/sweeps/singular_pivot.h"
#include "numerics/arithmetic.h"

namespace pycraft {

// Symmetric blocks that a body hands to its parent, in its own axes: P⁺, the error bound X⁺ of singular_pivot.h, R.
enum class Carried { articulated, error, composite };

template <class B>
concept BlockPolicy = requires(B blocks, const B& known, SymbolId id, int k, const typename B::Scalar* x, typename B::Scalar* y, typename B::Scalar* z, int m,
                               bool transposed, const RoundingUnits<typename B::Scalar>& units, Form form) {
  // ---- applied to vectors
  known.shift_add(k, x, y, m);                        // y(p) += E x(k)
  known.shift_transposed_add(k, x, y, m);             // y(k) += E* x(p)
  known.articulated_shift_add(k, x, y, m);            // y(p) += E (I - GH) x(k)
  known.articulated_shift_transposed_add(k, x, y, m); // y(k) += (I - GH)* E* x(p)
  known.hinge(k, x, y, m);                            // y = H x
  known.hinge_transposed_add(k, x, y, m);             // y += H* x
  known.hinge_diagonal_add(k, x, y, m);               // y += J x
  known.inertia_in_place(k, y, m);                    // y = M y
  known.innovation(k, x, y, z, m);                    // z = x - H y, y += G z
  known.gain_transposed_subtract(k, x, y, m);         // y -= G* x
  known.solve_D_in_place(k, y, m);                    // y = D⁻¹ y
  known.apply(id, transposed, k, x, y, m);            // y = A(k) x, A(k)* x of a block-diagonal letter
  known.block(id, k, y);                              // A(k), row-major; of E the block (p, k)
  { known.pivots(k) } -> std::same_as<const typename B::Scalar*>;  // d of D(k) = L d L*
  // ---- sizes of what residuals add up: sweeps/residual_rounding.h
  known.motion_sizes(k, x, x, x, y, m);
  known.inertia_sizes(k, x, units, y, m);
  known.shifted_force_sizes(k, x, units, y, m);
  known.coordinate_sizes(k, x, x, units, y, m);
  // ---- inertias and compliance, body by body: articulated, composite, Υ
  blocks.form = form;
  blocks.keep_inertias = true, blocks.with_bias = false;
  blocks.start_articulated(k);                        // P(k) = M(k)
  { blocks.eliminate_hinge(k) } -> std::same_as<Pivots>;  // D, G, P⁺
  blocks.articulated_to_parent(k);                    // P(p) += E P⁺ E*
  blocks.start_error(k), blocks.check_pivots(k), blocks.error_to_parent(k);
  blocks.start_composite(k), blocks.composite_to_parent(k);
  blocks.compliance_from_parent(k, k);                // Υ(k) from Υ(p)
};

// What a policy adds for neighbours of another kind: blocks as dense symmetric matrices, factors column by column.
template <class B>
concept CarryingPolicy = BlockPolicy<B> && requires(B blocks, const B& known, int k, const typename B::Scalar* x, typename B::Scalar* y, Carried what) {
  blocks.carried(what, k, y);      // what k hands to its parent
  blocks.take(what, k, x);         // what k is handed by a child, added
  blocks.carried_columns(k, [](const typename B::Scalar& /*weight*/, auto&& /*u*/) {});  // P⁺ of a factored form, as Σ u weight u*
  blocks.take_column(k, *x, [](int) { return typename B::Scalar(0); });
  blocks.compliance_from(k, x);    // Υ(k) = τ̄* A τ̄ + H*D⁻¹H, A = E*Υ(p)E
};

}  // namespace pycraft
