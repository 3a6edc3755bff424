#include "simulation/stiffness.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <complex>

#include "simulation/decay.h"
#include "simulation/scene_linearized.h"

namespace pycraft {

namespace {

using Vector = Eigen::VectorXd;

constexpr int powers = 60;

std::string coordinate_of(const CompiledScene<double>& scene, const Vector& along) {
  Eigen::Index most = 0;
  along.cwiseAbs().maxCoeff(&most);
  return scene.scene().model().structure().coordinate_names[static_cast<size_t>(most)];
}

// The effect whose forces change most against `along` where the state moves by displacement and z, by differences; empty: none does.
std::string effect_against(CompiledScene<double>& scene, double t, const std::vector<double>& state, const Vector& displacement, const Vector& z, const Vector& along) {
  const int nv = scene.numbers().nv, nq = scene.numbers().nq;
  const auto& effects = scene.effects().effects();
  std::vector<double> moved = state, step(displacement.begin(), displacement.end()), vdot(nv), before(effects.size() * nv), after(before.size());
  move_configuration(scene.numbers(), state.data(), step.data(), moved.data());
  for (Eigen::Index i = 0; i < z.size(); ++i) moved[nq + i] += z[i];
  const auto forces = [&](const std::vector<double>& at, std::vector<double>& rows) {
    scene.accelerations_and_forces(t, at.data(), at.data() + nq, at.data() + nq + nv, vdot.data(), rows.data());
  };
  forces(state, before), forces(moved, after);
  std::string found;
  double share = 0;
  for (const auto& e : effects) {
    double power = 0;
    for (int i = 0; i < nv; ++i) power -= (after[size_t(e->number) * nv + i] - before[size_t(e->number) * nv + i]) * along[i];
    if (power > share) share = power, found = e->name;
  }
  return found;
}

// Of displacements from step to step under semi-implicit Euler.
void find_oscillation(CompiledScene<double>& scene, const Linearization& linear, const std::vector<double>& state, double t, double h, Stiffness& found) {
  const int nv = scene.numbers().nv;
  Vector C = Vector::Zero(nv), K = Vector::Zero(nv);
  for (const auto& e : scene.effects().effects())
    for (const HingeTerm& term : e->declared.hinges) C[term.coordinate] += term.damping, K[term.coordinate] += term.stiffness;
  for (int j = 0; j < nv; ++j)
    if (linear.known[j]) C[j] = K[j] = 0;
  Eigen::MatrixXd mass = linear.mass.topLeftCorner(nv, nv), along_u = linear.along_u.topRows(nv), along_v = linear.along_z.topLeftCorner(nv, nv);
  along_u.diagonal() += K, along_v.diagonal() += C;
  const Eigen::MatrixXd held = mass + Eigen::MatrixXd((h / 2 * C + h * h / 4 * K).asDiagonal()), forces = -(h * h * along_u + 2 * h * along_v) / 4;
  const Eigen::LLT<Eigen::MatrixXd> factors(held);
  if (factors.info() != Eigen::Success) return;
  Vector x(nv);  // some vector that no symmetry of a mechanism is at right angles to
  for (int i = 0; i < nv; ++i) x[i] = linear.known[i] ? 0 : 1 + 0.5 * std::sin(1.7 * i + 0.3);
  for (int i = 0; i < powers; ++i) {
    x = factors.solve(forces * x);
    const double size = x.norm();
    if (!(size > 0) || !std::isfinite(size)) return;
    x /= size;
  }
  if (!(x.dot(forces * x) > x.dot(held * x))) return;
  const double m = x.dot(mass * x), k = -x.dot(along_u * x) - x.dot(K.cwiseProduct(x)), c = -x.dot(along_v * x) - x.dot(C.cwiseProduct(x));
  found.longest = 4 * m / (c + std::sqrt(std::max(c * c + 4 * m * k, 0.0)));  // 4 m = 2h c + h² k
  found.rate = -std::sqrt(std::max(k, 0.0) / m) - std::max(c, 0.0) / m;
  found.coordinate = coordinate_of(scene, x);
  // By a hundred-thousandth of a displacement of the configuration, or of what a step moves.
  const double by = 1e-5 * std::max(1e-9, h * Eigen::Map<const Vector>(state.data() + scene.numbers().nq, nv).norm());
  found.effect = effect_against(scene, t, state, by * x, 2 * by / h * x, x);
}

double growth_of_rk4(std::complex<double> z) { return std::abs(1.0 + z * (1.0 + z * (0.5 + z * (1.0 / 6 + z / 24.0)))); }

}  // namespace

Stiffness stiffness_of(CompiledScene<double>& scene, double t, const std::vector<double>& x, double step) {
  SceneLinearized equations(scene, false);
  const int nq = equations.nq(), nv = equations.nv(), own = equations.own();
  const std::vector<double> state(x.begin(), x.begin() + nq + nv + own);
  DecayFinder finder(equations);
  const Decay& decay = finder.fastest(t, state, step);
  Stiffness found{t, step, 0, 0, "", "", 0};
  if (!decay.holds(std::abs(step))) return found;
  found.rate = decay.real;
  const Vector along = decay.z.head(nv);
  found.coordinate = coordinate_of(scene, along);
  // By a hundred-thousandth of the decay's own scale: |v| changes by no more than that of the state.
  double fastest = 1e-9;
  for (int i = 0; i < nv; ++i) fastest = std::max(fastest, std::abs(state[nq + i]));
  const double by = 1e-5 * fastest / std::max(along.cwiseAbs().maxCoeff(), 1e-300);
  found.effect = effect_against(scene, t, state, by * decay.displacement, by * decay.z, along);
  return found;
}

Stiffness growth_of_steps(CompiledScene<double>& scene, Integrator integrator, double t, const std::vector<double>& x, double step) {
  SceneLinearized equations(scene, false);
  const int nq = equations.nq(), nv = equations.nv(), own = equations.own();
  const std::vector<double> state(x.begin(), x.begin() + nq + nv + own);
  const double h = std::abs(step);
  Stiffness found{t, step, 0, 0, "", "", 0};
  if (nv == 0) return found;
  if (integrator == Integrator::semi_implicit_euler) {
    std::vector<double> vdot(nv), rate(own);
    Linearization linear;
    equations.evaluate(t, state.data(), state.data() + nq, state.data() + nq + nv, vdot.data(), rate.data());
    equations.linearize(t, step, state.data(), state.data() + nq, state.data() + nq + nv, vdot.data(), rate.data(), linear);
    find_oscillation(scene, linear, state, t, h, found);
    return found;
  }
  if (integrator != Integrator::rk4 && integrator != Integrator::rkmk4) return found;
  DecayFinder finder(equations);
  const Decay& decay = finder.fastest(t, state, step);
  if (decay.real > 0.05 * decay.size || h * decay.size < 2.5) return found;
  const double real = std::min(decay.real, 0.0);
  const std::complex<double> rate(real, std::sqrt(std::max(decay.size * decay.size - real * real, 0.0)));
  if (!(growth_of_rk4(h * rate) > 1)) return found;
  double stable = 2.5 / decay.size, unstable = h;
  for (int i = 0; i < 50; ++i) {
    const double middle = (stable + unstable) / 2;
    (growth_of_rk4(middle * rate) > 1 ? unstable : stable) = middle;
  }
  found.longest = stable, found.rate = -decay.size;
  // Displacements and velocities have one shape, in turn: forces of an oscillation change along the former, those of a decay along the latter.
  const Vector z = decay.z.head(nv), along = (z.norm() > decay.displacement.norm() ? z : decay.displacement).normalized(), none = Vector::Zero(nv);
  found.coordinate = coordinate_of(scene, along);
  const bool decays = decay.real < -0.5 * decay.size;
  const double v = Eigen::Map<const Vector>(state.data() + nq, nv).norm(), by = 1e-5 * std::max(1e-9, decays ? v : h * v);
  found.effect = effect_against(scene, t, state, decays ? none : Vector(by * along), decays ? Vector(by * along) : none, along);
  return found;
}

}  // namespace pycraft
