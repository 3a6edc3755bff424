// A way of finding a scene's accelerations, paired with a method that steps by it. Each method says by a type what it takes,
//
//   ExplicitEquations      dopri5, cash-karp54, dop853, bulirsch-stoer, rk4, rkmk4      scene_equations.h
//   ImplicitEquations      semi-implicit-euler                                              scene_steps.h
//   LinearizedEquations    rosenbrock4 and auto, in double precision                        scene_linearized.h
//   VariationalEquations   variational2, variational4                                       scene_momenta.h
//
// so that no other pair compiles. What a scene's effects make of it is known when it runs: effects that act in implicit steps fit integrators that
// take such steps or solve by derivatives, prescribed motion fits all but variational ones, loops those that need accelerations alone. Else an EvaluationError names integrator and effect.
#pragma once

#include <concepts>
#include <memory>

#include "numerics/arithmetic.h"
#include "simulation/compiled_scene.h"
#include "simulation/integrators/stepper.h"

namespace pycraft {

template <class Way, class Method>
concept PairsWith = std::derived_from<Way, typename Method::Needs>;

// What runs: equations and what steps by them.
template <class S>
struct Paired {
  std::unique_ptr<Equations<S>> equations;
  std::unique_ptr<Stepper<S>> stepper;
};

// EvaluationError where integrator, effects and precision do not fit each other.
void check_pairing(const Scene& scene, Precision precision, Integrator integrator);
// The same of an integrator from outside of the core, which keeps states in double precision; implicit: whether it solves for its steps.
void check_foreign_pairing(const Scene& scene, Precision precision, const std::string& name, bool implicit);

// works: whether the works of effects are counted. S as the scene was compiled.
template <class S>
Paired<S> paired(CompiledScene<S>& scene, bool works, const IntegratorOptions& options);

#define PYCRAFT_PAIRED(S) Paired<S> paired(CompiledScene<S>&, bool, const IntegratorOptions&);
extern template PYCRAFT_PAIRED(double)
extern template PYCRAFT_PAIRED(Extended)
extern template PYCRAFT_PAIRED(Quad)

}  // namespace pycraft
