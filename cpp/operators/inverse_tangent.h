// ∂(ℳ + J)⁻¹ x along coordinates, fixed twists and time, by the derivative of the Riccati sweep.
//
// The sweep runs on numbers with a derivative each (numerics/tangent.h), in the form `ud`, seeded by what the direction makes of the leaves:
//
//   ∂R(k) = R(k) ω~,  ∂l(k) = R(k) v     of the pose X_pk, h = (ω; v) the twist in the axes of body k: ∂E = E crf(h)
//   ∂H(j) = H(j) crf(h)                  of the rows inboard of where the twist stands in its hinge
//
// Where it stands outboard of all of the hinge, the body's frame stays with the hinge, so that axes of coordinates remain what they are:
//
//   ∂M(k) = crf(h) M(k) + M(k) crf(h)*,  ∂E(k,c) = crf(h) E(k,c)    of its children c
//
// What is left of a heavy column after it was made orthogonal is rounding, and enters the derivative as it enters the value, squared. By way of
// -(ℳ + J)⁻¹ ∂ℳ (ℳ + J)⁻¹, which differentiates forces, it would enter as it is. Cost: about three sweeps and solves of the form.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "algebra/language/values.h"
#include "numerics/tangent.h"
#include "operators/directions.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

// What the letter stands for: -(ℳ + J)⁻¹ ∂ℳ (ℳ + J)⁻¹, by the factors of the inverse.
Expression expand_inverse_tangent(const Symbol& letter);

// The letter for ∂(X⁻¹), X = HφMφ*H* (+ J), if `tangent` is ∂X along a direction found in its letters; and ∂D.
bool tangent_of_inverse(const std::shared_ptr<MultibodyOperators>& source, const Expression& X, const Expression& tangent, Expression& letter, Expression& of_D);

template <class S>
class RigidValues;

template <class S>
class RigidInverseTangent final : public InverseTangent<S> {
 public:
  explicit RigidInverseTangent(const SkoStructure& tree) : tree_(tree), blocks_(tree) {}
  bool apply(const SkoValues<S>& values, const Symbol& direction, const S* x, S* y, int columns) override;

 private:
  using T = Tangent<S, 1>;
  void seed(const RigidValues<S>& values);
  void move(const RigidValues<S>& values, const S& amount, const TwistPlace& place);

  const SkoStructure& tree_;
  RigidBlocks<T> blocks_;
  std::shared_ptr<const CompiledModel<S>> compiled_;
  CompiledModel<T> model_;
  std::vector<InertiaFactors<T>> factors_;
  std::optional<OfDirection> direction_;  // of the one letter that this serves
  std::vector<T> x_, y_, scratch_;
};

#define PYCRAFT_EXTERN(S) extern template class RigidInverseTangent<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
