// What bounds a drive: an effort that it does not exceed, and a speed beyond which it does not push. Within `band` of that speed (a share of it)
// what drives further falls linearly to nothing; what brakes does not.
//
//   T = clip(T, ±effort) · clip((speed - |v|)/(band · speed), 0, 1)      the second factor where T v > 0
#pragma once

#include <cmath>
#include <string>
#include <vector>

namespace pycraft {

struct DriveLimits {
  std::vector<double> effort, speed;  // one for each coordinate, infinite: none
  double band = 0.05;
  bool any = true;                    // whether any of them is finite
  // ModelError that names the effect where one is not positive, or their number does not fit.
  void check(size_t count, const std::string& effect);

  template <class S>
  S bounded(size_t i, S force, const S& v) const {
    if (!any) return force;
    const S most(effort[i]), fastest(speed[i]);
    if (force > most) force = most;
    if (-most > force) force = -most;
    if (std::isinf(speed[i]) || !(force * v > S(0))) return force;
    const S left = (fastest - (v > S(0) ? v : S(-v))) / (S(band) * fastest);
    return left > S(1) ? force : left > S(0) ? S(left * force) : S(0);
  }
  // Why what is bounded has no derivatives at this force and speed, in words; null: it has them. Of a force that depends on the state; the second of
  // one that is given.
  template <class S>
  const char* edge(size_t i, const S& force, const S& v) const {
    const S most(effort[i]);
    if (any && std::isfinite(effort[i]) && (force == most || force == -most)) return "is just at its effort limit";
    return edge_of_speed(i, force, v);
  }
  template <class S>
  const char* edge_of_speed(size_t i, const S& force, const S& v) const {
    if (!any || std::isinf(speed[i])) return nullptr;
    const S fastest(speed[i]), fast = v > S(0) ? v : S(-v), from = (S(1) - S(band)) * fastest, driven = force * v;
    if (from > fast) return nullptr;
    if (driven == S(0)) return "is driven by nothing at a speed in the band below its limit";
    return driven > S(0) && (fast == from || fast == fastest) ? "is just at an end of the band below its speed limit" : nullptr;
  }
};

}  // namespace pycraft
