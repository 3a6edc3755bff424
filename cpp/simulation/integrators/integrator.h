// The integrators there are, and what they are told.
//
// name                 method                                                     order  steps       on the group
// auto                 dopri5, and rosenbrock4 where the motion is stiff (switching_steps.h)  4  controlled
// dopri5               Runge-Kutta 5(4) of Dormand and Prince                     5      controlled
// cash-karp54          Runge-Kutta 5(4) of Cash and Karp                          5      controlled
// dop853               Runge-Kutta 8(5,3) of Dormand and Prince                   8      controlled
// bulirsch-stoer       extrapolated midpoint rule                                 any    controlled
// rosenbrock4          RODAS, L-stable, with exact derivatives (rosenbrock.h)     4      controlled  yes
// rk4                  the classical Runge-Kutta                                  4      fixed
// rkmk4                Runge-Kutta-Munthe-Kaas (steps_on_the_group.h)             4      fixed       yes
// semi-implicit-euler  v⁺ = v + h v̇, q⁺ = q exp(h v⁺), implicit terms in v̇        1      fixed       yes
// variational2         discrete Euler-Lagrange at midpoints (variational.h)       2      fixed       yes
// variational4         five of its steps composed (Suzuki)                        4      fixed       yes
//
// A controlled step is taken where each component's error estimate e(i) is at most atol + rtol (|x(i)| + h |ẋ(i)|). No estimate is blind to a right-hand
// side that is a function of time alone, as that of Fehlberg's pair of order 7(8) is, 41/840 h (k₁ + k₁₁ - k₁₂ - k₁₃) at the nodes 0, 1, 0, 1.
// Those on the group keep the lengths of quaternions. Sources: Boost.Odeint, and those that the headers name.
#pragma once

#include <string>
#include <vector>

namespace pycraft {

enum class Integrator { dopri5, automatic, cash_karp54, dop853, bulirsch_stoer, rosenbrock4, rk4, rkmk4, semi_implicit_euler, variational2, variational4 };

// How accelerations are found for it (simulation/equations.h).
enum class Way { at_states, of_steps, with_derivatives, by_momenta };

struct IntegratorRecord {
  const char* name;
  int order;             // 0: it varies
  Way way;
  bool controlled;       // its steps are, else they are of one size
  bool on_group;
  bool samples_between;  // times asked for are found between the ends of steps; else steps end there, as what is between has not its order
};
inline constexpr IntegratorRecord integrator_records[] = {
    {"dopri5", 5, Way::at_states, true, false, true},
    {"auto", 4, Way::at_states, true, false, true},
    {"cash-karp54", 5, Way::at_states, true, false, true},
    {"dop853", 8, Way::at_states, true, false, true},
    {"bulirsch-stoer", 0, Way::at_states, true, false, false},
    {"rosenbrock4", 4, Way::with_derivatives, true, true, true},
    {"rk4", 4, Way::at_states, false, false, true},
    {"rkmk4", 4, Way::at_states, false, true, true},
    {"semi-implicit-euler", 1, Way::of_steps, false, true, true},
    {"variational2", 2, Way::by_momenta, false, true, true},
    {"variational4", 4, Way::by_momenta, false, true, true},
};
inline constexpr const IntegratorRecord& record_of(Integrator integrator) { return integrator_records[static_cast<int>(integrator)]; }
inline const char* integrator_name(Integrator integrator) { return record_of(integrator).name; }
std::vector<Integrator> integrators_by(Way way);
// What to take in place of an integrator that there was once, in words; empty: there was none of that name.
std::string retired_integrator(const std::string& name);
// Throws EvaluationError that lists the names there are, or says what to take.
Integrator integrator_from_name(const std::string& name);

struct IntegratorOptions {
  Integrator integrator = Integrator::dopri5;
  double rtol = 1e-9, atol = 1e-12;
  double step = 0;          // s: of fixed steps, or the first of controlled ones; 0: chosen from the first derivative
  bool normalise = false;   // quaternions to unit length after each step
  double longest = 0;       // s: no controlled step is longer; 0: any
};

struct IntegrationCost {
  long evaluations = 0, steps = 0, rejected = 0;
};

// EvaluationError: "integrator 'name': what".
[[noreturn]] void refuse(Integrator integrator, const std::string& what);
// EvaluationError for times out of order, steps and tolerances that make no sense; eps: of the scalar.
void check_integration(const std::vector<double>& times, const IntegratorOptions& options, double eps);

}  // namespace pycraft
