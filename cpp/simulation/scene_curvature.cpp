#include "simulation/scene_curvature.h"

#include <algorithm>
#include <cmath>

#include "model/checks.h"
#include "model/rotor_forces.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

SceneCurvature::SceneCurvature(CompiledScene<double>& scene) : scene_(scene), known_(scene.numbers().nv, 0), along_(scene.numbers().nv), J_(scene.numbers().nv, 0.0) {
  for (const auto& e : scene.effects().effects()) {
    const Declaration& d = e->declared;
    if (d.uniform_gravity) gravity_ = gravity_ + d.gravity;
    for (const HingeTerm& term : d.hinges) J_[term.coordinate] += term.inertia;
    acts_ |= e->acts() || !d.states.empty(), differenced_ |= !d.differentiable && (e->acts() || !d.states.empty());
  }
  for (int j : scene.prescribed()) known_[j] = 1;
}

void refuse_edges(CompiledScene<double>& scene, int order, double t, const double* q, const double* v, const double* own) {
  SceneForces<double>& effects = scene.effects();
  effects.start(t, q, v, own);
  effects.place(effects.read()), effects.move(effects.read());
  const std::vector<int>& known = scene.prescribed();
  for (const auto& e : effects.effects()) {
    const std::optional<Edge> edge = effects.edge(*e);
    if (!edge || (edge->coordinate >= 0 && (order == 1 || std::find(known.begin(), known.end(), edge->coordinate) != known.end()))) continue;
    const std::string where = edge->coordinate < 0 ? "" : "coordinate '" + scene.scene().model().structure().coordinate_names[edge->coordinate] + "' ";
    throw EvaluationError("effect '" + e->name + "' has no " + (order == 1 ? "" : "second ") + "derivatives at this state, t = " + short_number(t) + " s: " + where + edge->why +
                          "; move the state off, or disable the effect");
  }
}

void SceneCurvature::forces(double t, const double* q, const double* v, const double* own_states, const double* mu, int count, double* out) {
  const int n = directions(), N = nv();
  std::fill_n(out, size_t(count) * n * n, 0.0);
  if (!acts_ || count == 0) return;
  std::vector<double> weights(mu, mu + size_t(count) * (N + own()));
  for (int m = 0; m < count; ++m)
    for (int j = 0; j < N; ++j)
      if (known_[j]) weights[size_t(m) * (N + own()) + j] = 0;
  if (differenced_)
    difference(t, q, v, own_states, weights.data(), count, out);
  else
    differentiate(t, q, v, own_states, weights.data(), count, out);
  if (!std::all_of(out, out + size_t(count) * n * n, [](double x) { return std::isfinite(x); })) refuse(t);
  for (int m = 0; m < count; ++m, out += size_t(n) * n)
    for (int j = 0; j < N; ++j)
      for (int i = 0; known_[j] && i < n; ++i) out[i * n + j] = out[i * n + N + j] = out[j * n + i] = out[(N + j) * n + i] = 0;
}

void SceneCurvature::refuse(double t) const {
  std::string names;
  for (const auto& e : scene_.effects().effects())
    if (e->acts() || !e->declared.states.empty()) names += (names.empty() ? "'" : ", '") + e->name + "'";
  throw EvaluationError("second derivatives of the forces of " + names + " are not finite at this state, t = " + short_number(t) + " s: one of them has none there, or leaves the range of its numbers");
}

void SceneCurvature::differentiate(double t, const double* q, const double* v, const double* own_states, const double* mu, int count, double* out) {
  constexpr int width = 4;
  const int n = directions(), N = nv(), rows = N + own();
  const CompiledModel<WithDerivatives> numbers = broadcast<WithDerivatives>(scene_.numbers());
  SceneForces<WithCurvature> effects(scene_.scene(), std::make_shared<const CompiledModel<WithCurvature>>(broadcast<WithCurvature>(scene_.numbers())));
  TangentStates<double, width> inner;
  TangentStates<WithDerivatives, width> outer;
  std::vector<WithCurvature> F(rows);
  struct Tile {
    int first, several;
  };
  std::vector<Tile> tiles;  // of displacements, then of the rest
  for (const auto& [from, to] : {std::pair{0, N}, std::pair{N, n}})
    for (int first = from; first < to; first += width) tiles.push_back({first, std::min(width, to - first)});
  for (const Tile& a : tiles) {
    inner.seed(scene_.numbers(), own(), q, v, own_states, a.first, a.several);
    for (const Tile& b : tiles) {
      if (b.first < a.first && a.first >= N) continue;  // those commute: the other order is the same
      check_interrupt();
      outer.seed(numbers, own(), inner.q.data(), inner.v.data(), inner.y.data(), b.first, b.several);
      effects.generalized_forces(WithCurvature(t), outer.q.data(), outer.v.data(), outer.y.data(), F.data());
      if (own() > 0) effects.rates(F.data() + N);
      const bool both_orders = a.first < N && b.first < N;
      for (int m = 0; m < count; ++m)
        for (int i = 0; i < a.several; ++i)
          for (int j = 0; j < b.several; ++j) {
            double sum = 0;
            for (int r = 0; r < rows; ++r) sum += mu[size_t(m) * rows + r] * F[r].d[j].d[i];
            double *const to = out + size_t(m) * n * n, &ij = to[(a.first + i) * n + b.first + j], &ji = to[(b.first + j) * n + a.first + i];
            ij = sum;
            if (!both_orders) ji = sum;
          }
    }
  }
}

void SceneCurvature::values(double t, const double* q, const double* v, const double* own_states, int i, double by_i, int j, double by_j, const double* mu, int count, std::vector<double>& to) {
  const int N = nv(), rows = N + own();
  std::fill(along_.begin(), along_.end(), 0.0);
  v_.assign(v, v + N), y_.assign(own_states, own_states + own()), q_.resize(scene_.numbers().nq), F_.resize(rows);
  for (const auto& [k, by] : {std::pair{i, by_i}, std::pair{j, by_j}}) (k < N ? along_[k] : k < 2 * N ? v_[k - N] : y_[k - 2 * N]) += by;
  std::copy_n(q, q_.size(), q_.data());
  move_configuration(scene_.numbers(), q_.data(), along_.data(), q_.data());
  scene_.effects().generalized_forces(t, q_.data(), v_.data(), y_.data(), F_.data());
  if (own() > 0) scene_.effects().rates(F_.data() + N);
  to.assign(count, 0.0);
  for (int m = 0; m < count; ++m)
    for (int r = 0; r < rows; ++r) to[m] += mu[size_t(m) * rows + r] * F_[r];
}

void SceneCurvature::difference(double t, const double* q, const double* v, const double* own_states, const double* mu, int count, double* out) {
  const int n = directions(), N = nv();
  std::vector<double> here, far[4];
  std::vector<double> step(n);
  for (int k = 0; k < n; ++k) {
    const double size = k < N ? 1.0 : std::max(1.0, std::abs(k < 2 * N ? v[k - N] : own_states[k - 2 * N]));
    step[k] = std::ldexp(size, -13);  // ε^¼
  }
  values(t, q, v, own_states, 0, 0, 0, 0, mu, count, here);
  for (int i = 0; i < n; ++i)
    for (int j = i; j < n; ++j) {
      const double h = step[i], k = j == i ? 0 : step[j];
      int corner = 0;
      for (const double side : {-1.0, 1.0})
        for (const double other : {-1.0, 1.0}) values(t, q, v, own_states, i, side * h, j, other * k, mu, count, far[corner++]);
      for (int m = 0; m < count; ++m) {
        double *const to = out + size_t(m) * n * n;
        to[i * n + j] = to[j * n + i] = i == j ? ((far[3][m] - here[m]) + (far[0][m] - here[m])) / (h * h) : ((far[3][m] - far[2][m]) - (far[1][m] - far[0][m])) / (4 * h * k);
      }
    }
}

void SceneCurvature::motion(const double* q, const double* v, const double* vdot, const double* mu, int count, double* out) {
  const int N = nv(), rows = N + own();
  std::vector<double> weights;
  for (int m = 0; m < count; ++m)
    for (int j = 0; j < N; ++j) weights.push_back(known_[j] ? 0.0 : mu[size_t(m) * rows + j]);
  if (N == 0 || count == 0) return;
  Curvature<double>(scene_.scene().model()).inverse_dynamics(q, v, vdot, weights.data(), count, out, &gravity_);
  // And of the rotors that effects bring, whose c(v) is of second degree: along v_i the gradient at v = e_i.
  const CompiledModel<double>& numbers = scene_.numbers();
  for (int m = 0; m < count; ++m)
    for (int k = 0; k < numbers.bodies; ++k)
      for (int i = numbers.v_offset[k]; i < numbers.v_offset[k] + numbers.nv_of[k]; ++i) {
        std::fill(along_.begin(), along_.end(), 0.0);
        along_[i] = 1;
        add_rotor_power_gradient(numbers, k, J_.data(), along_.data(), weights.data() + size_t(m) * N, out + size_t(Curvature<double>::blocks * m + 3) * N * N + size_t(i) * N);
      }
  for (int block = 0; block < Curvature<double>::blocks * count; ++block, out += size_t(N) * N)
    for (int j = 0; j < N; ++j)
      for (int i = 0; known_[j] && i < N; ++i) out[j * N + i] = out[i * N + j] = 0;
}

}  // namespace pycraft
