#include "simulation/effects/bushing.h"

#include <algorithm>
#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"
#include "simulation/effects/rotation_vector.h"

namespace pycraft {

namespace {

template <class S>
class BoundBushing : public BoundEffect<S> {
 public:
  explicit BoundBushing(const Bushing& of) : a_(of.base), b_(of.nodes.b), K_(of.stiffness.begin(), of.stiffness.end()), C_(of.damping.begin(), of.damping.end()), damps_(of.damps) {}

  void forces(const At<S>& at, const Forces<S>& out) override {
    const Stretch x = stretch(at);
    Vector6<S> g = times(K_, x.xi);
    if (damps_) g = g + times(C_, rate(at, x));
    const Vector3<S> force = x.A.R * g.linear, moment = x.A.R * moment_along_rotation_vector(x.xi.angular, g.angular);
    b_.push(at, -moment, -force, out);
    a_.push(at, moment + cross(x.apart, force), force, out);  // about its own origin
  }
  S potential(const At<S>& at) override {
    const Stretch x = stretch(at);
    return dot(x.xi, times(K_, x.xi)) / S(2);
  }
  S power(const At<S>& at, const S&) override {
    const Vector6<S> xi = rate(at, stretch(at));
    return -dot(xi, times(C_, xi));
  }

 private:
  struct Stretch {
    Pose<S> A;          // of a at rest, in the world
    Vector3<S> apart;   // from its origin to b's, in the world's axes
    Vector6<S> xi;
  };
  Stretch stretch(const At<S>& at) const {
    const Pose<S> A = a_.in_world(at), B = b_.in_world(at);
    const Vector3<S> apart = B.p - A.p;
    return {A, apart, {rotation_vector(rotation_quaternion(transpose(A.R) * B.R)), transpose_times(A.R, apart)}};
  }
  Vector6<S> rate(const At<S>& at, const Stretch& x) const {
    const Vector3<S> omega = a_.angular_velocity(at), turning = transpose_times(x.A.R, b_.angular_velocity(at) - omega);
    return {rotation_vector_rate(x.xi.angular, turning), transpose_times(x.A.R, b_.velocity(at) - a_.velocity(at) - cross(omega, x.apart))};
  }
  static Vector6<S> times(const std::vector<S>& A, const Vector6<S>& x) {
    Vector6<S> y;
    for (int i = 0; i < 6; ++i) {
      S sum = S(0);
      for (int j = 0; j < 6; ++j) sum += A[6 * i + j] * x[j];
      y[i] = sum;
    }
    return y;
  }
  PlacedNode<S> a_, b_;
  std::vector<S> K_, C_;
  bool damps_;
};

std::vector<double> checked_matrix(const std::vector<double>& A, const char* what) {
  if (A.size() != 36) throw ModelError(std::string("bushing: ") + what + " is six numbers, or a (6, 6) matrix");
  double largest = 0;
  for (double x : A) {
    if (!std::isfinite(x)) throw ModelError(std::string("bushing: ") + what + " has an entry that is " + short_number(x));
    largest = std::max(largest, std::abs(x));
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < i; ++j)
      if (std::abs(A[6 * i + j] - A[6 * j + i]) > 1e-9 * largest)
        throw ModelError(std::string("bushing: ") + what + " is not symmetric at entries (" + std::to_string(i) + ", " + std::to_string(j) + ") and (" + std::to_string(j) + ", " + std::to_string(i) + ")");
  return A;
}

}  // namespace

Bushing::Bushing(const Multibody& model, const std::string& a, const std::string& b, const std::vector<double>& K, const std::vector<double>& C, const Pose<double>& rest)
    : nodes(model, a, b, "bushing"), stiffness(checked_matrix(K, "stiffness")), damping(checked_matrix(C, "damping")), base(nodes.a),
      damps(std::any_of(C.begin(), C.end(), [](double x) { return x != 0; })) {
  base.pose = nodes.a.pose * checked_pose(rest, "rest of a bushing");
}

Declaration Bushing::declaration() const {
  Declaration d;
  d.potential = true;
  d.velocities = d.work = damps;
  nodes.declare(d, damps);
  return d;
}

PYCRAFT_BIND_EFFECT(Bushing, BoundBushing)

}  // namespace pycraft
