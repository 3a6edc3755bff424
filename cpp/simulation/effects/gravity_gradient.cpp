#include "simulation/effects/gravity_gradient.h"

#include "simulation/effects/point_mass_gravity.h"

namespace pycraft {

namespace {

template <class S>
class BoundGravityGradient : public BoundEffect<S> {
 public:
  explicit BoundGravityGradient(const GravityGradient& of) : mu_(of.mu), position_(cast<S>(of.position)) {
    for (const BodyInField& b : of.bodies) bodies_.push_back({b.body, cast<S>(b.com), cast<S>(b.inertia), S(b.inertia.s[0] + b.inertia.s[3] + b.inertia.s[5])});
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (const Attracted& b : bodies_) {
      const auto [length, along] = seen(at, b);
      const Vector3<S> turned = b.inertia * along;
      const S cube = length * length * length, of_axis = dot(along, turned);
      const Vector3<S> f = (S(1.5) * mu_ / (cube * length)) * ((S(5) * of_axis - b.trace) * along - S(2) * turned);
      const Vector3<S> n = (S(3) * mu_ / cube) * cross(along, turned);
      out.wrench[b.body] = out.wrench[b.body] + Vector6<S>{n + cross(b.com, f), f};
    }
  }
  S potential(const At<S>& at) override {
    S sum = S(0);
    for (const Attracted& b : bodies_) {
      const auto [length, along] = seen(at, b);
      sum -= mu_ / (S(2) * length * length * length) * (b.trace - S(3) * dot(along, b.inertia * along));
    }
    return sum;
  }

 private:
  struct Attracted {
    int body;
    Vector3<S> com;
    Symmetric3<S> inertia;
    S trace;
  };
  struct Seen {
    S length;
    Vector3<S> along;
  };
  Seen seen(const At<S>& at, const Attracted& b) const {
    const Vector3<S> r = seen_from(position_, at.pose[b.body], b.com);
    const S length = norm(r);
    return {length, (S(1) / length) * r};
  }
  S mu_;
  Vector3<S> position_;
  std::vector<Attracted> bodies_;
};

}  // namespace

GravityGradient::GravityGradient(const Multibody& model, double gravitational, const Vector3<double>& at, const Names& names)
    : mu(gravitational), position(at), bodies(bodies_in_field(model, names, "gravity_gradient")) {
  check_point_mass(mu, position, "gravity_gradient");
}

Declaration GravityGradient::declaration() const {
  Declaration d;
  d.potential = true;
  for (const BodyInField& b : bodies) d.poses.push_back(b.body);
  d.wrenches = d.poses;
  return d;
}

PYCRAFT_BIND_EFFECT(GravityGradient, BoundGravityGradient)

}  // namespace pycraft
