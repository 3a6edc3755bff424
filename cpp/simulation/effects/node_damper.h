// A damper between two nodes: the force c L̇ resists the rate of their distance, along the line between their origins; c in N s/m. Where they
// are at one place there is no line and no force.
#pragma once

#include "simulation/effects/node_pair.h"

namespace pycraft {

class NodeDamper : public Effect {
 public:
  NodeDamper(const Multibody& model, const std::string& node_a, const std::string& node_b, double coefficient);
  std::string kind() const override { return "node_damper"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  const NodePair nodes;
  const double coefficient;
};

}  // namespace pycraft
