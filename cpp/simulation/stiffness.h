// Stiffness of a scene: what holds the steps of an explicit method, by names.
#pragma once

#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "simulation/compiled_scene.h"

namespace pycraft {

struct Stiffness {
  double t = 0, step = 0, rate = 0;  // s, s, 1/s; rate 0: by the method's own estimate alone
  double left = 0;                   // steps of this size to the end of the run
  std::string effect, coordinate;    // whose forces change most along it, and which coordinate does; empty: not known
};

// The fastest decay at x of the equations of a scene; a rate of 0 where it holds no steps of this size.
Stiffness stiffness_of(CompiledScene<double>& scene, double t, const std::vector<double>& x, double step);

// So many steps to the end of a run are worth a word.
inline constexpr double many_steps = 1e4;

// What is stiff where steps of this size seem to be held by stability, in a run to `last`: by the derivatives of the scene where they are those of its
// motion, in double precision and on no loops, else by the method's own estimate alone. Nothing where they are not held, or few.
template <class S>
std::optional<Stiffness> stiffness_at(CompiledScene<S>& scene, const S& t, const std::vector<S>& x, const S& step, const S& last) {
  const double left = std::abs(to_double(S((last - t) / step)));
  if (!(left >= many_steps)) return std::nullopt;
  Stiffness found{to_double(t), std::abs(to_double(step)), 0, left, "", ""};
  if constexpr (std::is_same_v<S, double>)
    if (!scene.loops()) {
      found = stiffness_of(scene, t, x, step);
      found.step = std::abs(found.step), found.left = left;
      if (found.rate == 0) return std::nullopt;
    }
  return found;
}

}  // namespace pycraft
