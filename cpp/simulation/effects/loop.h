// Loops of the model (model/loops.h) kept by tree augmentation or by constraint embedding: accelerations are those of
// dynamics/constrained_dynamics.h or of dynamics/embedded_dynamics.h, and what drifts off the loops in a step is taken back at its end, by all
// coordinates or by dependent ones alone. Their forces do no work. With augmentation Baumgarte's r̈ + 2α ṙ + β² r = 0 besides, where α or β is not zero.
#pragma once

#include "simulation/effect.h"

namespace pycraft {

class KeepLoops : public Effect {
 public:
  // ModelError for names of loops that are not there, twice, gains below zero, and gains of loops that are embedded.
  KeepLoops(std::shared_ptr<const LoopSet> set, std::vector<std::string> names, double alpha, double beta, bool embedded);
  std::string kind() const override { return "loop"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

 private:
  std::shared_ptr<const KeptLoops> kept_;
};

}  // namespace pycraft
