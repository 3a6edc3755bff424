// A source of torques or forces at coordinates: T(j) = u(j)(t), within limits of effort and speed (simulation/effects/drive_limits.h).
#pragma once

#include "simulation/effect.h"
#include "simulation/effects/drive_limits.h"
#include "simulation/function_of_time.h"
#include "simulation/selection.h"

namespace pycraft {

class TorqueSource : public Effect {
 public:
  // One number for all coordinates of these hinges, or one each.
  TorqueSource(const Multibody& model, const Names& hinges, TimeFunction torque, DriveLimits limits = {});
  std::string kind() const override { return "torque_source"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<int> coordinates;
  TimeFunction torque;
  DriveLimits limits;
};

// ModelError unless a function has one number, or so many.
void check_size(const FunctionOfTime& f, size_t count, const std::string& what);

}  // namespace pycraft
