// A servo: T(j) = kp (r(t) - q(j)) + kd (ṙ(t) - v(j)) on pins, sliders and screws, r the target, within limits (simulation/effects/drive_limits.h).
#pragma once

#include "simulation/effect.h"
#include "simulation/effects/drive_limits.h"
#include "simulation/function_of_time.h"
#include "simulation/selection.h"

namespace pycraft {

class Servo : public Effect {
 public:
  // Gains one for all or one each, the target likewise.
  Servo(const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& damping, TimeFunction target, DriveLimits limits);
  std::string kind() const override { return "servo"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<SingleCoordinate> coordinates;
  const std::vector<double> stiffness, damping;
  TimeFunction target;
  DriveLimits limits;
};

}  // namespace pycraft
