// Quadratic damping, as of a body in air: T(j) = -c(j) |v(j)| v(j), c in N m s²/rad² or N s²/m². Its power is -Σ c |v|³.
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class QuadraticDamping : public Effect {
 public:
  QuadraticDamping(const Multibody& model, const Names& hinges, const std::vector<double>& coefficient);
  std::string kind() const override { return "quadratic_damping"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<int> coordinates;
  const std::vector<double> coefficient;
};

}  // namespace pycraft
