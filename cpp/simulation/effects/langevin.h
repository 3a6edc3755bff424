// A Langevin thermostat: friction -Γ v and white noise of the covariance 2 kT Γ, Γ diagonal in coordinates, by impulses between steps. Number k of
// them acts at (k + ½) h, h the period, at the configuration that is there:
//
//   (ℳ + J + ½hΓ) Δv = -hΓ v + √(2kT hΓ) n,   n unit normal
//
// which is the midpoint rule of (ℳ + J) dv = -Γ v dt + √(2kTΓ) dW. Velocities of the covariance kT (ℳ + J)⁻¹ have it afterwards, whatever h: with
// Z = ℳ + J and A = ½hΓ it is (Z - A) Z⁻¹ (Z - A) + 4A = (Z + A) Z⁻¹ (Z + A). So the density √det Z exp(-H/kT) stays what it is but for the
// integrator's error between impulses; without noise, motions at whole multiples of h differ from those with damping by O(h²). Cost O(N).
//
// Noise is a function of the seed, the number of the impulse, the coordinate, and which of the scene's effects with impulses it is of: the same
// whenever, and from wherever, a run comes there, and independent between two thermostats of one coordinate.
// Source: B. Leimkuhler, C. Matthews, Molecular Dynamics, Springer 2015, the chapter on splittings of Langevin dynamics.
#pragma once

#include <cstdint>

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class Langevin : public Effect {
 public:
  // kT in J; friction one for all or one each.
  Langevin(const Multibody& model, const Names& hinges, double kT, const std::vector<double>& friction, double period, std::uint64_t seed);
  std::string kind() const override { return "langevin"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<int> coordinates;
  const std::vector<double> friction;
  const double kT, period;
  const std::uint64_t seed;
};

}  // namespace pycraft
