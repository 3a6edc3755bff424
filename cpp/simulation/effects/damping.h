// Viscous damping: T(j) = -c(j) v(j), c in N m s/rad or N s/m. Its power is -Σ c v².
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class Damping : public Effect {
 public:
  // One coefficient for all coordinates of these hinges, or one each.
  Damping(const Multibody& model, const Names& hinges, const std::vector<double>& coefficient);
  std::string kind() const override { return "damping"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<int> coordinates;
  const std::vector<double> coefficient;
};

}  // namespace pycraft
