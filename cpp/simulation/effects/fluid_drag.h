// The resistance of a fluid of density ρ (kg/m³) and viscosity β (Pa s) that moves at a constant velocity w, to boxes with edges a, b, c: in a box's
// axes, with v the velocity of its centre less w and ω its angular velocity (MuJoCo's inertia model, "Fluid forces" of its documentation)
//
//   f_x = -½ ρ b c |v_x| v_x - 3 π β d v_x,    n_x = -ρ a (b⁴ + c⁴) |ω_x| ω_x / 64 - π β d³ ω_x,    d = (a + b + c)/3
//
// and so on around: drag of the faces, and Stokes's law for the sphere of diameter d.
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

struct BoxInFluid {
  int body;
  Pose<double> pose;     // of its centre and axes, in the body
  Vector3<double> size;  // edges, m
};

class FluidDrag : public Effect {
 public:
  FluidDrag(double density, double viscosity, const Vector3<double>& wind, std::vector<BoxInFluid> boxes);
  std::string kind() const override { return "fluid_drag"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const double density, viscosity;
  const Vector3<double> wind;
  const std::vector<BoxInFluid> boxes;
};

}  // namespace pycraft
