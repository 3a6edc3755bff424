// Trajectories of a model: q̇ = N(q) v (model/configuration.h), v̇ from a callable, under constant generalized forces and viscous
// damping, T = tau - d ∘ v. Steppers of Boost.Odeint on (q, v) as numbers, and one on the model's group:
//
// dopri5          Runge-Kutta 5(4) of Dormand and Prince    steps controlled by rtol and atol
// cash-karp54     Runge-Kutta 5(4) of Cash and Karp         the same
// fehlberg78      Runge-Kutta 8(7) of Fehlberg              the same
// bulirsch-stoer  extrapolated midpoint rule, any order     the same
// rk4             the classical Runge-Kutta of order 4      fixed steps
// rkmk4           Runge-Kutta-Munthe-Kaas of order 4        fixed steps; quaternions keep their length by construction
//
// Output times are hit by a step's end, not interpolated. A controlled step is taken where each component's error estimate e(i) is at most
// atol + rtol (|x(i)| + h |ẋ(i)|).
// Sources: Boost.Odeint; H. Munthe-Kaas, High order Runge-Kutta methods on manifolds, Applied Numerical Mathematics 29, 1999.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "model/compiled_model.h"
#include "numerics/scalar.h"

namespace pycraft {

enum class Integrator { dopri5, cash_karp54, fehlberg78, bulirsch_stoer, rk4, rkmk4 };
inline constexpr Integrator integrators[] = {Integrator::dopri5,         Integrator::cash_karp54, Integrator::fehlberg78,
                                             Integrator::bulirsch_stoer, Integrator::rk4,         Integrator::rkmk4};
const char* integrator_name(Integrator integrator);
// Throws EvaluationError that lists the names there are.
Integrator integrator_from_name(const std::string& name);
bool fixed_step(Integrator integrator);

// v̇ from q, v and the generalized forces.
template <class S>
using Accelerations = std::function<void(const S* q, const S* v, const S* tau, S* vdot)>;

struct TrajectoryOptions {
  Integrator integrator = Integrator::dopri5;
  double rtol = 1e-9, atol = 1e-12;
  double step = 0;          // s: of fixed steps, or the first of controlled ones; 0: chosen from the first derivative
  bool normalise = false;   // quaternions to unit length after each step
};

struct TrajectoryCost {
  long evaluations = 0, steps = 0, rejected = 0;
};

// From q (nq), v (nv) at times[0] to the other times, strictly increasing or strictly decreasing. tau (nv); damping (nv) or null.
// out(i, q, v) is called at every time in order. Throws EvaluationError that names the time where the state stops being finite or the step
// size falls to rounding; errors of the accelerations come through with the time added. Asks for Ctrl-C every 256 evaluations.
template <class S>
TrajectoryCost integrate_trajectory(const CompiledModel<S>& model, const Accelerations<S>& accelerations, const S* q, const S* v,
                                    const std::vector<double>& times, const S* tau, const S* damping, const TrajectoryOptions& options,
                                    const std::function<void(int, const S*, const S*)>& out);

#define PYCRAFT_TRAJECTORY(S)                                                                                                                    \
  TrajectoryCost integrate_trajectory(const CompiledModel<S>&, const Accelerations<S>&, const S*, const S*, const std::vector<double>&, const S*, \
                                      const S*, const TrajectoryOptions&, const std::function<void(int, const S*, const S*)>&);
extern template PYCRAFT_TRAJECTORY(double)
extern template PYCRAFT_TRAJECTORY(Extended)
extern template PYCRAFT_TRAJECTORY(Quad)

}  // namespace pycraft
