// The integrators there are, and what they are told.
//
// dopri5               Runge-Kutta 5(4) of Dormand and Prince    steps controlled by rtol and atol
// cash-karp54          Runge-Kutta 5(4) of Cash and Karp         the same
// fehlberg78           Runge-Kutta 8(7) of Fehlberg              the same
// bulirsch-stoer       extrapolated midpoint rule, any order     the same
// rk4                  the classical Runge-Kutta of order 4      fixed steps
// rkmk4                Runge-Kutta-Munthe-Kaas of order 4        fixed steps; quaternions keep their length by construction
// semi-implicit-euler  v⁺ = v + h v̇, q⁺ = q exp(h v⁺), order 1   fixed steps; implicit damping and stiffness are in v̇, for steps of any size
//
// A controlled step is taken where each component's error estimate e(i) is at most atol + rtol (|x(i)| + h |ẋ(i)|).
// Sources: Boost.Odeint; H. Munthe-Kaas, High order Runge-Kutta methods on manifolds, Applied Numerical Mathematics 29, 1999.
#pragma once

#include <string>
#include <vector>

namespace pycraft {

enum class Integrator { dopri5, cash_karp54, fehlberg78, bulirsch_stoer, rk4, rkmk4, semi_implicit_euler };
// Of trajectories, and of scenes: those, and what takes steps by effects that act implicitly.
inline constexpr Integrator integrators[] = {Integrator::dopri5,         Integrator::cash_karp54, Integrator::fehlberg78,
                                             Integrator::bulirsch_stoer, Integrator::rk4,         Integrator::rkmk4};
inline constexpr Integrator scene_integrators[] = {Integrator::dopri5, Integrator::cash_karp54, Integrator::fehlberg78,         Integrator::bulirsch_stoer,
                                                   Integrator::rk4,    Integrator::rkmk4,       Integrator::semi_implicit_euler};
const char* integrator_name(Integrator integrator);
// Throws EvaluationError that lists the names there are in scenes.
Integrator integrator_from_name(const std::string& name);
bool fixed_step(Integrator integrator);

struct IntegratorOptions {
  Integrator integrator = Integrator::dopri5;
  double rtol = 1e-9, atol = 1e-12;
  double step = 0;          // s: of fixed steps, or the first of controlled ones; 0: chosen from the first derivative
  bool normalise = false;   // quaternions to unit length after each step
  bool every_step = false;  // whether the end of every step is given out, not the times alone
};

struct IntegrationCost {
  long evaluations = 0, steps = 0, rejected = 0;
};

// EvaluationError for times out of order, steps and tolerances that make no sense; eps: of the scalar.
void check_integration(const std::vector<double>& times, const IntegratorOptions& options, double eps);

}  // namespace pycraft
