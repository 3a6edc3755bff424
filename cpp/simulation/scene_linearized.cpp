#include "simulation/scene_linearized.h"

#include <algorithm>
#include <cmath>

#include "model/rotor_forces.h"

namespace pycraft {

SceneLinearized::SceneLinearized(CompiledScene<double>& scene, bool works)
    : SceneEquations(scene, works), J_(nv(), 0.0), along_q_(nv(), nv()), along_v_(nv(), nv()), mass_(nv(), nv()), links_(scene.scene().model()), sensitivities_(scene.scene().model()),
      dynamics_(scene.scene().model()), direction_(nv()), moved_(nq()), faster_(nv()), other_(rest()), column_(nv() + rest()), vdot_(nv()), rest_rate_(rest()) {
  for (const auto& e : scene.effects().effects()) {
    const Declaration& d = e->declared;
    if (d.uniform_gravity) gravity_ = gravity_ + d.gravity;
    for (const HingeTerm& term : d.hinges) J_[term.coordinate] += term.inertia;
    acts_ |= e->acts() || !d.states.empty(), differenced_ |= !d.differentiable && (e->acts() || !d.states.empty()), in_time_ |= d.time;
  }
  if (!acts_ || differenced_) return;
  const auto numbers = std::make_shared<const CompiledModel<WithDerivatives>>(broadcast<WithDerivatives>(scene.numbers()));
  forces_ = std::make_unique<SceneForces<WithDerivatives>>(scene.scene(), numbers);
  sum_.resize(nv()), y_rate_.resize(own());
}

void SceneLinearized::linearize(const double& now, const double& h, const double* q, const double* v, const double* rest, const double* vdot, const double* rest_rate, Linearization& out) {
  const int n = nv() + own();
  const double t = inside(now);
  out.mass = Eigen::MatrixXd::Identity(n, n), out.along_u = Eigen::MatrixXd::Zero(n, nv()), out.along_z = Eigen::MatrixXd::Zero(n, n), out.along_t = Eigen::VectorXd::Zero(n);
  differentiate_motion(q, v, vdot, out);
  if (forces_)
    differentiate_forces(t, q, v, rest, out);
  else if (acts_)
    difference_forces(t, q, v, rest, out);
  if (in_time_ || !scene().prescribed().empty()) difference_time(t, h, q, v, rest, vdot, rest_rate, out);
  leave_out_known(out);
}

void SceneLinearized::differentiate_motion(const double* q, const double* v, const double* vdot, Linearization& out) {
  const int N = nv();
  if (N == 0) return;
  const Applied<double> field{gravity_};
  const Given given[] = {{"q", q, nq(), -1}, {"v", v, N, -1}, {"vdot", vdot, N, -1}};
  double* const others[] = {along_v_.data(), mass_.data()};
  bool doubt = !links_.there(kernels::Call::inverse_dynamics_derivatives);
  if (!doubt)
    links_.run({.call = kernels::Call::inverse_dynamics_derivatives, .q = given[0], .v = &given[1], .u = &given[2], .applied = &field, .others = others}, 1, N * N, along_q_.data(), [&](int, int) { doubt = true; });
  if (doubt) {
    sensitivities_.inverse_dynamics(q, v, vdot, along_q_.data(), along_v_.data(), &gravity_);
    dynamics_.mass_matrix(q, mass_.data());
  }
  out.mass.topLeftCorner(N, N) = mass_;
  for (int j = 0; j < N; ++j) out.mass(j, j) += J_[j];
  out.along_u.topRows(N) = -along_q_;
  out.along_z.topLeftCorner(N, N) = -along_v_;
  for (int k = 0; k < scene().numbers().bodies; ++k)
    each_rotor_force_rate(scene().numbers(), k, J_.data(), v, [&](int i, int j, double rate) { out.along_z(i, j) -= rate; });
}

// Direction: of a displacement, then of a velocity, then of a state of the effects.
void SceneLinearized::add_column(int direction, const double* along, Linearization& out) const {
  const int N = nv(), n = N + own();
  for (int i = 0; i < n; ++i) (direction < N ? out.along_u(i, direction) : out.along_z(i, direction - N)) += along[i];
}

void SceneLinearized::differentiate_forces(double t, const double* q, const double* v, const double* rest, Linearization& out) {
  constexpr int width = static_cast<int>(std::extent_v<decltype(WithDerivatives::d)>);
  const int N = nv(), count = 2 * N + own();
  for (int first = 0; first < count; first += width) {
    const int several = std::min(width, count - first);
    seeded_.seed(model(), own(), q, v, rest, first, several);
    forces_->generalized_forces(WithDerivatives(t), seeded_.q.data(), seeded_.v.data(), seeded_.y.data(), sum_.data());
    if (own() > 0) forces_->rates(y_rate_.data());
    for (int i = 0; i < several; ++i) {
      for (int j = 0; j < N; ++j) column_[j] = sum_[j].d[i];
      for (int j = 0; j < own(); ++j) column_[N + j] = y_rate_[j].d[i];
      add_column(first + i, column_.data(), out);
    }
  }
}

// Central ones, of steps that leave most digits of functions of the size of their arguments.
void SceneLinearized::difference_forces(double t, const double* q, const double* v, const double* rest, Linearization& out) {
  const int N = nv(), n = N + own();
  SceneForces<double>& effects = scene().effects();
  State lower(n);
  for (int k = 0; k < 2 * N + own(); ++k) {
    const double size = k < N ? 1.0 : std::max(1.0, std::abs(k < 2 * N ? v[k - N] : rest[k - 2 * N])), step = 6e-6 * size;
    for (const double side : {-step, step}) {
      std::copy_n(q, nq(), moved_.data()), std::copy_n(v, N, faster_.data()), std::copy_n(rest, own(), other_.data());
      if (k < N) {
        std::fill(direction_.begin(), direction_.end(), 0.0);
        direction_[k] = side;
        move_configuration(model(), q, direction_.data(), moved_.data());
      } else {
        (k < 2 * N ? faster_[k - N] : other_[k - 2 * N]) += side;
      }
      effects.generalized_forces(t, moved_.data(), faster_.data(), other_.data(), column_.data());
      if (own() > 0) effects.rates(column_.data() + N);
      if (side < 0)
        lower.assign(column_.begin(), column_.begin() + n);
      else
        for (int i = 0; i < n; ++i) lower[i] = (column_[i] - lower[i]) / (2 * step);
    }
    add_column(k, lower.data(), out);
  }
}

void SceneLinearized::difference_time(double t, double h, const double* q, const double* v, const double* rest, const double* vdot, const double* rest_rate, Linearization& out) {
  const double later = t + std::copysign(std::max(1e-5 * std::abs(h), 4e3 * epsilon<double>() * std::abs(t)), h), step = later - t;
  std::copy_n(vdot, nv(), column_.data()), std::copy_n(rest_rate, own(), column_.data() + nv());
  evaluate(later, q, v, rest, vdot_.data(), rest_rate_.data());
  for (int j = 0; j < nv(); ++j) out.along_t[j] = (vdot_[j] - column_[j]) / step;
  for (int j = 0; j < own(); ++j) out.along_t[nv() + j] = (rest_rate_[j] - column_[nv() + j]) / step;
}

void SceneLinearized::leave_out_known(Linearization& out) const {
  out.known.assign(nv(), 0);
  for (int j : scene().prescribed()) {
    out.known[j] = 1;
    out.mass.row(j).setZero(), out.mass(j, j) = 1;
    out.along_u.row(j).setZero(), out.along_z.row(j).setZero();
    out.along_u.col(j).setZero(), out.along_z.col(j).setZero();
  }
}

}  // namespace pycraft
