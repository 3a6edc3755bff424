#include "simulation/effects/gravity_compensation.h"

#include <algorithm>
#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundGravityCompensation : public BoundEffect<S> {
 public:
  explicit BoundGravityCompensation(const GravityCompensation& of) : g_(cast<S>(of.g)) {
    for (const HeldBody& b : of.bodies) bodies_.push_back({b.body, S(b.mass), cast<S>(b.point)});
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (const Held& b : bodies_) {
      const Vector3<S> f = transpose_times(at.pose[b.body].R, (-b.mass) * g_);
      out.wrench[b.body] = out.wrench[b.body] + Vector6<S>{cross(b.point, f), f};
    }
  }
  S potential(const At<S>& at) override {
    S sum = S(0);
    for (const Held& b : bodies_) sum += b.mass * dot(g_, at.pose[b.body].p + at.pose[b.body].R * b.point);
    return sum;
  }

 private:
  struct Held {
    int body;
    S mass;
    Vector3<S> point;
  };
  Vector3<S> g_;
  std::vector<Held> bodies_;
};

// In the order of the names, each body once.
std::vector<int> in_order(const Multibody& model, const Names& names) {
  if (!names) return bodies_named(model, names, "gravity_compensation");
  std::vector<int> found;
  for (const std::string& name : *names)
    for (const int k : bodies_named(model, std::vector<std::string>{name}, "gravity_compensation"))
      if (std::find(found.begin(), found.end(), k) == found.end()) found.push_back(k);
  return found;
}

}  // namespace

GravityCompensation::GravityCompensation(const Multibody& model, const Names& names, const std::vector<double>& given, const std::vector<double>& points, const Vector3<double>& field)
    : g(field) {
  const std::vector<int> chosen = in_order(model, names);
  const std::vector<double> share = for_each(given, chosen.size(), "gravity_compensation: share");
  if (!points.empty() && points.size() != 3 * chosen.size())
    throw ModelError("gravity_compensation: points has " + std::to_string(points.size()) + " numbers; it takes three for each of " + std::to_string(chosen.size()) + " bodies");
  for (const double x : points)
    if (!std::isfinite(x)) throw ModelError("gravity_compensation: points has an entry that is " + short_number(x));
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(g[i])) throw ModelError("gravity_compensation: g has an entry that is " + short_number(g[i]));
  for (size_t i = 0; i < chosen.size(); ++i) {
    const Body& b = model.body(chosen[i]);
    if (b.mass == 0 || share[i] == 0) continue;
    bodies.push_back({chosen[i], share[i] * b.mass, points.empty() ? b.com : Vector3<double>{points[3 * i], points[3 * i + 1], points[3 * i + 2]}});
  }
}

Declaration GravityCompensation::declaration() const {
  Declaration d;
  d.potential = true;
  for (const HeldBody& b : bodies) d.poses.push_back(b.body);
  d.wrenches = d.poses;
  return d;
}

PYCRAFT_BIND_EFFECT(GravityCompensation, BoundGravityCompensation)

}  // namespace pycraft
