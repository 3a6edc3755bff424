// Prescribed motion: a hinge, or subhinges of it, goes where a function of time says; the forces that this takes are found.
//
// The function has as many numbers as these coordinates have in q, and is known with its first two derivatives. Of one coordinate
// v = q̇ and v̇ = q̈. Of a ball with the quaternion Q of any length, and of a free subhinge with the position p besides,
//
//   ω = 2 (Q* Q̇)/|Q|²,   ω̇ = 2 (Q* Q̈)/|Q|² - 4 (Q·Q̇)(Q* Q̇)/|Q|⁴,     u = R* ṗ,   u̇ = R* p̈ - ω × u        (vector parts)
//
// Where v jumps, at a knot of the function, an impulse acts (CompiledScene::change_velocities). Positions that jump are an error.
#pragma once

#include "simulation/effect.h"
#include "simulation/function_of_time.h"
#include "simulation/selection.h"

namespace pycraft {

class PrescribedMotion : public Effect {
 public:
  PrescribedMotion(const Multibody& model, const Names& hinges, TimeFunction motion);
  std::string kind() const override { return "prescribed"; }
  Declaration declaration() const override;
  PYCRAFT_BINDS

  struct Part {
    SubhingeKind kind;
    int q, v;
  };
  std::vector<Part> parts;
  TimeFunction motion;

 private:
  std::vector<int> coordinates_;
};

}  // namespace pycraft
