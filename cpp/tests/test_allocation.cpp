// A run of the engine, and a direct call, allocate nothing after the first. Counted by replacing operator new and, on glibc, malloc.
#define BOOST_TEST_MODULE allocation
#include <atomic>
#include <boost/test/included/unit_test.hpp>
#include <cstdlib>
#include <new>

#include "dynamics/packed_dynamics.h"
#include "dynamics/rigid_dynamics.h"
#include "dynamics/sensitivities.h"
#include "operators/multibody_operators.h"
#include "random_tree.h"

namespace {
std::atomic<long> allocations{0};
}

#if defined(__GLIBC__)
extern "C" void* __libc_malloc(size_t);
extern "C" void* malloc(size_t size) {
  ++allocations;
  return __libc_malloc(size);
}
#else
void* operator new(size_t size) {
  ++allocations;
  if (void* p = std::malloc(size)) return p;
  throw std::bad_alloc();
}
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, size_t) noexcept { std::free(p); }
#endif

using namespace pycraft;
using namespace pycraft::testing;

namespace {

std::shared_ptr<Multibody> robot() {
  auto mb = std::make_shared<Multibody>("robot");
  const HingeKind kinds[] = {HingeKind::free, HingeKind::pin, HingeKind::ball, HingeKind::slider, HingeKind::pin, HingeKind::universal};
  for (int k = 0; k < 6; ++k) {
    Body b;
    b.name = "body" + std::to_string(k);
    b.mass = 1 + k;
    b.com = {0.1, 0.2, 0.05};
    b.inertia = {1, 0.1, 0, 1.2, 0, 0.9};
    b.hinge.kind = kinds[k];
    b.hinge.name = "hinge" + std::to_string(k);
    b.hinge.placement.p = {0.3, 0, 0.1};
    std::vector<Vector3<double>> axes;
    if (kinds[k] == HingeKind::pin || kinds[k] == HingeKind::slider) axes = {{0.6, 0, 0.8}};
    if (kinds[k] == HingeKind::universal) axes = {{1, 0, 0}, {0, 1, 0}};
    b.hinge.subhinges = subhinges_of(kinds[k], axes, {0, 0, 0}, 0, b.hinge.name);
    mb->add_body(b, k == 0 ? "" : k == 4 ? "body1" : "body" + std::to_string(k - 1));
  }
  return mb;
}

template <class F>
long count(F f) {
  f(), f();
  const long before = allocations;
  f();
  return allocations - before;
}

}  // namespace

BOOST_AUTO_TEST_CASE(counting_counts) {
  BOOST_TEST(count([] { std::vector<double>(100).swap(*std::make_unique<std::vector<double>>()); }) > 0);
}

BOOST_AUTO_TEST_CASE(runs_of_plans) {
  const auto mb = robot();
  const Letters o(operators_of(mb));
  const Expression MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
  const Letters m(random_tree(1, {-1, 0, 1, 1, 0, 4, -1}));
  const Expression MMm = m.H * m.phi * m.M * m.phi.T() * m.H.T();
  for (const Expression& e : {o.phi, o.psi.T(), o.K, o.Omega, o.D.inv(), o.tau_bar, MM, MM.inv(), (MM + 0.1 * o.I).inv(), block_diagonal(o.Omega), (MM.inv() + 0.01 * o.D).inv(),
                              MMm, MMm.inv(), m.psi, (MMm + 0.1 * m.I).inv()})
    for (int columns : {1, 3}) {
      const auto pool = prepare(e, Request::apply);
      const std::vector<double> x(size_t(e.domain().dimension()) * columns, 0.5);
      Inputs inputs;
      inputs.x = x.data();
      inputs.columns = columns;
      Result r;
      BOOST_TEST(count([&] { pool->run(inputs, false, r); }) == 0, show(e));
    }
}

// A tip so light that only the error sweep can tell whether its pivots are noise.
BOOST_AUTO_TEST_CASE(pivots_in_doubt) {
  const auto mb = robot();
  mb->set_mass_properties(5, 1e-9, {1e-3, 0, 0}, {1e-15, 0, 0, 1e-15, 0, 1e-15});
  RigidDynamics<double> w(*mb);
  const std::vector<double> q = mb->zero_q(), v(mb->nv(), 0.3), tau(mb->nv(), 0.1);
  std::vector<double> out(mb->nv());
  BOOST_TEST(count([&] { w.forward_dynamics(q.data(), v.data(), tau.data(), out.data()); }) == 0);
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
    for (const Refinement refinement : {Refinement{0, false}, Refinement{2, false}, Refinement{Refinement::automatic, true}}) {
      const Solving how{form, refinement, OnSingular::raise};
      BOOST_TEST(count([&] { w.forward_dynamics(q.data(), v.data(), tau.data(), alone.data(), how); }) == 0, form_name(form));
    }
    if (form == Form::square_root) continue;
    BOOST_TEST(count([&] { BOOST_TEST(pack.forward_dynamics(q.data(), nq, v.data(), nv, tau.data(), nv, packed.data(), form)); }) == 0, form_name(form));
    for (int b = 0; b < width; ++b) {  // the same operations in the same order
      w.forward_dynamics(q.data() + size_t(b) * nq, v.data() + size_t(b) * nv, tau.data(), alone.data(), Solving{form, {}, OnSingular::raise});
      for (int i = 0; i < nv; ++i) BOOST_TEST(packed[size_t(b) * nv + i] == alone[i], boost::test_tools::tolerance(1e-12));
    }
  }
}

BOOST_AUTO_TEST_CASE(direct_calls) {
  const auto mb = robot();
  RigidDynamics<double> w(*mb);
  const std::vector<double> q = mb->zero_q(), v(mb->nv(), 0.3), tau(mb->nv(), 0.1);
  std::vector<double> out(size_t(mb->nv()) * mb->nv());
  BOOST_TEST(count([&] { w.forward_dynamics(q.data(), v.data(), tau.data(), out.data()); }) == 0);
  BOOST_TEST(count([&] { w.inverse_dynamics(q.data(), v.data(), tau.data(), out.data()); }) == 0);
  BOOST_TEST(count([&] { w.mass_matrix(q.data(), out.data()); }) == 0);
  BOOST_TEST(count([&] { w.mass_matrix_inverse(q.data(), out.data()); }) == 0);
  Sensitivities<double> s(*mb);
  std::vector<double> dq(out), dv(out), dtau(out);
  BOOST_TEST(count([&] { s.inverse_dynamics(q.data(), v.data(), tau.data(), dq.data(), dv.data()); }) == 0);
  BOOST_TEST(count([&] { s.forward_dynamics(q.data(), v.data(), tau.data(), dq.data(), dv.data(), dtau.data()); }) == 0);
  BOOST_TEST(count([&] { s.log_determinant(q.data(), dq.data(), nullptr, nullptr, nullptr); }) == 0);
}
