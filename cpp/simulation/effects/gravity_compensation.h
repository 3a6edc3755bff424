// Forces that hold bodies up against uniform gravity: with f the share of its weight that is held, c a point of the body and g the field, m/s²
//
//   F = -f m g at c,   U = f m g·c
//
// f = 1 at the centre of mass cancels the weight; c is elsewhere where only a part of a body is held (MuJoCo's gravcomp of welded bodies).
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

struct HeldBody {
  int body;
  double mass;            // f m
  Vector3<double> point;  // c, in the body's axes
};

class GravityCompensation : public Effect {
 public:
  // points: three numbers a body, or none for the centres of mass.
  GravityCompensation(const Multibody& model, const Names& bodies, const std::vector<double>& share, const std::vector<double>& points, const Vector3<double>& g);
  std::string kind() const override { return "gravity_compensation"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const Vector3<double> g;
  std::vector<HeldBody> bodies;
};

}  // namespace pycraft
