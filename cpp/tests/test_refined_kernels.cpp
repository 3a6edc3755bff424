// Refinement by kernels: of what is right already they find no correction, and are sure of it. Python's tests/dynamics/test_kernels_refined.py has
// what is corrected.
#define BOOST_TEST_MODULE refined_kernels
#include <boost/test/included/unit_test.hpp>

#include <cmath>
#include <new>

#include "dynamics/rigid_dynamics.h"
#include "kernels/instruction_set.h"
#include "kernels/link_model.h"
#include "tests/robot.h"

using namespace pycraft;
using testing::random_numbers;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

// A model with rotors of `rotor` on these bodies, a state of it, and wrenches on all bodies.
struct Case {
  std::shared_ptr<Multibody> model;
  std::vector<double> q, v, tau;
  std::vector<Vector6<double>> wrenches;
  Case(std::shared_ptr<Multibody> of, int seed, const std::vector<int>& turned = {}, double rotor = 0)
      : model(std::move(of)), v(random_numbers(model->nv(), seed)), tau(random_numbers(model->nv(), seed + 1)) {
    for (const int body : turned) model->set_rotor_inertia(body, {rotor});
    q = model->zero_q();
    const std::vector<double> more = random_numbers(model->nq(), seed + 2);
    for (size_t i = 0; i < q.size(); ++i) q[i] += more[i];
    for (int k = 0; k < model->bodies(); ++k) {
      const std::vector<double> x = random_numbers(6, 40 + k);
      wrenches.push_back({{x[0], x[1], x[2]}, {x[3], x[4], x[5]}});
    }
  }
};

struct Free {
  void operator()(double* x) const { ::operator delete(x, std::align_val_t(64)); }
};

std::vector<double> refined(const kernels::Kernel<double>& kernel, const Case& of, unsigned& sound) {
  const auto model = kernels::LinkModel<double>::of(*of.model);
  std::vector<double> on_links, out(of.model->nv());
  model->wrenches_on_links(of.wrenches.data(), on_links);
  const Vector3<double> g = of.model->gravity();
  kernels::States<double> at{of.q.data(), of.v.data(), of.tau.data(), 0, 0, 0, 1, g.v, on_links.data(), [] {}};
  at.steps = 3;
  const std::unique_ptr<double, Free> work(static_cast<double*>(::operator new(kernel.work(model->links(), 0) * sizeof(double), std::align_val_t(64))));
  sound = kernel.run(model->links(), at, out.data(), out.size(), work.get());
  return out;
}

// A chain of these hinges in turn with a side branch, its tip 3·10⁴ times as heavy as the others.
std::shared_ptr<Multibody> heavy_tips(const std::vector<HingeKind>& kinds) {
  auto model = std::make_shared<Multibody>("heavy tips");
  constexpr int n = 12;
  for (int k = 0; k < n; ++k) {
    const HingeKind kind = kinds[k % kinds.size()];
    const bool tip = k == n - 1, turned = kind == HingeKind::pin || kind == HingeKind::slider || kind == HingeKind::screw;
    const double heavy = tip ? 3e4 : 1;
    Body b;
    b.name = "body" + std::to_string(k), b.hinge.name = "hinge" + std::to_string(k);
    b.mass = heavy, b.com = {0.1, 0.2, 0.05}, b.inertia = {heavy, 0.1 * heavy, 0, 1.2 * heavy, 0, 0.9 * heavy};
    b.hinge.kind = kind, b.hinge.placement.p = {0.3, 0.1, 0.2};
    std::vector<Vector3<double>> axes;
    if (turned) axes = {k % 3 == 0 ? Vector3<double>{0.6, 0, 0.8} : k % 3 == 1 ? Vector3<double>{0, 0.6, -0.8} : Vector3<double>{0.48, 0.6, 0.64}};
    const bool free = kind == HingeKind::free;
    b.hinge.subhinges = subhinges_of(kind, axes, free ? Vector3<double>{0, 0, 0} : Vector3<double>{0.1, 0, 0.2}, kind == HingeKind::screw ? 0.3 : 0, b.hinge.name);
    model->add_body(b, k == 0 ? "" : k == 3 ? "body1" : "body" + std::to_string(k - 1));
  }
  model->set_gravity({0, 0, -9.81});
  return model;
}

std::vector<double> exact_accelerations(const Case& of) {
  RigidDynamics<Quad> oracle(*of.model);
  std::vector<Quad> exact(of.v.size());
  const Applied<double> applied{of.model->gravity(), of.wrenches.data()};
  oracle.forward_dynamics(of.q.data(), of.v.data(), of.tau.data(), exact.data(), {}, &applied);
  std::vector<double> rounded;
  for (const Quad& x : exact) rounded.push_back(to_double(x));
  return rounded;
}

// The relative error of the largest acceleration.
double off(const std::vector<double>& found, const std::vector<double>& exact) {
  double most = 0, size = 0;
  for (size_t i = 0; i < exact.size(); ++i) most = std::max(most, std::abs(found[i] - exact[i])), size = std::max(size, std::abs(exact[i]));
  return most / size;
}

// f(set, kernel) of every kernel that refines.
template <class F>
void each_kernel(F f) {
  for (const kernels::InstructionSet& set : kernels::instruction_sets())
    for (const kernels::Call call : {kernels::Call::refined_dynamics, kernels::Call::gathered_dynamics})
      for (const auto* of : {&set.one[call], &set.pack[call]})
        if (of->run) f(set, *of);
}

}  // namespace

// 50 eps: of sums of up to 21 products through six bodies.
BOOST_AUTO_TEST_CASE(what_is_right_has_no_correction) {
  for (const int seed : {1, 5, 9}) {
    const Case of(testing::robot(), seed, {1, 4}, 0.4);
    const std::vector<double> exact = exact_accelerations(of);
    each_kernel([&](const kernels::InstructionSet& set, const kernels::Kernel<double>& kernel) {
      unsigned sound = 0;
      const double left = off(refined(kernel, of, sound), exact);
      BOOST_TEST((sound & 1) == 1, set.name);
      BOOST_TEST(left <= 50 * eps);
    });
  }
}

BOOST_AUTO_TEST_CASE(what_heavy_tips_lose_is_corrected) {
  using K = HingeKind;
  const std::pair<std::vector<K>, std::vector<int>> cases[] = {
      {{K::pin}, {}}, {{K::pin}, {1, 3, 6}}, {{K::pin, K::slider, K::pin}, {}}, {{K::screw, K::pin}, {0, 2, 7}}, {{K::pin, K::ball, K::pin}, {}}};
  for (const auto& [kinds, turned] : cases) {
    double lost = 0;
    int sure = 0;
    for (const int seed : {1, 5, 9, 13}) {
      const Case of(heavy_tips(kinds), seed, turned, 2.0);
      const std::vector<double> exact = exact_accelerations(of);
      unsigned plain = 0;
      lost = std::max(lost, off(refined(kernels::instruction_sets()[0].one[kernels::Call::forward_dynamics], of, plain), exact));
      each_kernel([&](const kernels::InstructionSet&, const kernels::Kernel<double>& kernel) {
        unsigned sound = 0;
        const double left = off(refined(kernel, of, sound), exact);
        if (sound & 1) BOOST_TEST(left <= 50 * eps);
        sure += sound & 1;
      });
    }
    BOOST_TEST_MESSAGE(static_cast<int>(kinds.back()) << " " << kinds.size() << ": lost " << lost << ", sure " << sure);
    BOOST_TEST(lost > 200 * eps);
    BOOST_TEST(sure > 0);
  }
}

// Forces of ℳe₁ on stretched rods, of which a residual in double knows nothing.
BOOST_AUTO_TEST_CASE(a_stretched_chain_is_corrected_by_a_wide_gather) {
  auto model = std::make_shared<Multibody>("rods");
  constexpr int n = 30;
  for (int k = 0; k < n; ++k) {
    Body b;
    b.name = "body" + std::to_string(k), b.mass = 1, b.com = {0.35, 0, 0}, b.inertia = {0, 0, 0, 0.04, 0, 0.04};
    b.hinge.name = "hinge" + std::to_string(k), b.hinge.kind = HingeKind::pin, b.hinge.placement.p = {k > 0 ? 0.7 : 0, 0, 0};
    b.hinge.subhinges = subhinges_of(HingeKind::pin, {{0, 0, 1}}, {0, 0, 0}, 0, b.hinge.name);
    model->add_body(b, k == 0 ? "" : "body" + std::to_string(k - 1));
  }
  model->set_gravity({0, 0, 0});
  Case of(model, 1);
  of.q.assign(n, 0), of.v.assign(n, 0);
  for (auto& w : of.wrenches) w = Vector6<double>::zero();
  RigidDynamics<Quad> oracle(*model);
  std::vector<Quad> zero(n, Quad(0)), one = zero, tau(n);
  one[0] = 1;
  oracle.inverse_dynamics(zero.data(), zero.data(), one.data(), tau.data());
  for (int j = 0; j < n; ++j) of.tau[j] = to_double(tau[j]);
  const std::vector<double> exact = exact_accelerations(of);
  const auto& kernel = kernels::instruction_sets().back().one;
  unsigned sound = 0, gathered = 0;
  const std::vector<double> start = refined(kernel[kernels::Call::forward_dynamics], of, sound);
  const double plain = off(start, exact), left = off(refined(kernel[kernels::Call::gathered_dynamics], of, gathered), exact);
  BOOST_TEST_MESSAGE("plain " << plain << ", gathered " << left << ", sound " << gathered);
  BOOST_TEST(left < plain / 50);
  // Noise is no correction: left out, or left to the recursions.
  const std::vector<double> same = refined(kernel[kernels::Call::refined_dynamics], of, sound);
  BOOST_TEST(((sound & 1) == 0 || same == start));
}
