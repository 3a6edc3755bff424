#include "simulation/effects/limits.h"

#include <cmath>
#include <limits>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundLimits : public BoundEffect<S> {
 public:
  explicit BoundLimits(const Limits& of) {
    for (size_t i = 0; i < of.coordinates.size(); ++i) {
      const auto [q, v] = of.coordinates[i];
      if (std::isfinite(of.lower[i])) stops_.push_back({q, v, S(1), S(of.lower[i]), S(of.stiffness[i]), S(of.dissipation[i])});
      if (std::isfinite(of.upper[i])) stops_.push_back({q, v, S(-1), S(of.upper[i]), S(of.stiffness[i]), S(of.dissipation[i])});
    }
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (const Stop& s : stops_) {
      const S d = beyond(at, s);
      if (d > S(0)) out.generalized[s.v] += s.inward * s.k * d * pushed(at, s);
    }
  }
  S potential(const At<S>& at) override {
    S sum = S(0);
    for (const Stop& s : stops_) {
      const S d = beyond(at, s);
      if (d > S(0)) sum += s.k * d * d / S(2);
    }
    return sum;
  }
  S power(const At<S>& at, const S&) override {
    S sum = S(0);
    for (const Stop& s : stops_) {
      const S d = beyond(at, s);
      if (d > S(0)) sum += s.inward * s.k * d * (pushed(at, s) - S(1)) * at.v[s.v];
    }
    return sum;
  }
  // How far it is to each of them.
  void events(const At<S>& at, S* out) override {
    for (const Stop& s : stops_) *out++ = -beyond(at, s);
  }
  void event_rates(const At<S>& at, S* out) override {
    for (const Stop& s : stops_) *out++ = s.inward * at.v[s.v];
  }
  std::optional<Edge> edge(const At<S>& at) override {
    for (const Stop& s : stops_) {
      const S d = beyond(at, s);
      if (s.k == S(0) || S(0) > d) continue;
      if (d == S(0)) return Edge{"is just at its stop", s.v};
      if (S(1) == s.a * s.inward * at.v[s.v]) return Edge{"leaves its stop just as fast as that lets go", s.v};
    }
    return {};
  }

 private:
  struct Stop {
    int q, v;
    S inward, at, k, a;  // inward: the sign of the force
  };
  static S beyond(const At<S>& at, const Stop& s) { return s.inward * (s.at - at.q[s.q]); }
  static S pushed(const At<S>& at, const Stop& s) {
    const S factor = S(1) - s.a * s.inward * at.v[s.v];
    return factor > S(0) ? factor : S(0);
  }
  std::vector<Stop> stops_;
};

// Limits of the model at a coordinate; infinite where it has none.
std::pair<double, double> limits_of(const Multibody& model, int coordinate) {
  const SubhingePlace at = subhinge_of_coordinate(model, coordinate);
  const Hinge& hinge = model.body(at.body).hinge;
  if (hinge.lower.empty()) return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  return {hinge.lower[at.subhinge], hinge.upper[at.subhinge]};
}

void take_bounds(const std::vector<double>& given, size_t count, const char* what, std::vector<double>& out) {
  if (given.empty()) return;
  if (given.size() != 1 && given.size() != count)
    throw ModelError(std::string("limits: ") + what + " takes one number, or one for each of its " + std::to_string(count) + " coordinates, not " + std::to_string(given.size()));
  for (size_t i = 0; i < count; ++i) {
    out[i] = given[given.size() == 1 ? 0 : i];
    if (std::isnan(out[i])) throw ModelError(std::string("limits: ") + what + " has an entry that is nan");
  }
}

}  // namespace

Limits::Limits(const Multibody& model, const Names& hinges, const std::vector<double>& k, const std::vector<double>& a, const std::vector<double>& low, const std::vector<double>& high) {
  const std::vector<std::string> names = model.structure().coordinate_names;
  const bool own = low.empty() && high.empty();
  for (const SingleCoordinate& c : single_coordinates(model, hinges, "limits")) {
    const auto [from, to] = limits_of(model, c.v);
    if (own && !std::isfinite(from) && !std::isfinite(to)) {
      if (!hinges) continue;
      throw ModelError("limits: coordinate '" + names[c.v] + "' of '" + model.name() + "' has none; give lower= and upper=, or set the limits of its hinge");
    }
    coordinates.push_back(c), lower.push_back(from), upper.push_back(to);
  }
  const size_t n = coordinates.size();
  take_bounds(low, n, "lower", lower), take_bounds(high, n, "upper", upper);
  for (size_t i = 0; i < n; ++i)
    if (lower[i] > upper[i])
      throw ModelError("limits: of coordinate '" + names[coordinates[i].v] + "' the lower one, " + short_number(lower[i]) + ", lies above the upper one, " + short_number(upper[i]));
  stiffness = not_negative(k, n, "limits: stiffness"), dissipation = not_negative(a, n, "limits: dissipation");
}

Declaration Limits::declaration() const {
  Declaration d;
  d.potential = d.velocities = d.work = true;
  for (const auto& [q, v] : coordinates) d.coordinates.push_back(v);
  for (size_t i = 0; i < coordinates.size(); ++i) d.events += std::isfinite(lower[i]) + std::isfinite(upper[i]);
  return d;
}

PYCRAFT_BIND_EFFECT(Limits, BoundLimits)

}  // namespace pycraft
