// Explicit methods as steppers: Boost.Odeint's controlled Runge-Kutta pairs, its extrapolated midpoint rule and the classical method, and that of
// Munthe-Kaas.
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
