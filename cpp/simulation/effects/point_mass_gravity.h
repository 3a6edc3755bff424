// The gravity of a point mass: with r from the point to a body's centre of mass
//
//   F = -μ m r/|r|³,   U = -μ m/|r|,   μ in m³/s²
//
// as if the body's mass were at its centre; gravity_gradient.h has the next term.
#pragma once

#include "simulation/effects/bodies_in_field.h"

namespace pycraft {

class PointMassGravity : public Effect {
 public:
  PointMassGravity(const Multibody& model, double mu, const Vector3<double>& position, const Names& bodies);
  std::string kind() const override { return "point_mass_gravity"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const double mu;
  const Vector3<double> position;
  const std::vector<BodyInField> bodies;
};

// ModelError where they make no sense; `effect` for errors.
void check_point_mass(double mu, const Vector3<double>& position, const std::string& effect);

}  // namespace pycraft
