#include "simulation/effects/servo.h"

#include "simulation/effects/torque_source.h"

namespace pycraft {

namespace {

template <class S>
class BoundServo : public BoundEffect<S> {
 public:
  explicit BoundServo(const Servo& of)
      : coordinates_(of.coordinates), kp_(of.stiffness.begin(), of.stiffness.end()), kd_(of.damping.begin(), of.damping.end()), target_(of.target), limits_(of.limits), r_(target_->size()),
        rate_(r_.size()) {
    if (target_->constant()) values_at(*target_, S(0), r_.data(), rate_.data());
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    if (!target_->constant()) values_at(*target_, at.t, r_.data(), rate_.data());
    for (size_t i = 0; i < coordinates_.size(); ++i) {
      const int v = coordinates_[i].v;
      out.generalized[v] += limits_.bounded(i, unbounded(at, i), at.v[v]);
    }
  }
  std::optional<Edge> edge(const At<S>& at) override {
    if (!target_->constant()) values_at(*target_, at.t, r_.data(), rate_.data());
    for (size_t i = 0; i < coordinates_.size(); ++i)
      if (const char* why = limits_.edge(i, unbounded(at, i), at.v[coordinates_[i].v])) return Edge{why, coordinates_[i].v};
    return {};
  }

 private:
  S unbounded(const At<S>& at, size_t i) const {
    const auto [q, v] = coordinates_[i];
    const size_t own = r_.size() == 1 ? 0 : i;
    return kp_[i] * (r_[own] - at.q[q]) + kd_[i] * (rate_[own] - at.v[v]);
  }
  std::vector<SingleCoordinate> coordinates_;
  std::vector<S> kp_, kd_;
  TimeFunction target_;
  DriveLimits limits_;
  std::vector<S> r_, rate_;
};

}  // namespace

Servo::Servo(const Multibody& model, const Names& hinges, const std::vector<double>& kp, const std::vector<double>& kd, TimeFunction to, DriveLimits within)
    : coordinates(single_coordinates(model, hinges, "servo")), stiffness(for_each(kp, coordinates.size(), "servo: stiffness")), damping(for_each(kd, coordinates.size(), "servo: damping")),
      target(std::move(to)), limits(std::move(within)) {
  check_size(*target, coordinates.size(), "servo: target");
  limits.check(coordinates.size(), "servo");
}

Declaration Servo::declaration() const {
  Declaration d;
  d.time = !target->constant(), d.foreign = target->foreign(), d.knots = target->knots();
  d.velocities = d.work = true;
  for (const auto& [q, v] : coordinates) d.coordinates.push_back(v);
  return d;
}

PYCRAFT_BIND_EFFECT(Servo, BoundServo)

}  // namespace pycraft
