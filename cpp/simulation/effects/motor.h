// A motor with a straight speed-torque line behind a gear: with u(t) the command, from -1 to 1, and n the gear ratio,
//
//   T(j) = n τ₀ (u - n v(j)/ω₀)
//
// τ₀ its torque at standstill and ω₀ its speed without load, at the motor's own shaft; and the inertia n² J of its rotor at the hinge, in D.
// Within limits at the hinge (simulation/effects/drive_limits.h). A load of inertia I runs up as 1 - exp(-t/τ), τ = (I + n²J) ω₀/(n² τ₀).
#pragma once

#include "simulation/effect.h"
#include "simulation/effects/drive_limits.h"
#include "simulation/function_of_time.h"
#include "simulation/selection.h"

namespace pycraft {

struct MotorNumbers {
  std::vector<double> stall_torque, no_load_speed, gear_ratio, rotor_inertia;  // one for all or one each
};

class Motor : public Effect {
 public:
  Motor(const Multibody& model, const Names& hinges, TimeFunction command, MotorNumbers numbers, DriveLimits limits);
  std::string kind() const override { return "motor"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<int> coordinates;
  TimeFunction command;
  MotorNumbers numbers;
  DriveLimits limits;
};

}  // namespace pycraft
