#include "simulation/effects/torque_source.h"

#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundTorqueSource : public BoundEffect<S> {
 public:
  explicit BoundTorqueSource(const TorqueSource& of) : coordinates_(of.coordinates), torque_(of.torque), limits_(of.limits), u_(torque_->size()) {
    if (torque_->constant()) values_at(*torque_, S(0), u_.data());
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    if (!torque_->constant()) values_at(*torque_, at.t, u_.data());
    for (size_t i = 0; i < coordinates_.size(); ++i) {
      const int j = coordinates_[i];
      out.generalized[j] += limits_.bounded(i, u_[u_.size() == 1 ? 0 : i], at.v[j]);
    }
  }
  std::optional<Edge> edge(const At<S>& at) override {
    if (!torque_->constant()) values_at(*torque_, at.t, u_.data());
    for (size_t i = 0; i < coordinates_.size(); ++i) {
      const S& u = u_[u_.size() == 1 ? 0 : i];
      if (u == S(0)) continue;
      if (const char* why = limits_.edge_of_speed(i, u, at.v[coordinates_[i]])) return Edge{why, coordinates_[i]};
    }
    return {};
  }

 private:
  std::vector<int> coordinates_;
  TimeFunction torque_;
  DriveLimits limits_;
  std::vector<S> u_;
};

}  // namespace

void check_size(const FunctionOfTime& f, size_t count, const std::string& what) {
  if (f.size() != 1 && static_cast<size_t>(f.size()) != count)
    throw ModelError(what + " has " + std::to_string(f.size()) + " numbers; one for all, or one for each of its " + std::to_string(count) + " coordinates");
}

TorqueSource::TorqueSource(const Multibody& model, const Names& hinges, TimeFunction given, DriveLimits within)
    : coordinates(coordinates_named(model, hinges, "torque_source")), torque(std::move(given)), limits(std::move(within)) {
  check_size(*torque, coordinates.size(), "torque_source: torque");
  limits.check(coordinates.size(), "torque_source");
}

Declaration TorqueSource::declaration() const {
  Declaration d;
  d.time = !torque->constant(), d.foreign = torque->foreign(), d.knots = torque->knots();
  d.coordinates = coordinates;
  d.work = true;
  return d;
}

PYCRAFT_BIND_EFFECT(TorqueSource, BoundTorqueSource)

}  // namespace pycraft
