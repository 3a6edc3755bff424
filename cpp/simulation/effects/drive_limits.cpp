#include "simulation/effects/drive_limits.h"

#include <algorithm>
#include <limits>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

void check_bounds(std::vector<double>& bounds, size_t count, const std::string& what) {
  if (bounds.empty()) bounds.assign(1, std::numeric_limits<double>::infinity());
  if (bounds.size() == 1) bounds.assign(count, bounds[0]);
  if (bounds.size() != count) throw ModelError(what + " takes one number, or one for each of its " + std::to_string(count) + " coordinates, not " + std::to_string(bounds.size()));
  for (double x : bounds)
    if (!(x > 0)) throw ModelError(what + " is " + short_number(x) + "; a limit is positive, inf for none");
}

bool finite(double x) { return std::isfinite(x); }

}  // namespace

void DriveLimits::check(size_t count, const std::string& effect) {
  check_bounds(effort, count, effect + ": effort_limit");
  check_bounds(speed, count, effect + ": speed_limit");
  any = std::any_of(effort.begin(), effort.end(), finite) || std::any_of(speed.begin(), speed.end(), finite);
  if (!(band > 0 && band <= 1)) throw ModelError(effect + ": speed_band is " + short_number(band) + "; it is a share of the speed limit, above 0 and at most 1");
}

}  // namespace pycraft
