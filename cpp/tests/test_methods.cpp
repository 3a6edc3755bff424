// Methods of forward dynamics allocate nothing after the first call; rates of configurations against differences on the group, in quad.
#define BOOST_TEST_MODULE methods
#include <boost/test/included/unit_test.hpp>

#include "allocations.h"
#include "dynamics/methods.h"
#include "dynamics/rigid_dynamics.h"
#include "model/configuration.h"
#include "robot.h"
#include "runtime/errors.h"
#include "simulation/integrators/integrate.h"

using namespace pycraft;
using namespace pycraft::testing;

BOOST_AUTO_TEST_CASE(methods_do_not_allocate) {
  const auto mb = robot();
  const std::vector<double> q = mb->zero_q(), v = random_numbers(mb->nv(), 1), tau = random_numbers(mb->nv(), 2);
  std::vector<double> out(mb->nv()), expected(mb->nv());
  RigidDynamics<double>(*mb).forward_dynamics(q.data(), v.data(), tau.data(), expected.data());
  DynamicsMethods<double> w(*mb);
  for (const Method method : methods) {
    BOOST_TEST(allocations_of([&] { w.forward_dynamics(method, q.data(), v.data(), tau.data(), out.data()); }) == 0, method_name(method));
    for (int i = 0; i < mb->nv(); ++i) BOOST_TEST(std::abs(out[i] - expected[i]) < 1e-11);
  }
}

// q moved by ±hv: the difference over 2h is q̇ up to h²|v|³ and eps/h of quad; with h = 1e-10 both are near 1e-20.
BOOST_AUTO_TEST_CASE(rates_are_derivatives_on_the_group) {
  const auto mb = robot();
  const auto model = mb->compiled<Quad>();
  for (int seed = 0; seed < 5; ++seed) {
    const std::vector<double> q0 = random_numbers(mb->nq(), seed), v0 = random_numbers(mb->nv(), seed + 100);
    const std::vector<Quad> q(q0.begin(), q0.end()), v(v0.begin(), v0.end());
    std::vector<Quad> rate(q.size()), ahead(q.size()), behind(q.size()), step(v.size());
    configuration_rate(*model, q.data(), v.data(), rate.data());
    const Quad h = Quad(1e-10);
    for (size_t i = 0; i < v.size(); ++i) step[i] = h * v[i];
    move_configuration(*model, q.data(), step.data(), ahead.data());
    for (Quad& s : step) s = -s;
    move_configuration(*model, q.data(), step.data(), behind.data());
    for (size_t i = 0; i < q.size(); ++i) BOOST_TEST(to_double(abs(Quad(rate[i] - (ahead[i] - behind[i]) / (2 * h)))) < 1e-18);
  }
}

BOOST_AUTO_TEST_CASE(moves_are_those_of_the_model) {
  const auto mb = robot();
  const std::vector<double> q = random_numbers(mb->nq(), 3), u = random_numbers(mb->nv(), 4);
  std::vector<double> expected(q.size()), out = q;
  mb->integrate(q.data(), u.data(), expected.data());
  move_configuration(*mb->compiled<double>(), out.data(), u.data(), out.data());  // in place
  for (size_t i = 0; i < q.size(); ++i) BOOST_TEST(std::abs(out[i] - expected[i]) < 1e-15);
}

namespace {

class Oscillator : public ExplicitEquations<double> {
 public:
  explicit Oscillator(const CompiledModel<double>& model) : ExplicitEquations<double>(model, 0) {}
  void evaluate(const double&, const double* q, const double* v, const double*, double* vdot, double*) override {
    ++evaluations;
    at_q_ = q, at_v_ = v;
    vdot[0] = -q[0];
  }
};

}  // namespace

// Accelerations may be anybody's: a harmonic oscillator needs no scene.
BOOST_AUTO_TEST_CASE(equations_of_ones_own) {
  const auto mb = std::make_shared<Multibody>("oscillator");
  Body b;
  b.name = "b";
  b.mass = 1;
  b.hinge.kind = HingeKind::slider;
  b.hinge.subhinges = subhinges_of(HingeKind::slider, {{1, 0, 0}}, {0, 0, 0}, 0, "b");
  mb->add_body(b, "");
  const auto model = mb->compiled<double>();
  for (const Integrator integrator : integrators_by(Way::at_states)) {
    Oscillator equations(*model);
    double end = 0;
    const IntegrationCost cost = integrate<double>(equations, {1, 0}, {0, 1}, {integrator, 1e-11, 1e-12, 1e-3}, [&](const double&, const std::vector<double>& x) { end = x[0]; });
    BOOST_TEST(std::abs(end - std::cos(1.0)) < 1e-9, integrator_name(integrator));
    BOOST_TEST(cost.evaluations > 0);
  }
  Oscillator equations(*model);  // a step of an implicit method takes more than accelerations at states
  BOOST_CHECK_THROW(integrate<double>(equations, {1, 0}, {0, 1}, {Integrator::variational2, 1e-11, 1e-12, 1e-3}, [](const double&, const std::vector<double>&) {}), EvaluationError);
}
