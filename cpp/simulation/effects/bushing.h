// A bushing: a spring and damper in six dimensions between two nodes. With X = (R, p) the pose of node b in the frame of a at rest, θ the rotation
// vector of R and ξ = (θ; p),
//
//   U = ½ ξ* K ξ,     g = K ξ + C ξ̇,     on b: the force -g_p at its origin, the moment -J*⁻¹(θ) g_θ, in the axes of a at rest; on a the opposite
//
// J the left Jacobian of the exponential, θ̇ = J⁻¹ ω. K and C symmetric (6, 6), N m/rad and N/m, N m s/rad and N s/m. Exact for rotations below
// half a turn, where θ has no derivative.
#pragma once

#include "simulation/effects/node_pair.h"

namespace pycraft {

class Bushing : public Effect {
 public:
  // Row-major (6, 6); rest: the pose of b in a where nothing is stretched.
  Bushing(const Multibody& model, const std::string& node_a, const std::string& node_b, const std::vector<double>& stiffness, const std::vector<double>& damping, const Pose<double>& rest);
  std::string kind() const override { return "bushing"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const NodePair nodes;
  const std::vector<double> stiffness, damping;
  Node base;      // a at rest
  bool damps;
};

}  // namespace pycraft
