// Explicit methods as steppers: Dormand and Prince's and the classical one by their tableaus (stages.h), other controlled Runge-Kutta pairs and the
// extrapolated midpoint rule of Boost.Odeint, and that of Munthe-Kaas.
#pragma once

#include <memory>

#include "simulation/integrators/stepper.h"

namespace pycraft {

// EvaluationError for an integrator that is none of them.
template <class S>
std::unique_ptr<Stepper<S>> runge_kutta_steps(ExplicitEquations<S>& equations, const IntegratorOptions& options);

#define PYCRAFT_RUNGE_KUTTA(S) std::unique_ptr<Stepper<S>> runge_kutta_steps(ExplicitEquations<S>&, const IntegratorOptions&);
extern template PYCRAFT_RUNGE_KUTTA(double)
extern template PYCRAFT_RUNGE_KUTTA(Extended)
extern template PYCRAFT_RUNGE_KUTTA(Quad)

}  // namespace pycraft
