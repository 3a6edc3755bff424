// Explicit methods as steppers: Dormand and Prince's of order 5, that of order 8 (dormand_prince_8.h) and the classical one by their tableaus (stages.h),
// Cash and Karp's pair and the extrapolated midpoint rule of Boost.Odeint, and that of Munthe-Kaas.
#pragma once

#include <memory>

#include "simulation/integrators/stepper.h"

namespace pycraft {

// EvaluationError for an integrator that is none of them.
template <class S>
std::unique_ptr<Stepper<S>> runge_kutta_steps(ExplicitEquations<S>& equations, const IntegratorOptions& options);

// dopri5, of any equations.
std::unique_ptr<ControlledSteps<double>> dormand_prince_steps(Equations<double>& equations, const IntegratorOptions& options);

#define PYCRAFT_RUNGE_KUTTA(S) std::unique_ptr<Stepper<S>> runge_kutta_steps(ExplicitEquations<S>&, const IntegratorOptions&);
extern template PYCRAFT_RUNGE_KUTTA(double)
extern template PYCRAFT_RUNGE_KUTTA(Extended)
extern template PYCRAFT_RUNGE_KUTTA(Quad)

}  // namespace pycraft
