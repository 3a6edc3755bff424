// Refinement by kernels: of what is right already they find no correction, and are sure of it. Python's tests/dynamics/test_kernels_refined.py has
// what is corrected.
#define BOOST_TEST_MODULE refined_kernels
#include <boost/test/included/unit_test.hpp>

#include "tests/kernel_case.h"

using namespace pycraft;
using testing::by_kernel;
using testing::by_recursion;
using testing::Case;
using testing::exact_accelerations;
using testing::heavy_tips;
using testing::off;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

struct Refined {
  kernels::Call call;
  Form form;
  ResidualPrecision residual;
};
constexpr Refined refined[] = {{kernels::Call::refined_dynamics, Form::fast, ResidualPrecision::same}, {kernels::Call::gathered_dynamics, Form::fast, ResidualPrecision::gather},
                               {kernels::Call::refined_dynamics_ud, Form::ud, ResidualPrecision::same}, {kernels::Call::gathered_dynamics_ud, Form::ud, ResidualPrecision::gather},
                               {kernels::Call::refined_dynamics_square_root, Form::square_root, ResidualPrecision::same},
                               {kernels::Call::gathered_dynamics_square_root, Form::square_root, ResidualPrecision::gather}};

// f(set, kernel) of every kernel that refines in a way.
template <class F>
void each_kernel(const Refined& how, F f) {
  for (const kernels::InstructionSet& set : kernels::instruction_sets())
    for (const auto* of : {&set.one[how.call], &set.pack[how.call]})
      if (of->run) f(set, *of);
}

}  // namespace

// 50 eps: of sums of up to 21 products through six bodies.
BOOST_AUTO_TEST_CASE(what_is_right_has_no_correction) {
  for (const int seed : {1, 5, 9}) {
    const Case of(testing::robot(), seed, {1, 4}, 0.4);
    const std::vector<double> exact = exact_accelerations(of);
    for (const Refined& how : refined)
      each_kernel(how, [&](const kernels::InstructionSet& set, const kernels::Kernel<double>& kernel) {
        unsigned sound = 0;
        const double left = off(by_kernel(kernel, of, sound), exact);
        BOOST_TEST((sound & 1) == 1, set.name);
        BOOST_TEST(left <= 50 * eps);
      });
  }
}

// To 100 eps: through twelve bodies, twice as many. Or to twice what the general recursions leave in the same form: the rounding of a residual in
// double, times what the model makes of it.
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
      lost = std::max(lost, off(by_kernel(kernels::instruction_sets()[0].one[kernels::Call::forward_dynamics], of, plain), exact));
      for (const Refined& how : refined) {
        const double general = off(by_recursion<double>(of, how.form, {3, how.residual}), exact);
        each_kernel(how, [&](const kernels::InstructionSet&, const kernels::Kernel<double>& kernel) {
          unsigned sound = 0;
          const double left = off(by_kernel(kernel, of, sound), exact);
          if (sound & 1) BOOST_TEST(left <= std::max(100 * eps, 2 * general));
          sure += sound & 1;
        });
      }
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
  const std::vector<double> start = by_kernel(kernel[kernels::Call::forward_dynamics], of, sound);
  const double plain = off(start, exact), left = off(by_kernel(kernel[kernels::Call::gathered_dynamics], of, gathered), exact);
  BOOST_TEST_MESSAGE("plain " << plain << ", gathered " << left << ", sound " << gathered);
  BOOST_TEST(left < plain / 50);
  // Noise is no correction: left out, or left to the recursions.
  const std::vector<double> same = by_kernel(kernel[kernels::Call::refined_dynamics], of, sound);
  BOOST_TEST(((sound & 1) == 0 || same == start));
}
