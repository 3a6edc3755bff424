// A spring between two nodes: the force k (L - L₀) pulls their origins together, L their distance. Potential ½ k (L - L₀)²; k in N/m.
// With L₀ = 0 it is linear in all directions. At L = 0 a spring with L₀ > 0 knows no direction and gives no force.
#pragma once

#include "simulation/effects/node_pair.h"

namespace pycraft {

class NodeSpring : public Effect {
 public:
  NodeSpring(const Multibody& model, const std::string& node_a, const std::string& node_b, double stiffness, double length);
  std::string kind() const override { return "node_spring"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const NodePair nodes;
  const double stiffness, length;
};

}  // namespace pycraft
