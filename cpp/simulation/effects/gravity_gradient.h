// What a body's extent adds to the gravity of a point mass, in the order of its inertia I about the centre of mass (MacCullagh's formula):
//
//   U = -μ/(2|r|³) (tr I - 3 r̂·I r̂),   N = 3μ/|r|³ r̂ × I r̂,   F = 3μ/(2|r|⁴) ((5 r̂·I r̂ - tr I) r̂ - 2 I r̂)
//
// r from the point to the centre of mass. It turns long bodies towards the point; point_mass_gravity.h has the leading term.
// Source: P. C. Hughes, Spacecraft Attitude Dynamics, Wiley 1986, the chapter on environmental torques.
#pragma once

#include "simulation/effects/bodies_in_field.h"

namespace pycraft {

class GravityGradient : public Effect {
 public:
  GravityGradient(const Multibody& model, double mu, const Vector3<double>& position, const Names& bodies);
  std::string kind() const override { return "gravity_gradient"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const double mu;
  const Vector3<double> position;
  const std::vector<BodyInField> bodies;
};

}  // namespace pycraft
