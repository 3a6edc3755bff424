// What is about the centre of mass, as direct calls: recursions/mass_centre.h at a state.
#pragma once

#include <memory>

#include "dynamics/batches.h"
#include "model/multibody.h"
#include "recursions/mass_centre.h"

namespace pycraft {

template <class S>
class Centroidal {
 public:
  // Centre of mass (3), its velocity (3), inertia about it (3 x 3), momentum about it (6).
  static constexpr int sums = 21;

  explicit Centroidal(const Multibody& model);
  // ModelError where no body has mass. v null: at rest.
  void sum(const S* q, const S* v, S* out);
  // A_G, Ȧ_G and ∂h_G/∂q, (6 x nv) each.
  void columns(const S* q, const S* v, S* matrix, S* rate, S* dq);

 private:
  const MassCentre<S>& fill(const S* q, const S* v);

  const Multibody& source_;
  std::shared_ptr<const CompiledModel<S>> model_;
  RigidBlocks<S> blocks_;
  InertialFrame<S> frame_;
  MassCentreSums<S> sums_;
};

#define PYCRAFT_INSTANTIATE(S) extern template class Centroidal<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

template <>
inline constexpr bool available_at<Centroidal, Digits50> = false;
template <>
inline constexpr bool available_at<Centroidal, Digits100> = false;

}  // namespace pycraft
