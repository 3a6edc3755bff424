// Stiffness of a scene: what holds the steps of an explicit method, or makes steps of one size unstable, by names.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "simulation/compiled_scene.h"
#include "simulation/integrators/integrator.h"

namespace pycraft {

struct Stiffness {
  double t = 0, step = 0, rate = 0;  // s, s, 1/s; rate 0: by the method's own estimate alone
  double left = 0;                   // steps of this size to the end of the run
  std::string effect, coordinate;    // whose forces change most along it, and which coordinate does; empty: not known
  double longest = 0;                // s: of steps of one size, the longest that are stable there; 0: of others
};

// The fastest decay at x of the equations of a scene; a rate of 0 where it holds no steps of this size.
Stiffness stiffness_of(CompiledScene<double>& scene, double t, const std::vector<double>& x, double step);

// What steps of one size make larger at x that the motion does not: longest is 0 where there is nothing. Of no loops.
//
//   semi-implicit-euler   an oscillation from step to step, v⁺ = -v, q⁺ = -q of a displacement x: linearized, with ∂g/∂u and ∂g/∂v of all forces but
//                         implicit ones, x grows where  x*(h² ∂g/∂u + 2h ∂g/∂v) x < -x*(4 (ℳ + J) + 2h C + h² K) x,  as h²k/m > 4 and h c/m > 2
//   rk4, rkmk4            the eigenvalue λ of largest size (decay.h) where |1 + z + z²/2 + z³/6 + z⁴/24| > 1 at z = hλ, and Re λ is no growth
//
// Cost: O(n³) once, and O(n²) a power.
// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Springer 1996, IV.2.
Stiffness growth_of_steps(CompiledScene<double>& scene, Integrator integrator, double t, const std::vector<double>& x, double step);

// So many steps to the end of a run are worth a word.
inline constexpr double many_steps = 1e4;

// What is stiff where steps of this size seem to be held by stability, in a run to `last`: by the derivatives of the scene where they are those of its
// motion, in double precision and on no loops, else by the method's own estimate alone. Nothing where they are not held, or few. Of steps of one
// size: what these make larger, where the derivatives tell.
template <class S>
std::optional<Stiffness> stiffness_at(CompiledScene<S>& scene, Integrator integrator, const S& t, const std::vector<S>& x, const S& step, const S& last) {
  const double left = std::abs(to_double(S((last - t) / step)));
  const bool controlled = record_of(integrator).controlled;
  if (controlled && !(left >= many_steps)) return std::nullopt;
  Stiffness found{to_double(t), std::abs(to_double(step)), 0, left, "", "", 0};
  if constexpr (std::is_same_v<S, double>)
    if (!scene.loops()) {
      found = controlled ? stiffness_of(scene, t, x, step) : growth_of_steps(scene, integrator, t, x, step);
      found.step = std::abs(found.step), found.left = left;
      if (found.rate == 0 && found.longest == 0) return std::nullopt;
      return found;
    }
  return controlled ? std::optional(found) : std::nullopt;
}

}  // namespace pycraft
