// A chain of Nosé-Hoover thermostats on n coordinates, p = (ℳ + J) v their momenta, τ the time constant:
//
//   T(j) = -ξ₁ p(j)
//   ξ̇₁ = (Σ v(j) p(j)/(n kT) - 1)/τ² - ξ₁ξ₂,   ξ̇₂ = n ξ₁² - 1/τ² - ξ₂ξ₃,   ξ̇ᵢ = ξᵢ₋₁² - 1/τ² - ξᵢξᵢ₊₁,   η̇ᵢ = ξᵢ
//
// with ξ_{M+1} = 0: masses Q₁ = n kT τ², Qᵢ = kT τ². The whole energy H + ½ Σ Qᵢ ξᵢ² + kT (n η₁ + Σ_{i>1} ηᵢ) is constant, and the density that the
// motion keeps is exp(-H/kT) in coordinates and momenta, √det(ℳ + J) exp(-U/kT) in coordinates. Prescribed coordinates are not among the n. Cost O(N).
// Source: G. J. Martyna, M. L. Klein, M. Tuckerman, Nosé-Hoover chains, J. Chem. Phys. 97 (1992).
#pragma once

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

class NoseHoover : public Effect {
 public:
  // kT in J.
  NoseHoover(const Multibody& model, const Names& hinges, double kT, double time_constant, int chain);
  std::string kind() const override { return "nose_hoover"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const Multibody& model;
  const std::vector<int> coordinates;
  const double kT, time_constant;
  const int chain;
};

}  // namespace pycraft
