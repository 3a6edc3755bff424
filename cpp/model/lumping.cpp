#include "model/lumping.h"

#include "model/checks.h"

namespace pycraft {

namespace {

RigidInertia<long double> wide_inertia(const Body& b) {
  return rigid_inertia(static_cast<long double>(b.mass), cast<long double>(b.com), cast<long double>(b.inertia));
}

}  // namespace

Body lumped(Body body, const Pose<double>& X, const Body& welded) {
  const RigidInertia<long double> sum = wide_inertia(body) + to_parent(cast<long double>(X), wide_inertia(welded));
  Vector3<long double> com{0, 0, 0};
  if (sum.mass > 0) com = (1 / sum.mass) * sum.moment;
  Symmetric3<long double> about = sum.rotational;
  const Symmetric3<long double> point = point_inertia(com);
  for (int i = 0; i < 6; ++i) about.s[i] -= sum.mass * point.s[i];
  body.mass = static_cast<double>(sum.mass);
  body.com = cast<double>(com);
  body.inertia = cast<double>(about);
  check_mass_properties(body.name + "' with '" + welded.name, body.mass, body.com, body.inertia);
  return body;
}

}  // namespace pycraft
