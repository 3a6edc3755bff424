// Forward dynamics by divide and conquer: the articulated-body algorithm's accelerations in every scalar, the same bits in any number of threads.
#define BOOST_TEST_MODULE divide_and_conquer
#include <boost/test/included/unit_test.hpp>

#include <cmath>

#include "allocations.h"
#include "dynamics/divided_dynamics.h"
#include "dynamics/rigid_dynamics.h"
#include "robot.h"
#include "runtime/errors.h"

using namespace pycraft;
using namespace pycraft::testing;

namespace {

struct Shape {
  int bodies = 100;
  int reach = 1;          // a body hangs on one of so many before it
  bool massless = false;  // every third body, on a pin that meets the next one's
  bool rotors = false;
};

// Hinges of every kind, bodies with their frames half a metre apart.
std::shared_ptr<Multibody> mechanism(const Shape& shape, int seed) {
  constexpr HingeKind kinds[] = {HingeKind::pin, HingeKind::ball, HingeKind::slider, HingeKind::weld, HingeKind::screw, HingeKind::universal, HingeKind::pin};
  auto mb = std::make_shared<Multibody>("mechanism");
  std::mt19937 g(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  bool after_massless = false;
  for (int k = 0; k < shape.bodies; ++k) {
    const bool massless = shape.massless && k % 3 == 1 && shape.bodies > k + 1;
    const HingeKind kind = k == 0 ? HingeKind::free : massless || after_massless ? HingeKind::pin : kinds[g() % 7];
    Body b;
    b.name = "body" + std::to_string(k);
    if (!massless) b.mass = 1 + 0.5 * uniform(g), b.com = {0.2 * uniform(g), 0.3, 0.1}, b.inertia = {0.1, 0.01, 0, 0.12, 0, 0.09};
    b.hinge.kind = kind;
    b.hinge.name = "hinge" + std::to_string(k);
    if (!after_massless) b.hinge.placement.p = {0.5, 0.1 * uniform(g), 0.1 * uniform(g)};
    const double turn = uniform(g);
    const Vector3<double> axis{std::cos(turn), 0, std::sin(turn)}, across{0, 1, 0};
    std::vector<Vector3<double>> axes;
    if (kind == HingeKind::pin || kind == HingeKind::slider || kind == HingeKind::screw) axes = {after_massless ? across : axis};
    if (kind == HingeKind::universal) axes = {axis, across};
    b.hinge.subhinges = subhinges_of(kind, axes, {0, 0, 0}, kind == HingeKind::screw ? 0.3 : 0, b.hinge.name);
    const int coordinates = kind == HingeKind::ball ? 3 : kind == HingeKind::universal ? 2 : kind == HingeKind::weld ? 0 : 1;
    if (shape.rotors && k > 0) b.hinge.rotor_inertia.assign(coordinates, 0.3);
    const int parent = after_massless || k == 0 ? k - 1 : k - 1 - int(g() % unsigned(std::min(k, shape.reach)));
    mb->add_body(b, parent < 0 ? "" : "body" + std::to_string(parent));
    after_massless = massless;
  }
  mb->set_gravity({1, 2, -9.81});
  return mb;
}

template <class S>
struct Problem {
  std::shared_ptr<Multibody> mb;
  std::vector<S> q, v, tau;
  std::vector<Vector6<S>> wrenches;
  Applied<S> applied;

  Problem(std::shared_ptr<Multibody> of, int seed) : mb(std::move(of)), wrenches(mb->bodies()), applied(own_gravity(*mb->compiled<S>())) {
    const std::vector<double> zero = mb->zero_q(), step = random_numbers(mb->nv(), seed), rates = random_numbers(mb->nv(), seed + 1);
    std::vector<double> at(zero.size());
    mb->integrate(zero.data(), step.data(), at.data());
    convert(at.data(), at.size(), q);
    convert(rates.data(), rates.size(), v);
    convert(random_numbers(mb->nv(), seed + 2).data(), rates.size(), tau);
    const std::vector<double> forces = random_numbers(6 * int(wrenches.size()), seed + 3);
    for (size_t k = 0; k < wrenches.size(); ++k)
      for (int i = 0; i < 6; ++i) wrenches[k][i] = S(forces[6 * k + i]);
    applied.wrenches = wrenches.data();
  }
  std::vector<S> divided(DividedDynamics<S>& w, int threads = 1) const {
    std::vector<S> out(v.size());
    w.forward_dynamics(q.data(), v.data(), tau.data(), out.data(), applied, threads);
    return out;
  }
};

// |divided - articulated in a wider scalar| over what that is, in the 2-norm.
template <class S>
double error(const std::shared_ptr<Multibody>& mb, int seed) {
  const Problem<S> problem(mb, seed);
  const Problem<double> exact(mb, seed);  // numbers that single precision rounds at the most
  DividedDynamics<S> w(*mb);
  const std::vector<S> found = problem.divided(w);
  std::vector<Wider<S>> expected(found.size());
  RigidDynamics<Wider<S>>(*mb).forward_dynamics(exact.q.data(), exact.v.data(), exact.tau.data(), expected.data(), {}, &exact.applied);
  double squares = 0, all = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    squares += std::pow(to_double(Wider<S>(Wider<S>(found[i]) - expected[i])), 2);
    all += std::pow(to_double(expected[i]), 2);
  }
  return std::sqrt(squares / all);
}

}  // namespace

// What is regular and well proportioned keeps all digits but three, whatever the tree; in every scalar, so that nothing in it is a double.
BOOST_AUTO_TEST_CASE(every_tree_in_every_scalar) {
  const Shape shapes[] = {{1}, {2}, {3}, {40, 1}, {40, 3}, {60, 60}, {41, 1, true}, {60, 5, true}, {40, 2, false, true}, {41, 1, true, true}};
  for (const Shape& shape : shapes)
    for (int seed = 0; seed < 3; ++seed) {
      const auto mb = mechanism(shape, seed);
      BOOST_TEST(error<Single>(mb, seed) < 1e3 * to_double(epsilon<Single>()), shape.bodies << " single, seed " << seed);
      BOOST_TEST(error<double>(mb, seed) < 1e3 * to_double(epsilon<double>()), shape.bodies << " double, seed " << seed);
      BOOST_TEST(error<Extended>(mb, seed) < 1e3 * to_double(epsilon<Extended>()), shape.bodies << " extended, seed " << seed);
      BOOST_TEST(error<Quad>(mb, seed) < 1e3 * to_double(epsilon<Quad>()), shape.bodies << " quad, seed " << seed);
      if (seed == 0) BOOST_TEST(error<Digits50>(mb, seed) < 1e3 * to_double(epsilon<Digits50>()), shape.bodies << " 50 digits");
    }
}

BOOST_AUTO_TEST_CASE(threads_change_no_bit) {
  for (const int reach : {1, 4, 3000}) {
    const auto mb = mechanism({3000, reach}, reach);
    const Problem<double> problem(mb, 5);
    DividedDynamics<double> w(*mb);
    const std::vector<double> alone = problem.divided(w);
    for (const int threads : {2, 3, 7, 1, 16}) BOOST_TEST((problem.divided(w, threads) == alone), threads << " threads");
  }
}

BOOST_AUTO_TEST_CASE(nothing_is_allocated_after_the_first_call) {
  const auto mb = mechanism({200, 3, true}, 1);
  const Problem<double> problem(mb, 6);
  DividedDynamics<double> w(*mb);
  std::vector<double> out(mb->nv());
  BOOST_TEST(allocations_of([&] { w.forward_dynamics(problem.q.data(), problem.v.data(), problem.tau.data(), out.data(), problem.applied, 1); }) == 0);
}

// A tip of 10⁶ times the mass costs 6 of 16 digits: corrections find them again. Of 10¹² the residual shows too few of them, and that is refused. A
// massless tip is refused in the articulated method's words.
BOOST_AUTO_TEST_CASE(what_cannot_be_right_is_refused) {
  for (const double ratio : {1e6, 1e12, 0.0}) {
    auto mb = std::make_shared<Multibody>("tip");
    for (int k = 0; k < 10; ++k) {
      Body b;
      b.name = "body" + std::to_string(k);
      const double of = k == 9 ? ratio : 1;
      b.mass = of, b.com = {0.5 * (of > 0), 0.1 * (of > 0), 0}, b.inertia = {0.02 * of, 0, 0, 0.08 * of, 0, 0.09 * of};
      b.hinge.kind = HingeKind::pin;
      b.hinge.name = "hinge" + std::to_string(k);
      b.hinge.placement.p = {1, 0, 0};
      b.hinge.subhinges = subhinges_of(HingeKind::pin, {{std::sin(k), std::cos(k), 0.3}}, {0, 0, 0}, 0, b.hinge.name);
      mb->add_body(b, k == 0 ? "" : "body" + std::to_string(k - 1));
    }
    const Problem<double> problem(mb, 1);
    DividedDynamics<double> w(*mb);
    const auto says = [](const char* words) { return [words](const Error& e) { return std::string(e.what()).find(words) != std::string::npos; }; };
    if (ratio == 1e6) {
      BOOST_CHECK_NO_THROW(problem.divided(w));
      BOOST_TEST(w.corrections() > 0);
    }
    if (ratio == 1e12) BOOST_CHECK_EXCEPTION(problem.divided(w), SingularOperatorError, says("'divide-and-conquer' loses its digits at hinge 'hinge"));
    if (ratio == 0) BOOST_CHECK_EXCEPTION(problem.divided(w), SingularHingeError, says("hinge 'hinge9' of body 'body9' feels no inertia"));
  }
}
