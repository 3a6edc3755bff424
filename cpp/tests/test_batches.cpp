// Direct calls on batches, their checks, and what acts on a model from outside.
#define BOOST_TEST_MODULE batches
#include <boost/test/included/unit_test.hpp>

#include <algorithm>
#include <cmath>

#include "dynamics/batch_dynamics.h"
#include "dynamics/batch_sensitivities.h"
#include "tests/robot.h"

using namespace pycraft;
using testing::random_numbers;
using testing::robot;

namespace {

struct States {
  std::vector<double> q, v, tau;
  int batch;
};

States states(const Multibody& model, int batch) {
  States s{{}, random_numbers(batch * model.nv(), 2), random_numbers(batch * model.nv(), 3), batch};
  for (int b = 0; b < batch; ++b) {
    std::vector<double> q = model.zero_q();
    const std::vector<double> more = random_numbers(model.nq(), 10 + b);
    for (size_t i = 0; i < q.size(); ++i) q[i] += more[i];
    s.q.insert(s.q.end(), q.begin(), q.end());
  }
  return s;
}

Given of(const char* name, const std::vector<double>& data, int width, int batch) { return {name, data.data(), width, batch}; }

double largest(const std::vector<double>& x) {
  double most = 0;
  for (double y : x) most = std::max(most, std::abs(y));
  return most;
}
double furthest(const std::vector<double>& x, const std::vector<double>& y) {
  double most = 0;
  for (size_t i = 0; i < x.size(); ++i) most = std::max(most, std::abs(x[i] - y[i]));
  return most;
}

template <class F>
std::string message(F f) {
  try {
    f();
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

std::vector<Vector6<double>> wrenches(int bodies) {
  std::vector<Vector6<double>> all(bodies);
  for (int k = 0; k < bodies; ++k) {
    const std::vector<double> x = random_numbers(6, 40 + k);
    for (int i = 0; i < 6; ++i) all[k][i] = 10 * x[i];
  }
  return all;
}

// Σ Jᵀ w over the bodies: the generalized forces of the wrenches.
std::vector<double> generalized(const Multibody& model, const double* q, const std::vector<Vector6<double>>& w) {
  RigidDynamics<double> one(model);
  std::vector<double> J(size_t(6) * model.nv()), T(model.nv(), 0.0);
  for (int k = 0; k < model.bodies(); ++k) {
    one.jacobian(Node{"", k, Pose<double>::identity()}, q, J.data());
    for (int j = 0; j < model.nv(); ++j)
      for (int i = 0; i < 6; ++i) T[j] += J[size_t(i) * model.nv() + j] * w[k][i];
  }
  return T;
}

// What roundings of the forces can make of accelerations: the rows of (ℳ + J)⁻¹, added up in absolute values.
double compliance(const Multibody& model, const double* q) {
  RigidDynamics<double> one(model);
  const int n = model.nv();
  std::vector<double> inverse(size_t(n) * n);
  one.mass_matrix_inverse(q, inverse.data());
  double most = 0;
  for (int i = 0; i < n; ++i) {
    double row = 0;
    for (int j = 0; j < n; ++j) row += std::abs(inverse[size_t(i) * n + j]);
    most = std::max(most, row);
  }
  return most;
}

}  // namespace

BOOST_AUTO_TEST_CASE(a_batch_is_its_states_one_by_one) {
  const auto model = robot();
  BatchDynamics calls(model);
  const int nq = model->nq(), nv = model->nv(), batch = 11;  // packs, and some left over
  const States s = states(*model, batch);
  RigidDynamics<double> one(*model);
  for (const Form form : forms) {
    std::vector<double> all(batch * nv), expected(nv);
    calls.forward_dynamics(of("q", s.q, nq, batch), of("v", s.v, nv, batch), of("tau", s.tau, nv, batch), {form}, Precision::double_, all.data());
    for (int b = 0; b < batch; ++b) {
      one.forward_dynamics(&s.q[size_t(b) * nq], &s.v[size_t(b) * nv], &s.tau[size_t(b) * nv], expected.data(), {form});
      const double bound = 1e3 * nv * epsilon<double>() * compliance(*model, &s.q[size_t(b) * nq]) * 100;
      BOOST_TEST(furthest({all.begin() + b * nv, all.begin() + (b + 1) * nv}, expected) < bound);
    }
  }
  // One state's forces for all of a batch.
  std::vector<double> shared(batch * nv), last(nv);
  calls.forward_dynamics(of("q", s.q, nq, batch), of("v", s.v, nv, batch), of("tau", s.tau, nv, -1), {}, Precision::quad, shared.data());
  one.forward_dynamics(&s.q[size_t(batch - 1) * nq], &s.v[size_t(batch - 1) * nv], s.tau.data(), last.data());
  BOOST_TEST(furthest({shared.end() - nv, shared.end()}, last) < 1e-9 * (1 + largest(last)));
  std::vector<double> M(nv * nv), direct(nv * nv);
  calls.mass_matrix(of("q", s.q, nq, -1), Precision::double_, M.data());
  one.mass_matrix(s.q.data(), direct.data());
  BOOST_TEST(furthest(M, direct) <= 40 * nv * epsilon<double>() * largest(direct));  // by kernels, and by the general recursion
}

BOOST_AUTO_TEST_CASE(what_is_given_is_checked) {
  const auto model = robot();
  BatchDynamics calls(model);
  const int nq = model->nq(), nv = model->nv();
  States s = states(*model, 3);
  std::vector<double> out(3 * nv * nv);
  const auto mass_matrix = [&](const Given& q) { return message([&] { calls.mass_matrix(q, Precision::double_, out.data()); }); };
  BOOST_TEST(mass_matrix(of("q", s.q, nq - 1, 3)) == "q of 'robot' takes " + std::to_string(nq) + " numbers, or (B, " + std::to_string(nq) + ") for a batch");
  const auto forward = [&](const Given& v) {
    return message([&] { calls.forward_dynamics(of("q", s.q, nq, 3), v, of("tau", s.tau, nv, 3), {}, Precision::double_, out.data()); });
  };
  BOOST_TEST(forward(of("v", s.v, nv, 2)) == "batches of 3 and 2 states in one call");
  s.v[nv + 6] = std::nan("");
  BOOST_TEST(forward(of("v", s.v, nv, 3)).find("v of hinge 'hinge1'") == 0);
  s.q[2 * nq + 0] = s.q[2 * nq + 1] = s.q[2 * nq + 2] = s.q[2 * nq + 3] = 0;
  BOOST_TEST(mass_matrix(of("q", s.q, nq, 3)).find("q of hinge 'hinge0': its quaternion has length 0") == 0);
  BOOST_TEST(message([&] { calls.refinement(of("q", s.q, nq, 3), of("v", s.v, nv, 3), of("tau", s.tau, nv, 3), {}, Precision::double_, out.data()); })
                 .find("a batch has as many as states") != std::string::npos);
  BatchSensitivities sensitivities(model);
  std::vector<double> dq(nv * nv * nv);
  BOOST_TEST(message([&] { sensitivities.run(Precision::digits50, {of("q", s.q, nq, -1)}, nv * nv * nv, dq.data(), [](auto& w, auto in, auto* y) { w.mass_matrix(in[0], y); }); }) ==
             to_quad);
}

BOOST_AUTO_TEST_CASE(no_states_and_no_coordinates) {
  const auto model = robot();
  BatchDynamics calls(model);
  const std::vector<double> none;
  double untouched = 7;
  calls.mass_matrix(of("q", none, model->nq(), 0), Precision::double_, &untouched);
  BOOST_TEST(untouched == 7);
  const auto welded = std::make_shared<Multibody>("welded", true);
  Body b;
  b.name = b.hinge.name = "plate";
  b.mass = 2;
  welded->add_body(b, "");
  BatchDynamics still(welded);
  const std::vector<Vector6<double>> w = wrenches(1);
  const Applied<double> applied{{0, 0, -1}, w.data()};
  const Given nothing{"v", none.data(), 0, -1}, at{"q", none.data(), 0, -1};
  still.forward_dynamics(at, nothing, {"tau", none.data(), 0, -1}, {}, Precision::double_, &untouched, &applied);
  still.inverse_dynamics(at, nothing, nullptr, Precision::double_, &untouched, &applied);
  BOOST_TEST(untouched == 7);
}

BOOST_AUTO_TEST_CASE(gravity_is_an_argument) {
  const auto model = robot(), other = robot();
  const Vector3<double> moon{0.3, -0.2, -1.62};
  other->set_gravity(moon);
  BatchDynamics calls(model), expected(other);
  const int nq = model->nq(), nv = model->nv(), batch = 5;
  const States s = states(*model, batch);
  const Given q = of("q", s.q, nq, batch), v = of("v", s.v, nv, batch), tau = of("tau", s.tau, nv, batch);
  const Applied<double> applied{moon};
  for (const Precision precision : {Precision::single, Precision::double_, Precision::quad})
    for (const Form form : forms)
      for (const int steps : {0, 1}) {
        Solving how{form};
        how.refinement.steps = steps;
        std::vector<double> a(batch * nv), b(batch * nv);
        calls.forward_dynamics(q, v, tau, how, precision, a.data(), &applied);
        expected.forward_dynamics(q, v, tau, how, precision, b.data());
        BOOST_TEST(a == b);
        calls.inverse_dynamics(q, v, &tau, precision, a.data(), &applied);
        expected.inverse_dynamics(q, v, &tau, precision, b.data());
        BOOST_TEST(a == b);
      }
  Sensitivities<double> here(*model), there(*other);
  std::vector<double> dq(nv * nv), dv(nv * nv), dt(nv * nv), eq(nv * nv), ev(nv * nv), et(nv * nv);
  here.inverse_dynamics(s.q.data(), s.v.data(), s.tau.data(), dq.data(), dv.data(), &moon);
  there.inverse_dynamics(s.q.data(), s.v.data(), s.tau.data(), eq.data(), ev.data());
  BOOST_TEST(dq == eq);
  BOOST_TEST(dv == ev);
  for (const Form form : {Form::fast, Form::ud}) {
    here.forward_dynamics(s.q.data(), s.v.data(), s.tau.data(), {form}, dq.data(), dv.data(), dt.data(), &moon);
    there.forward_dynamics(s.q.data(), s.v.data(), s.tau.data(), {form}, eq.data(), ev.data(), et.data());
    BOOST_TEST(dq == eq);
    BOOST_TEST(dv == ev);
    BOOST_TEST(dt == et);
  }
  here.hamiltonian(s.q.data(), s.v.data(), s.tau.data(), dq.data(), dv.data(), &moon);
  there.hamiltonian(s.q.data(), s.v.data(), s.tau.data(), eq.data(), ev.data());
  BOOST_TEST(dq == eq);
  BOOST_TEST(dv == ev);
  RigidDynamics<double> one(*model), two(*other);
  BOOST_TEST(one.potential_energy(s.q.data(), {1, 2, 3}, &moon) == two.potential_energy(s.q.data(), {1, 2, 3}));
}

BOOST_AUTO_TEST_CASE(wrenches_on_bodies_are_the_forces_that_their_jacobians_give) {
  const auto model = robot();
  BatchDynamics calls(model);
  const int nq = model->nq(), nv = model->nv(), batch = 9;
  const States s = states(*model, batch);
  const std::vector<Vector6<double>> w = wrenches(model->bodies());
  const Applied<double> applied{model->gravity(), w.data()};
  const Given q = of("q", s.q, nq, batch), v = of("v", s.v, nv, batch), tau = of("tau", s.tau, nv, batch);
  std::vector<double> pushed = s.tau;
  double rounding = 0;  // of forces, in double
  for (int b = 0; b < batch; ++b) {
    const std::vector<double> T = generalized(*model, &s.q[size_t(b) * nq], w);
    for (int j = 0; j < nv; ++j) pushed[size_t(b) * nv + j] += T[j];
    rounding = std::max(rounding, 200 * nv * epsilon<double>() * (largest(T) + 100) * compliance(*model, &s.q[size_t(b) * nq]));
  }
  const Given instead = of("tau", pushed, nv, batch);
  using R = ResidualPrecision;
  for (const Form form : forms)
    for (const auto& [steps, residual] : {std::pair{0, R::same}, std::pair{2, R::same}, std::pair{2, R::gather}, std::pair{2, R::wider}}) {
      Solving how{form};
      how.refinement.steps = steps, how.refinement.residual = residual;
      std::vector<double> a(batch * nv), b(batch * nv);
      calls.forward_dynamics(q, v, tau, how, Precision::double_, a.data(), &applied);
      calls.forward_dynamics(q, v, instead, how, Precision::double_, b.data());
      BOOST_TEST(furthest(a, b) < rounding);
      BOOST_TEST(largest(b) > 1e3 * rounding);  // and not for want of forces
    }
  std::vector<double> a(batch * nv), b(batch * nv);
  calls.inverse_dynamics(q, v, nullptr, Precision::double_, a.data(), &applied);
  calls.inverse_dynamics(q, v, nullptr, Precision::double_, b.data());
  for (size_t i = 0; i < a.size(); ++i) BOOST_TEST(std::abs(a[i] - (b[i] - (pushed[i] - s.tau[i]))) < 1e-11);
}
