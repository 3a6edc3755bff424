// Rotors at hinges: J(j) = n² I on the diagonal of D, I the rotor's inertia at its own shaft, kg m² (or kg), n the gear ratio. Kinetic energy
// ½ J v². No pass and no force: accelerations are found with D = HPH* + J.
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class RotorInertia : public Effect {
 public:
  RotorInertia(const Multibody& model, const Names& hinges, const std::vector<double>& inertia, const std::vector<double>& gear_ratio);
  std::string kind() const override { return "rotor_inertia"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<int> coordinates;
  const std::vector<double> inertia, gear_ratio;
};

}  // namespace pycraft
