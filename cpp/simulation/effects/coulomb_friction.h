// Dry friction, smoothed: T(j) = -F(j) tanh(v(j)/s), F in N m or N, s the smoothing speed in rad/s or m/s. From three times that speed on it is
// F but for half a percent; below, it is viscous with coefficient F/s, so that what should stick creeps by s T/F.
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class CoulombFriction : public Effect {
 public:
  CoulombFriction(const Multibody& model, const Names& hinges, const std::vector<double>& level, double smoothing);
  std::string kind() const override { return "coulomb_friction"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<int> coordinates;
  const std::vector<double> level;
  const double smoothing;
};

}  // namespace pycraft
