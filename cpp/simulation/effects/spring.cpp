#include "simulation/effects/spring.h"

#include <algorithm>

#include "model/checks.h"
#include "runtime/errors.h"
#include "simulation/effects/rotation_vector.h"

namespace pycraft {

namespace {

template <class S>
class BoundSpring : public BoundEffect<S> {
 public:
  explicit BoundSpring(const Spring& of) : springs_(of.springs) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (const HingeSpring& s : springs_) {
      const S k(s.stiffness);
      if (!s.ball) {
        out.generalized[s.v] -= k * (at.q[s.q] - S(s.rest[0]));
        continue;
      }
      const Vector3<S> theta = turned(s, at.q);
      for (int i = 0; i < 3; ++i) out.generalized[s.v + i] -= k * theta[i];
    }
  }
  S potential(const At<S>& at) override {
    S sum = S(0);
    for (const HingeSpring& s : springs_) {
      const S off = s.ball ? S(0) : S(at.q[s.q] - S(s.rest[0]));
      const Vector3<S> theta = s.ball ? turned(s, at.q) : Vector3<S>{off, S(0), S(0)};
      sum += S(s.stiffness) * dot(theta, theta) / S(2);
    }
    return sum;
  }

  std::optional<Edge> edge(const At<S>& at) override {
    for (const HingeSpring& s : springs_)
      if (s.ball && s.stiffness != 0 && from_rest(s, at.q).w == S(0)) return Edge{"is turned by half a turn from its rest", s.v};
    return {};
  }

 private:
  static Quaternion<S> from_rest(const HingeSpring& s, const S* q) {
    const Quaternion<S> rest{S(s.rest[0]), S(s.rest[1]), S(s.rest[2]), S(s.rest[3])}, now{q[s.q], q[s.q + 1], q[s.q + 2], q[s.q + 3]};
    return conjugate(rest) * now;
  }
  static Vector3<S> turned(const HingeSpring& s, const S* q) { return rotation_vector(from_rest(s, q)); }
  std::vector<HingeSpring> springs_;
};

}  // namespace

std::vector<int> sprung_coordinates(const Multibody& model, const Names& hinges, const std::string& effect) {
  std::vector<int> found = coordinates_named(model, hinges, effect);
  if (!hinges) std::erase_if(found, [&](int j) { return subhinge_of_coordinate(model, j).kind == SubhingeKind::free; });
  return found;
}

std::vector<HingeSpring> hinge_springs(const Multibody& model, const std::vector<int>& coordinates, const std::vector<double>& stiffness, const std::vector<double>& rest,
                                       const std::string& effect) {
  const std::vector<double> k = for_each(stiffness, coordinates.size(), effect + ": stiffness");
  const std::vector<std::string> names = model.structure().coordinate_names;
  std::vector<HingeSpring> springs;
  size_t numbers = 0;
  for (size_t i = 0; i < coordinates.size(); ++i) {
    const SubhingePlace at = subhinge_of_coordinate(model, coordinates[i]);
    const std::string where = effect + ": coordinate '" + names[coordinates[i]] + "'";
    if (at.kind == SubhingeKind::free) throw ModelError(where + " is one of a free subhinge, which no spring of a hinge acts on; use a bushing between nodes");
    const bool ball = at.kind == SubhingeKind::ball;
    if (ball && (at.v != coordinates[i] || i + 2 >= coordinates.size() || coordinates[i + 2] != at.v + 2))
      throw ModelError(where + " is one of three of a ball, which a spring takes together: name the hinge");
    if (ball && !(k[i] == k[i + 1] && k[i] == k[i + 2])) throw ModelError(where + " is one of a ball, whose spring has one stiffness");
    springs.push_back({at.q, at.v, ball, k[i], {ball ? 1.0 : 0.0, 0, 0, 0}});
    numbers += ball ? 4 : 1;
    if (ball) i += 2;
  }
  const bool at_zero = rest.size() == 1 && rest[0] == 0;
  if (at_zero) return springs;
  const std::vector<double> all = for_each(rest, numbers, effect + ": rest");
  size_t from = 0;
  for (HingeSpring& s : springs) {
    std::copy_n(all.begin() + static_cast<std::ptrdiff_t>(from), s.ball ? 4 : 1, s.rest);
    if (s.ball && !(s.rest[0] * s.rest[0] + s.rest[1] * s.rest[1] + s.rest[2] * s.rest[2] + s.rest[3] * s.rest[3] > 1e-12))
      throw ModelError(effect + ": rest has a quaternion of no length");
    from += s.ball ? 4 : 1;
  }
  return springs;
}

Spring::Spring(const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& rest)
    : springs(hinge_springs(model, sprung_coordinates(model, hinges, "spring"), stiffness, rest, "spring")) {}

Declaration Spring::declaration() const {
  Declaration d;
  d.potential = true;
  for (const HingeSpring& s : springs)
    for (int i = 0; i < (s.ball ? 3 : 1); ++i) d.coordinates.push_back(s.v + i);
  return d;
}

PYCRAFT_BIND_EFFECT(Spring, BoundSpring)

}  // namespace pycraft
