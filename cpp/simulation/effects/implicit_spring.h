// Springs T = -k (q - rest) at pins, sliders and screws (simulation/effects/spring.h) that steps of size h take implicitly: their D has h² k in
// addition, and their force is where the step would lead,
//
//   (ℳ + J + h² K) v̇ = T - K (q + h v - rest),   v⁺ = v + h v̇     is     (ℳ + J) (v⁺ - v)/h = T - K (q + h v⁺ - rest)
//
// and no step is too large for any k >= 0. Other integrators see plain springs. Potential ½ k (q - rest)².
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class ImplicitSpring : public Effect {
 public:
  ImplicitSpring(const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& rest);
  std::string kind() const override { return "implicit_spring"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const std::vector<SingleCoordinate> coordinates;
  const std::vector<double> stiffness, rest;
};

}  // namespace pycraft
