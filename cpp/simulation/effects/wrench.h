// A wrench (n; f) on a node, N m and N, about the node's origin: constant or a function of time, in the axes of the world, of the body that
// carries the node, or of any node. Its power is n·ω + f·v of the node.
#pragma once

#include "simulation/effect.h"
#include "simulation/function_of_time.h"
#include "simulation/selection.h"

namespace pycraft {

class Wrench : public Effect {
 public:
  // axes: "world", "body", or the name of a node or body.
  Wrench(const Multibody& model, const std::string& node, TimeFunction wrench, const std::string& axes);
  std::string kind() const override { return "wrench"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  Node node, axes;   // axes on -1: the world's, turned as its pose says
  bool fixed;        // in the axes of the node's own body
  TimeFunction wrench;
};

}  // namespace pycraft
