// Uniform gravity: a field g, m/s², in the world's axes. Its force on a body is m g at the centre of mass, its potential -Σ m g·c.
//
// It gives no forces of its own: accelerations are found with the base accelerated by -g, at no cost (recursions/applied.h).
#pragma once

#include "simulation/effect.h"

namespace pycraft {

class Gravity : public Effect {
 public:
  explicit Gravity(const Vector3<double>& g);
  std::string kind() const override { return "gravity"; }
  Declaration declaration() const override {
    Declaration d;
    d.uniform_gravity = true, d.gravity = g;
    return d;
  }
  PYCRAFT_BINDS

  const Vector3<double> g;
};

}  // namespace pycraft
