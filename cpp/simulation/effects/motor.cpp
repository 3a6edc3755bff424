#include "simulation/effects/motor.h"

#include "model/checks.h"
#include "runtime/errors.h"
#include "simulation/effects/torque_source.h"

namespace pycraft {

namespace {

template <class S>
class BoundMotor : public BoundEffect<S> {
 public:
  explicit BoundMotor(const Motor& of) : coordinates_(of.coordinates), command_(of.command), limits_(of.limits), u_(command_->size()) {
    for (size_t i = 0; i < coordinates_.size(); ++i) {
      const S n(of.numbers.gear_ratio[i]);
      stall_.push_back(n * S(of.numbers.stall_torque[i])), slope_.push_back(n / S(of.numbers.no_load_speed[i]));
    }
    if (command_->constant()) values_at(*command_, S(0), u_.data());
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    if (!command_->constant()) values_at(*command_, at.t, u_.data());
    for (size_t i = 0; i < coordinates_.size(); ++i) out.generalized[coordinates_[i]] += limits_.bounded(i, unbounded(at, i), at.v[coordinates_[i]]);
  }
  std::optional<Edge> edge(const At<S>& at) override {
    if (!command_->constant()) values_at(*command_, at.t, u_.data());
    for (size_t i = 0; i < coordinates_.size(); ++i)
      if (const char* why = limits_.edge(i, unbounded(at, i), at.v[coordinates_[i]])) return Edge{why, coordinates_[i]};
    return {};
  }

 private:
  S unbounded(const At<S>& at, size_t i) const {
    S u = u_[u_.size() == 1 ? 0 : i];
    if (u > S(1)) u = S(1);
    if (S(-1) > u) u = S(-1);
    return stall_[i] * (u - slope_[i] * at.v[coordinates_[i]]);
  }
  std::vector<int> coordinates_;
  TimeFunction command_;
  DriveLimits limits_;
  std::vector<S> u_, stall_, slope_;
};

void require_positive(std::vector<double>& x, size_t count, const std::string& what) {
  x = for_each(std::move(x), count, "motor: " + what);
  for (double y : x)
    if (!(y > 0)) throw ModelError("motor: " + what + " is " + short_number(y) + "; it is positive");
}

}  // namespace

Motor::Motor(const Multibody& model, const Names& hinges, TimeFunction of_time, MotorNumbers given, DriveLimits within)
    : coordinates(coordinates_named(model, hinges, "motor")), command(std::move(of_time)), numbers(std::move(given)), limits(std::move(within)) {
  const size_t n = coordinates.size();
  check_size(*command, n, "motor: command");
  require_positive(numbers.stall_torque, n, "stall_torque");
  require_positive(numbers.no_load_speed, n, "no_load_speed");
  numbers.gear_ratio = for_each(numbers.gear_ratio, n, "motor: gear_ratio");
  for (double y : numbers.gear_ratio)
    if (y == 0) throw ModelError("motor: gear_ratio is 0; it is a number of turns of the motor for one of the hinge");
  numbers.rotor_inertia = not_negative(numbers.rotor_inertia, n, "motor: rotor_inertia");
  limits.check(n, "motor");
}

Declaration Motor::declaration() const {
  Declaration d;
  d.time = !command->constant(), d.foreign = command->foreign(), d.knots = command->knots();
  d.velocities = d.work = true;
  d.coordinates = coordinates;
  for (size_t i = 0; i < coordinates.size(); ++i)
    if (const double n = numbers.gear_ratio[i]; numbers.rotor_inertia[i] != 0) d.hinges.push_back({coordinates[i], n * n * numbers.rotor_inertia[i]});
  return d;
}

PYCRAFT_BIND_EFFECT(Motor, BoundMotor)

}  // namespace pycraft
