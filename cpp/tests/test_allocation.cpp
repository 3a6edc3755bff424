// A run of the engine, of every kind of step, and every direct call allocate nothing after the first.
#define BOOST_TEST_MODULE allocation
#include <boost/test/included/unit_test.hpp>
#include <cmath>
#include <limits>
#include <set>

#include "algebra/engine/evaluate.h"
#include "algebra/engine/packs.h"
#include "algebra/language/display.h"
#include "algebra/planning/explain.h"
#include "algebra/planning/square_root.h"
#include "allocations.h"
#include "dynamics/batch_dynamics.h"
#include "dynamics/packed_dynamics.h"
#include "dynamics/rigid_dynamics.h"
#include "dynamics/sensitivities.h"
#include "operators/directions.h"
#include "operators/multibody_operators.h"
#include "random_tree.h"
#include "robot.h"

using namespace pycraft;
using namespace pycraft::testing;

BOOST_AUTO_TEST_CASE(counting_counts) {
  // Seen from outside, or an optimiser may leave out an allocation that nobody reads.
  static std::vector<double>* volatile seen = nullptr;
  std::vector<double> numbers;
  seen = &numbers;
  if (allocations_are_counted) BOOST_TEST(allocations_of([] { *seen = std::vector<double>(100); }) > 0);
}

namespace {

// Every request of one expression; the kinds of steps that ran are noted.
void check_runs(const Expression& e, std::set<StepKind>& seen, bool rules = true) {
  const bool square = e.domain().dimension() == e.codomain().dimension();
  for (const Request request : {Request::apply, Request::dense, Request::block_diagonal, Request::diagonal, Request::trace, Request::logdet, Request::norm})
    for (int columns : {1, 3}) {
      if (!square && request != Request::apply && request != Request::dense && request != Request::norm) continue;
      if (request != Request::apply && columns > 1) continue;
      const std::vector<double> x(size_t(e.domain().dimension()) * columns, 0.5);
      Inputs inputs;
      if (request == Request::apply) inputs.x = x.data(), inputs.columns = columns;
      Result r;
      std::shared_ptr<ExecutionPool> pool;
      try {
        pool = prepare(e, request, rules);
        pool->run(inputs, false, r);
      } catch (const Error&) {  // no trace of what maps a space to another, no ln det of what is singular
        continue;
      }
      for (const Step& step : pool->plan().steps) seen.insert(step.kind);
      BOOST_TEST(allocations_of([&] { pool->run(inputs, false, r); }) == 0, show(e) << ", request " << int(request) << "\n" << explain(pool->plan()));
    }
}

Expression dense_constant(const Space& domain, const Space& codomain) {
  std::vector<double> entries(size_t(domain.dimension()) * codomain.dimension());
  for (size_t i = 0; i < entries.size(); ++i) entries[i] = std::sin(double(i) * double(i));  // of full rank
  return constant(entries, domain, codomain, "C");
}

}  // namespace

BOOST_AUTO_TEST_CASE(runs_of_plans) {
  const auto mb = robot();
  mb->set_v(std::vector<double>(mb->nv(), 0.3));
  mb->set_gravity({0, 0, -9.81});
  const auto source = operators_of(mb);
  const Letters o(source);
  const Expression MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
  const Letters m(random_tree(1, {-1, 0, 1, 1, 0, 4, -1}));
  const Expression MMm = m.H * m.phi * m.M * m.phi.T() * m.H.T();
  std::vector<int> chain(150);
  for (int k = 0; k < 150; ++k) chain[k] = k - 1;
  const Expression long_phi = Letters(random_tree(2, chain)).phi;
  const Expression C = dense_constant(MM.domain(), MM.codomain()), I = identity(MM.domain());
  const auto mechanics = [&](SymbolId id) { return mechanics_operator(id, source); };
  const Expression crf_V = mechanics(SymbolId::V_bar), a = mechanics(SymbolId::coriolis_acceleration), b = mechanics(SymbolId::gyroscopic_force);
  auto twice = std::make_shared<ExternalData>();
  const int n = MM.domain().dimension();
  twice->apply = twice->apply_transposed = [n](const double* x, double* y, int columns) {
    for (int i = 0; i < n * columns; ++i) y[i] = 2 * x[i];
  };
  const auto in_factors = std::make_shared<Binding>();
  in_factors->nq = mb->nq(), in_factors->nv = mb->nv(), in_factors->q = mb->state()->q, in_factors->v = mb->state()->v;
  in_factors->arithmetic.form = Form::ud;
  std::set<StepKind> seen;
  for (const Expression& e : {o.phi, o.psi.T(), o.K, o.Omega, o.D.inv(), o.tau_bar, MM, MM.inv(), (MM + 0.1 * o.I).inv(), block_diagonal(o.Omega), (MM.inv() + 0.01 * o.D).inv(),
                              MMm, MMm.inv(), m.psi, (MMm + 0.1 * m.I).inv(), square_root(o.D), lower_half(o.D), zero(MM.domain(), MM.codomain()), C * MM, (dense_constant(o.phi.domain(), o.phi.codomain()) + o.phi).inv(),
                              block_diagonal((C + MM).inv()), block_diagonal(o.phi * o.M * o.phi.T()), block_diagonal(o.psi.T() * o.Upsilon * o.psi), 2 * I - MM, (o.D + 0.1 * I).inv(),
                              MM.inv() + external(twice, MM.domain(), MM.codomain()), crf_V * o.phi, o.M * a + b, a * a.T(), block_diagonal(o.E * o.M * o.E.T()),
                              block_diagonal((MM + 0.1 * o.I).inv()), o.phi * o.M, long_phi, differentiate(MM, *coordinate_direction(source, 2)), differentiate(MM.inv(), *coordinate_direction(source, 2)),
                              differentiate(MM.inv(), *coordinate_direction(source, 7)).at(in_factors), differentiate(MM.inv(), *time_direction(source, {})).at(in_factors)})
    for (const bool rules : {true, false}) check_runs(e, seen, rules);
  for (int kind = 0; kind < step_kinds; ++kind)
    BOOST_TEST(seen.count(StepKind(kind)) == 1, "no run had a step " << step_kind_name(StepKind(kind)));
}

// Factors are made anew at every state, by elimination, too: what they stand in is kept. In packs it is the batch that takes some memory, whatever
// its length.
BOOST_AUTO_TEST_CASE(states_of_a_batch) {
  const auto mb = robot();
  const auto source = operators_of(mb);
  const Letters o(source);
  const Expression MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
  const auto batch_of = [&](int states) {
    const auto binding = std::make_shared<Binding>();
    binding->batch = states, binding->nq = mb->nq(), binding->nv = mb->nv();
    std::vector<double> along(mb->nv()), q(mb->nq());
    for (int b = 0; b < states; ++b) {
      for (int i = 0; i < mb->nv(); ++i) along[i] = std::sin(0.3 * b + i);
      mb->integrate(mb->zero_q().data(), along.data(), q.data());
      binding->q.insert(binding->q.end(), q.begin(), q.end()), binding->v.insert(binding->v.end(), along.begin(), along.end());
    }
    return binding;
  };
  const std::vector<double> x(MM.domain().dimension(), 0.5);
  const auto counted = [&](const Expression& e, int states) {
    const Expression bound = e.at(batch_of(states));
    const auto pool = prepare(bound, Request::apply, true);
    Inputs inputs;
    inputs.x = x.data();
    Result r;
    return allocations_of([&] { pool->run(inputs, false, r); });
  };
  for (const Expression& e : {MM.inv(), (MM + 0.1 * o.I).inv(), (MM.inv() + 0.01 * o.D).inv(), (o.D + 0.1 * o.I).inv(), differentiate((MM + 0.1 * o.I).inv(), *coordinate_direction(source, 2))}) {
    const int before = Packs::record_from(std::numeric_limits<int>::max());
    BOOST_TEST(counted(e, 7) == 0, show(e) << " allocates " << counted(e, 7));
    Packs::record_from(1);
    BOOST_TEST(counted(e, 64) == counted(e, 512), show(e));
    Packs::record_from(before);
  }
}

// A tip so light that only the error sweep can tell whether its pivots are noise.
BOOST_AUTO_TEST_CASE(pivots_in_doubt) {
  const auto mb = robot();
  mb->set_mass_properties(5, 1e-9, {1e-3, 0, 0}, {1e-15, 0, 0, 1e-15, 0, 1e-15});
  RigidDynamics<double> w(*mb);
  const std::vector<double> q = mb->zero_q(), v(mb->nv(), 0.3), tau(mb->nv(), 0.1);
  std::vector<double> out(mb->nv());
  BOOST_TEST(allocations_of([&] { w.forward_dynamics(q.data(), v.data(), tau.data(), out.data()); }) == 0);
}

BOOST_AUTO_TEST_CASE(forms_refinement_and_packs) {
  const auto mb = robot();
  constexpr int width = PackedDynamics<double>::width;
  const int nq = mb->nq(), nv = mb->nv();
  std::vector<double> q, v(size_t(width) * nv), tau(v.size(), 0.1), packed(v.size()), alone(nv);
  for (int b = 0; b < width; ++b) {
    const std::vector<double> zero = mb->zero_q();
    std::vector<double> moved(nq);
    for (int i = 0; i < nv; ++i) v[size_t(b) * nv + i] = 0.3 - 0.1 * b + 0.01 * i;
    mb->integrate(zero.data(), v.data() + size_t(b) * nv, moved.data());
    q.insert(q.end(), moved.begin(), moved.end());
  }
  RigidDynamics<double> w(*mb);
  PackedDynamics<double> pack(*mb);
  for (const Form form : forms) {
    for (const Refinement refinement : {Refinement{0}, Refinement{2}, Refinement{2, ResidualPrecision::gather}, Refinement{Refinement::automatic, ResidualPrecision::wider}}) {
      const Solving how{form, refinement, OnSingular::raise};
      BOOST_TEST(allocations_of([&] { w.forward_dynamics(q.data(), v.data(), tau.data(), alone.data(), how); }) == 0, form_name(form));
    }
    if (form == Form::square_root) continue;
    BOOST_TEST(allocations_of([&] { BOOST_TEST(pack.forward_dynamics(q.data(), nq, v.data(), nv, tau.data(), nv, packed.data(), form)); }) == 0, form_name(form));
    for (int b = 0; b < width; ++b) {  // the same operations in the same order
      w.forward_dynamics(q.data() + size_t(b) * nq, v.data() + size_t(b) * nv, tau.data(), alone.data(), Solving{form, {}, OnSingular::raise});
      for (int i = 0; i < nv; ++i) BOOST_TEST(packed[size_t(b) * nv + i] == alone[i], boost::test_tools::tolerance(1e-12));
    }
  }
}

BOOST_AUTO_TEST_CASE(direct_calls) {
  const auto mb = robot();
  mb->set_gravity({0, 0, -9.81});
  mb->set_rotor_inertia(1, {0.3});
  mb->add_node("tool", "body5", Pose<double>::identity());
  const size_t n = size_t(mb->nv());
  const std::vector<double> q = mb->zero_q(), v(n, 0.3), tau(n, 0.1);
  std::vector<double> out(n * n * n), dq(n * n * n), dv(n * n), dtau(n * n);
  const Node tool = mb->node(mb->node_index("tool"));
  const auto quiet = [](auto f, const char* name) { BOOST_TEST(allocations_of(f) == 0, name); };

  RigidDynamics<double> w(*mb);
  quiet([&] { w.forward_dynamics(q.data(), v.data(), tau.data(), out.data()); }, "forward dynamics");
  quiet([&] { w.inverse_dynamics(q.data(), v.data(), tau.data(), out.data()); }, "inverse dynamics");
  quiet([&] { w.inverse_dynamics(q.data(), v.data(), nullptr, out.data()); }, "bias forces");
  quiet([&] { w.mass_matrix(q.data(), out.data()); }, "mass matrix");
  for (const Form form : forms)
    for (const Refinement refinement : {Refinement{0}, Refinement{2}, Refinement{1, ResidualPrecision::gather}, Refinement{1, ResidualPrecision::wider}})
      quiet([&] { w.mass_matrix_inverse(q.data(), out.data(), Solving{form, refinement, OnSingular::raise}); }, "mass matrix inverse");
  quiet([&] { w.jacobian(tool, q.data(), out.data()); }, "jacobian");
  quiet([&] { out[0] = w.pose(tool, q.data()).p[0]; }, "pose");
  quiet([&] { out[0] = w.kinetic_energy(q.data(), v.data()); }, "kinetic energy");
  quiet([&] { out[0] = w.potential_energy(q.data()); }, "potential energy");

  Sensitivities<double> s(*mb);
  quiet([&] { s.inverse_dynamics(q.data(), v.data(), tau.data(), dq.data(), dv.data()); }, "derivatives of inverse dynamics");
  for (const Form form : forms)
    quiet([&] { s.forward_dynamics(q.data(), v.data(), tau.data(), Solving{form, {}, OnSingular::raise}, dq.data(), dv.data(), dtau.data()); },
          "derivatives of forward dynamics");
  quiet([&] { s.mass_matrix(q.data(), out.data()); }, "derivative of the mass matrix");
  quiet([&] { s.christoffel(q.data(), out.data()); }, "Christoffel symbols");
  for (const bool skew : {false, true}) quiet([&] { s.coriolis_matrix(q.data(), v.data(), skew, out.data()); }, "Coriolis matrix");
  quiet([&] { s.kinetic_energy(q.data(), v.data(), dq.data(), dv.data()); }, "derivatives of the kinetic energy");
  quiet([&] { s.hamiltonian(q.data(), v.data(), tau.data(), dq.data(), dv.data()); }, "Hamilton's equations");
  quiet([&] { s.momentum(q.data(), v.data(), out.data(), dq.data()); }, "momentum");
  quiet([&] { s.jacobian_rate(tool, q.data(), v.data(), out.data()); }, "rate of the Jacobian");
  std::vector<double> wide(6 * n * n + 10 * n * size_t(mb->bodies()));
  quiet([&] { s.jacobian_derivative(tool, q.data(), wide.data()); }, "derivative of the Jacobian");
  quiet([&] { s.inertial_regressor(q.data(), v.data(), tau.data(), wide.data()); }, "regressor");
  BatchDynamics kernels(mb);
  const Node both[] = {tool, mb->node(mb->node_index("body2"))};
  const Given at{"q", q.data(), mb->nq()}, moving{"v", v.data(), mb->nv()};
  for (const bool flag : {false, true}) {
    quiet([&] { kernels.coriolis_matrix(flag, at, moving, out.data()); }, "Coriolis matrix by kernels");
    quiet([&] { kernels.operational_space(flag, both, at, wide.data()); }, "operational space");
  }
  std::vector<double> inertias(10 * size_t(mb->bodies())), geometry(6 * size_t(mb->bodies())), axes(6 * n);
  quiet([&] { s.log_determinant(q.data(), dq.data(), inertias.data(), geometry.data(), axes.data()); }, "gradient of the log determinant");
}
