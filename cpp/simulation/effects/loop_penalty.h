// Loops of the model (model/loops.h) held by springs and dampers along their rows, in place of what keeps them: a tree with forces.
//
//   λ_i = -(k_i r_i + c_i ṙ_i),   k = ω²/C,   c = 2 ζ ω/C,      rows of velocities c alone;      V = ½ Σ k r²
//
// of a pair as wrenches on its two bodies, of a coupling along its coordinates: together Q*λ. C is the compliance of rows, Q_i (ℳ + J)⁻¹ Q_i*, at the
// model's present state, prescribed coordinates held: the largest of a loop's rows in metres, and of those in radians, so that the row that is
// felt least by the masses swings at ω, and no direction of a loop is stiffer than another. Where no such row asks anything at that state it is
// that of a state off it; where none does there either it never does, and has no spring.
// Source: E. Bayo, J. García de Jalón, M. Serna, A modified Lagrangian formulation for the dynamic analysis of constrained mechanical systems,
// Computer Methods in Applied Mechanics and Engineering 71, 1988 (penalties with a frequency and a damping ratio).
#pragma once

#include "simulation/effect.h"

namespace pycraft {

class LoopPenalty : public Effect {
 public:
  // All loops without names. ModelError as of KeepLoops, and for a frequency (rad/s) that is not positive, a damping ratio below zero.
  LoopPenalty(std::shared_ptr<const LoopSet> set, const std::vector<std::string>& names, double frequency, double damping_ratio);
  std::string kind() const override { return "loop"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  struct Springs {
    std::vector<double> stiffness, damping;          // by row of `loops`
  };
  Springs springs(const HingeTerms& terms) const;
  const Multibody& model() const { return set_->model(); }

  struct End {
    int body;                                        // -1: the base
    Pose<double> pose;                               // of the end frame in the body
  };
  ResolvedLoops loops;
  std::vector<End> a, b;                             // of every loop; of couplings none that counts

 private:
  std::shared_ptr<const LoopSet> set_;
  std::shared_ptr<const ResolvedLoops> whole_;       // poses that paths point to
  std::vector<double> present_;                      // q
  double frequency_, damping_ratio_;
};

}  // namespace pycraft
