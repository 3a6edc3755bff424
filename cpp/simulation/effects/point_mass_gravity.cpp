#include "simulation/effects/point_mass_gravity.h"

#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundPointMassGravity : public BoundEffect<S> {
 public:
  explicit BoundPointMassGravity(const PointMassGravity& of) : mu_(of.mu), position_(cast<S>(of.position)) {
    for (const BodyInField& b : of.bodies) bodies_.push_back({b.body, S(b.mass), cast<S>(b.com)});
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (const Attracted& b : bodies_) {
      const Vector3<S> r = seen_from(position_, at.pose[b.body], b.com);
      const S square = dot(r, r);
      const Vector3<S> f = (-(mu_ * b.mass) / (square * sqrt_of(square))) * r;
      out.wrench[b.body] = out.wrench[b.body] + Vector6<S>{cross(b.com, f), f};
    }
  }
  S potential(const At<S>& at) override {
    S sum = S(0);
    for (const Attracted& b : bodies_) {
      const Vector3<S> r = seen_from(position_, at.pose[b.body], b.com);
      sum -= mu_ * b.mass / sqrt_of(S(dot(r, r)));
    }
    return sum;
  }

 private:
  static S sqrt_of(const S& x) {
    using std::sqrt;
    return sqrt(x);
  }
  struct Attracted {
    int body;
    S mass;
    Vector3<S> com;
  };
  S mu_;
  Vector3<S> position_;
  std::vector<Attracted> bodies_;
};

}  // namespace

std::vector<BodyInField> bodies_in_field(const Multibody& model, const Names& names, const std::string& effect) {
  std::vector<BodyInField> found;
  for (const int k : bodies_named(model, names, effect))
    if (const Body& b = model.body(k); b.mass != 0) found.push_back({k, b.mass, b.com, b.inertia});
  return found;
}

void check_point_mass(double mu, const Vector3<double>& position, const std::string& effect) {
  if (!std::isfinite(mu)) throw ModelError(effect + ": mu is " + short_number(mu));
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(position[i])) throw ModelError(effect + ": position has an entry that is " + short_number(position[i]));
}

PointMassGravity::PointMassGravity(const Multibody& model, double gravitational, const Vector3<double>& at, const Names& names)
    : mu(gravitational), position(at), bodies(bodies_in_field(model, names, "point_mass_gravity")) {
  check_point_mass(mu, position, "point_mass_gravity");
}

Declaration PointMassGravity::declaration() const {
  Declaration d;
  d.potential = true;
  for (const BodyInField& b : bodies) d.poses.push_back(b.body);
  d.wrenches = d.poses;
  return d;
}

PYCRAFT_BIND_EFFECT(PointMassGravity, BoundPointMassGravity)

}  // namespace pycraft
