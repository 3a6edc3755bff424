// Springs at hinges: T(j) = -k(j) (q(j) - rest(j)) on pins, sliders and screws, potential ½ k (q - rest)², k in N m/rad or N/m. On a ball
//
//   T = -k θ,  U = ½ k |θ|²,   θ the rotation vector from the attitude of rest, |θ| <= π
//
// in the body's axes. A free subhinge has no such coordinates: bushings (simulation/effects/bushing.h) tie frames.
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

// One subhinge's spring.
struct HingeSpring {
  int q, v;
  bool ball;
  double stiffness;
  double rest[4];  // one number, or a quaternion
};
// Those of the subhinges that these coordinates are, `rest` their numbers in q, or 0: all at zero. `effect` asks, for errors.
std::vector<HingeSpring> hinge_springs(const Multibody& model, const std::vector<int>& coordinates, const std::vector<double>& stiffness, const std::vector<double>& rest,
                                       const std::string& effect);

class Spring : public Effect {
 public:
  // Hinges none: all whose subhinges can have one.
  Spring(const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& rest);
  std::string kind() const override { return "spring"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<HingeSpring> springs;
};

// Coordinates of these hinges that springs can act on; where none are named those of free subhinges are passed over.
std::vector<int> sprung_coordinates(const Multibody& model, const Names& hinges, const std::string& effect);

}  // namespace pycraft
