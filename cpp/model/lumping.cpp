#include "model/lumping.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/checks.h"

namespace pycraft {

namespace {

RigidInertia<long double> wide_inertia(const Body& b) {
  return rigid_inertia(static_cast<long double>(b.mass), cast<long double>(b.com), cast<long double>(b.inertia));
}

// The body with these numbers; `what`: how errors call it.
Body with_inertia(Body body, const RigidInertia<long double>& M, const std::string& what) {
  Vector3<long double> com{0, 0, 0};
  if (M.mass > 0) com = (1 / M.mass) * M.moment;
  Symmetric3<long double> about = M.rotational;
  const Symmetric3<long double> point = point_inertia(com);
  for (int i = 0; i < 6; ++i) about.s[i] -= M.mass * point.s[i];
  body.mass = static_cast<double>(M.mass);
  body.com = cast<double>(com);
  body.inertia = cast<double>(about);
  check_mass_properties(what, body.mass, body.com, body.inertia);
  return body;
}

}  // namespace

Body lumped(Body body, const Pose<double>& X, const Body& welded) {
  const std::string what = body.name + "' with '" + welded.name;
  const RigidInertia<long double> sum = wide_inertia(body) + to_parent(cast<long double>(X), wide_inertia(welded));
  return with_inertia(std::move(body), sum, what);
}

Body parted(Body body, const Pose<double>& X, const Body& welded) {
  const std::string what = body.name + "' without '" + welded.name;
  const RigidInertia<long double> all = wide_inertia(body), part = to_parent(cast<long double>(X), wide_inertia(welded));
  RigidInertia<long double> left{all.mass - part.mass, all.moment - part.moment, all.rotational};
  for (int i = 0; i < 6; ++i) left.rotational.s[i] -= part.rotational.s[i];
  // The whole is rounded to doubles: what is left of all of it may be that rounding alone.
  const auto rounding = [](long double x, long double of) { return std::abs(x) <= 16 * std::numeric_limits<double>::epsilon() * of; };
  if (rounding(left.mass, all.mass)) left.mass = 0, left.moment = {0, 0, 0};
  const long double trace = all.rotational(0, 0) + all.rotational(1, 1) + all.rotational(2, 2);
  if (std::all_of(left.rotational.s, left.rotational.s + 6, [&](long double x) { return rounding(x, trace); }))
    left.rotational = Symmetric3<long double>::zero();
  return with_inertia(std::move(body), left, what);
}

}  // namespace pycraft
