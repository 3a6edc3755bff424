// The Fixman potential and its force, which take the factor √det(ℳ + J) away from the density of configurations:
//
//   U = ½ kT ln det(ℳ + J),   T = -∂U/∂θ = -½ kT ∂ln det(ℳ + J)
//
// by the sweep of articulated inertia and those of recursions/log_determinant.h. Cost O(N).
// Source: M. Fixman, Classical statistical mechanics of constraints, Proc. Nat. Acad. Sci. USA 71 (1974).
#pragma once

#include "simulation/effect.h"

namespace pycraft {

class Fixman : public Effect {
 public:
  // kT in J.
  Fixman(const Multibody& of, double energy) : model(of), kT(energy) {}
  std::string kind() const override { return "fixman"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const Multibody& model;
  const double kT;
};

}  // namespace pycraft
