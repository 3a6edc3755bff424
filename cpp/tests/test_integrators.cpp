// What integrators are made of: momenta and the forces that change them, events, pairs, and steps that allocate nothing.
#define BOOST_TEST_MODULE integrators
#include <boost/test/included/unit_test.hpp>
#include <cmath>

#include "allocations.h"
#include "dynamics/sensitivities.h"
#include "random_tree.h"
#include "recursions/momenta.h"
#include "robot.h"
#include "simulation/effects/damping.h"
#include "simulation/effects/gravity.h"
#include "simulation/effects/spring.h"
#include "simulation/integrators/integrate.h"
#include "simulation/integrators/pairing.h"
#include "simulation/integrators/variational.h"
#include "simulation/scene_equations.h"

using namespace pycraft;
using namespace pycraft::testing;

// π = (ℳ + J) v and ∂KE/∂θ + G against the direct calls and the sensitivities.
BOOST_AUTO_TEST_CASE(momenta_are_those_of_the_model) {
  const auto mb = robot();
  const auto model = mb->compiled<double>();
  const int nv = mb->nv();
  std::vector<double> q = mb->zero_q();
  const std::vector<double> u = random_numbers(nv, 3), v = random_numbers(nv, 4);
  mb->integrate(q.data(), u.data(), q.data());
  RigidDynamics<double> dynamics(*mb);
  Sensitivities<double> sensitivities(*mb);
  Momenta<double> momenta(*model);
  std::vector<double> pi(nv), forces(nv), mass(size_t(nv) * nv), dq(nv), dv(nv), weight(nv), zero(nv, 0.0);
  const Vector3<double> g{0.3, -0.2, -9.81};
  momenta.momentum_and_forces(q.data(), v.data(), model->rotor_inertia.data(), g, pi.data(), forces.data());
  dynamics.mass_matrix(q.data(), mass.data());
  sensitivities.kinetic_energy(q.data(), v.data(), dq.data(), dv.data());
  const Applied<double> field{g};
  dynamics.inverse_dynamics(q.data(), zero.data(), nullptr, weight.data(), &field);
  for (int i = 0; i < nv; ++i) {
    double sum = 0;
    for (int j = 0; j < nv; ++j) sum += mass[size_t(i) * nv + j] * v[j];
    BOOST_TEST(std::abs(pi[i] - sum) < 1e-12 * (1 + std::abs(sum)));
    BOOST_TEST(std::abs(forces[i] - (dq[i] - weight[i])) < 1e-11 * (1 + std::abs(dq[i]) + std::abs(weight[i])));
  }
}

// cobracket is bracket's transpose, on every group.
BOOST_AUTO_TEST_CASE(cobrackets_are_transposes) {
  const auto mb = robot();
  const std::vector<double> u = random_numbers(mb->nv(), 1), v = random_numbers(mb->nv(), 2), p = random_numbers(mb->nv(), 3);
  each_subhinge(*mb->compiled<double>(), [&](auto row, int, int at) {
    double uv[row.nv], up[row.nv], left = 0, right = 0;
    row.bracket(u.data() + at, v.data() + at, uv), row.cobracket(u.data() + at, p.data() + at, up);
    for (int i = 0; i < row.nv; ++i) left += up[i] * v[at + i], right += p[at + i] * uv[i];
    BOOST_TEST(std::abs(left - right) < 1e-15);
  });
}

BOOST_AUTO_TEST_CASE(zeros_to_the_last_digit) {
  int calls = 0;
  const auto count = [&](auto f) {
    calls = 0;
    return [&calls, f](auto x) {
      ++calls;
      return f(x);
    };
  };
  BOOST_TEST(zero_between(0.0, -1.0, 2.0, 7.0, count([](double x) { return x * x * x - 1; })) == 1.0);
  BOOST_TEST(calls < 15);
  const double flat = zero_between(-1.0, -1.0, 3.0, std::pow(3.0, 9), count([](double x) { return std::pow(x, 9); }));
  BOOST_TEST(std::abs(flat) < 1e-15);
  const Quad root = zero_between(Quad(1), Quad(-1), Quad(2), Quad(2), [](const Quad& x) { return Quad(x * x - Quad(2)); });
  BOOST_TEST(std::abs(to_double(Quad(root * root - Quad(2)))) < 1e-33);
  const double jump = zero_between(0.0, -1.0, 1.0, 1.0, [](double x) { return x < 0.3 ? -1.0 : 1.0; });
  BOOST_TEST(std::abs(jump - 0.3) < 1e-15);
}

namespace {

// A wall that is felt once the coordinate is beyond it: a law with a kink, at which a step ends.
class Wall : public Effect {
 public:
  std::string kind() const override { return "wall"; }
  Declaration declaration() const override {
    Declaration d;
    d.coordinates = {0}, d.potential = true, d.events = 1;
    return d;
  }
  PYCRAFT_BINDS
};
template <class S>
class BoundWall : public BoundEffect<S> {
 public:
  explicit BoundWall(const Wall&) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    if (at.q[0] > S(1)) out.generalized[0] -= S(1000) * (at.q[0] - S(1));
  }
  void events(const At<S>& at, S* out) override { out[0] = at.q[0] - S(1); }
};
PYCRAFT_BIND_EFFECT(Wall, BoundWall)

std::shared_ptr<Multibody> block() {
  const auto mb = std::make_shared<Multibody>("block");
  Body b;
  b.name = "b", b.mass = 1, b.hinge.name = "rail", b.hinge.kind = HingeKind::slider;
  b.hinge.subhinges = subhinges_of(HingeKind::slider, {{1, 0, 0}}, {0, 0, 0}, 0, "rail");
  mb->add_body(b, "");
  return mb;
}

struct Ends : Watcher<double> {
  void step(const double& t, const State&) override { times.push_back(t); }
  void event(int, const double& t, const State&) override { met.push_back(t); }
  std::vector<double> times, met;
};

}  // namespace

// A step ends where an effect changes its law: the bounce is as exact as the smooth parts, at the same tolerance.
BOOST_AUTO_TEST_CASE(steps_end_at_the_events_of_effects) {
  const auto mb = block();
  Scene scene(mb);
  scene.add("", std::make_shared<Wall>());
  for (const Integrator integrator : {Integrator::dopri5, Integrator::rkmk4, Integrator::rosenbrock4}) {
    CompiledScene<double> compiled(scene, {});
    IntegratorOptions options{integrator, 1e-9, 1e-12, integrator == Integrator::rkmk4 ? 1e-3 : 0.0};
    const Paired<double> pair = paired(compiled, false, options);
    Ends ends;
    RunEnd<double> end;
    integrate<double>(*pair.equations, *pair.stepper, {0.0, 2.0}, RunPlan<double>{{0, 1}, false, {}, nullptr}, options, ends, end);
    const double there = 0.5, w = std::sqrt(1000.0), back = there + M_PI / w;  // half a period of the wall's spring
    BOOST_TEST(ends.met.size() == 2u, integrator_name(integrator));
    BOOST_TEST(std::abs(ends.met[0] - there) < 1e-9);
    BOOST_TEST(std::abs(ends.met[1] - back) < 1e-6);
    BOOST_TEST(std::count(ends.times.begin(), ends.times.end(), ends.met[0]) == 1);
  }
}

// Steps of every integrator allocate nothing: twice the time, the same count.
BOOST_AUTO_TEST_CASE(steps_do_not_allocate) {
  const auto mb = robot();
  Scene scene(mb);
  scene.add("", std::make_shared<Gravity>(Vector3<double>{0, 0, -9.81}));
  scene.add("", std::make_shared<Damping>(*mb, std::nullopt, std::vector<double>{0.1}));
  const std::vector<double> v = random_numbers(mb->nv(), 5);
  for (size_t i = 0; i < std::size(integrator_records); ++i) {
    const auto integrator = static_cast<Integrator>(i);
    long counts[2], steps[2];
    for (const int twice : {0, 1}) {
      CompiledScene<double> compiled(scene, {});
      const IntegratorOptions options{integrator, 1e-7, 1e-9, 1e-3};
      const Paired<double> pair = paired(compiled, true, options);
      std::vector<double> x = SceneEquations<double>(compiled, true).initial(0.0, mb->zero_q().data(), v.data(), nullptr);
      Watcher<double> nobody;
      RunEnd<double> end;
      counts[twice] = allocations_of([&] {
        integrate<double>(*pair.equations, *pair.stepper, x, RunPlan<double>{{0, 0.2 * (1 + twice)}, false, {}, nullptr}, options, nobody, end);
      });
      steps[twice] = end.cost.steps;
    }
    BOOST_TEST(steps[1] > steps[0], integrator_name(integrator));
    const long of_boost = integrator == Integrator::bulirsch_stoer ? 2 : 0;  // a step of Boost.Odeint's own keeps two arrays of 9 numbers
    BOOST_TEST(counts[1] - counts[0] <= of_boost * (steps[1] - steps[0]), integrator_name(integrator) << ": " << counts[0] << " and " << counts[1]);
  }
}
