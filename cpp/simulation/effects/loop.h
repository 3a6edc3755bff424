// Loops of the model (model/loops.h) kept by tree augmentation: accelerations are those of dynamics/constrained_dynamics.h, and what drifts off
// the loops in a step is taken back at its end. Their forces do no work. Baumgarte's r̈ + 2α ṙ + β² r = 0 besides, where α or β is not zero.
#pragma once

#include "simulation/effect.h"

namespace pycraft {

class KeepLoops : public Effect {
 public:
  // ModelError for names of loops that are not there, twice, and gains below zero.
  KeepLoops(std::shared_ptr<const LoopSet> set, std::vector<std::string> names, double alpha, double beta);
  std::string kind() const override { return "loop"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

 private:
  std::shared_ptr<const KeptLoops> kept_;
};

}  // namespace pycraft
