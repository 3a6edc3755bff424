// Compliant stops at pins, sliders and screws (Hunt and Crossley's law, exponent 1): with d > 0 how far the coordinate is beyond its limit,
//
//   T = ± k d max(0, 1 + a ḋ)      back towards the limit
//
// k in N m/rad or N/m, a in s/rad or s/m: continuous where it begins, never pulling. Potential ½ k d², the rest is work.
// Source: K. H. Hunt and F. R. E. Crossley, Coefficient of restitution interpreted as damping in vibroimpact, J. Applied Mechanics 42, 1975.
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class Limits : public Effect {
 public:
  // lower, upper empty: those of the model's hinges. Hinges none: all that have a limit. One number for all, or one each.
  Limits(const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& dissipation, const std::vector<double>& lower,
         const std::vector<double>& upper);
  std::string kind() const override { return "limits"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  std::vector<SingleCoordinate> coordinates;
  std::vector<double> lower, upper, stiffness, dissipation;
};

}  // namespace pycraft
