// Viscous damping T = -c v (simulation/effects/damping.h) that steps of size h take implicitly: their D has h c in addition, so that
//
//   (ℳ + J + h C) v̇ = T - C v,   v⁺ = v + h v̇     is     (ℳ + J) (v⁺ - v)/h = T - C v⁺
//
// and no step is too large for any c >= 0. Other integrators see plain damping.
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class ImplicitDamping : public Effect {
 public:
  ImplicitDamping(const Multibody& model, const Names& hinges, const std::vector<double>& coefficient);
  std::string kind() const override { return "implicit_damping"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<int> coordinates;
  const std::vector<double> coefficient;
};

}  // namespace pycraft
