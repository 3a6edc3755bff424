// Kernels and what lies in the memory that they work in: it does not matter, and no arithmetic is done on it, which denormal numbers (the bits of
// an address are one) would slow down a hundredfold.
#define BOOST_TEST_MODULE kernel_memory
#include <boost/test/included/unit_test.hpp>
#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#if defined(__SSE2__)
#include <immintrin.h>
#endif

#include "kernels/instruction_set.h"
#include "kernels/link_model.h"
#include "runtime/interrupt.h"
#include "tests/robot.h"

using namespace pycraft;
using pycraft::testing::random_numbers;
using kernels::Call;

namespace {

// Whether a denormal number was an operand since this was asked last; false where the processor does not tell.
bool met_denormal() {
#if defined(__SSE2__)
  const unsigned status = _mm_getcsr();
  _mm_setcsr(status & ~0x3fu);
  return status & 2u;
#else
  return false;
#endif
}

template <class T>
struct Memory {
  T* numbers;
  explicit Memory(size_t n, T with) : numbers(static_cast<T*>(::operator new((n + 1) * sizeof(T), std::align_val_t(64)))) { std::fill_n(numbers, n, with); }
  ~Memory() { ::operator delete(numbers, std::align_val_t(64)); }
  Memory(const Memory&) = delete;
};

constexpr Call calls[] = {Call::forward_dynamics, Call::inverse_dynamics, Call::mass_matrix, Call::mass_matrix_inverse, Call::inverse_dynamics_derivatives,
                          Call::forward_dynamics_derivatives, Call::jacobian, Call::pose, Call::coriolis_matrix, Call::skew_coriolis_matrix,
                          Call::operational_space_compliance, Call::operational_space_inertia, Call::refined_dynamics, Call::gathered_dynamics};

template <class T>
void check(const Multibody& model, const kernels::Kernels<T>& kernel) {
  const auto made = kernels::LinkModel<T>::of(model);
  BOOST_REQUIRE(made);
  const kernels::Links<T>& links = made->links();
  const int nv = model.nv(), nq = model.nq(), lanes = kernel.lanes;
  const size_t most = std::max<size_t>(size_t(nv) * nv, 36);
  const kernels::OnLink<T> node = made->on_link(Node{"tip", model.bodies() - 1, Pose<double>::identity()});
  std::vector<double> q, v = random_numbers(nv * lanes, 2), u = random_numbers(nv * lanes, 3);
  for (int b = 0; b < lanes; ++b) {
    const std::vector<double> zero = model.zero_q(), moved = random_numbers(nq, 10 + b);
    for (int i = 0; i < nq; ++i) q.push_back(zero[i] + moved[i]);
  }
  const T gravity[] = {T(0.3), T(0.2), T(-9.81)};
  for (const Call call : calls) {
    if (!kernel[call].run) continue;
    std::vector<double> results[3];
    unsigned sound[3] = {};
    const T garbage[] = {T(0), std::numeric_limits<T>::denorm_min(), std::numeric_limits<T>::quiet_NaN()};
    for (int with = 0; with < 3; ++with) {
      std::vector<double>& out = results[with];
      out.assign(3 * most * lanes, 0.0);
      double* others[] = {out.data() + most * lanes, out.data() + 2 * most * lanes};
      const Memory<T> work(kernel[call].work(links, 1), garbage[with]);
      const kernels::States<T> at{q.data(), v.data(), u.data(), size_t(nq), size_t(nv), size_t(nv), lanes, gravity, nullptr, check_interrupt, &node, 1, others, nullptr, nullptr, T(0), 2};
      met_denormal();
      sound[with] = kernel[call].run(links, at, out.data(), most, work.numbers);
      BOOST_TEST(!met_denormal(), "call " << static_cast<int>(call) << " of " << model.name() << ", " << lanes << " lanes, computes with what was in its memory");
    }
    const unsigned all = lanes == 32 ? ~0u : (1u << lanes) - 1;
    for (int with = 1; with < 3; ++with) {
      BOOST_TEST((sound[with] & all) == (sound[0] & all));
      BOOST_TEST(std::memcmp(results[with].data(), results[0].data(), results[0].size() * sizeof(double)) == 0,
                 "call " << static_cast<int>(call) << " of " << model.name() << ", " << lanes << " lanes, hangs on what was in its memory");
    }
  }
}

// Pins about x, y, z and askew in turn; every fourth body hangs on the one before its parent.
std::shared_ptr<Multibody> branched(int n) {
  auto model = std::make_shared<Multibody>("branched " + std::to_string(n));
  const Vector3<double> axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.6, 0, 0.8}};
  for (int k = 0; k < n; ++k) {
    Body b;
    b.name = "body" + std::to_string(k);
    b.mass = 1 + 0.1 * k;
    b.com = {0.1, 0.2, 0.05};
    b.inertia = {1, 0.1, 0, 1.2, 0, 0.9};
    b.hinge.kind = HingeKind::pin;
    b.hinge.name = "hinge" + std::to_string(k);
    b.hinge.placement.p = {0.3, 0, 0.1};
    b.hinge.subhinges = subhinges_of(HingeKind::pin, {axes[k % 4]}, {0, 0, 0}, 0, b.hinge.name);
    model->add_body(b, k == 0 ? "" : "body" + std::to_string(k % 4 == 3 ? k - 2 : k - 1));
  }
  return model;
}

}  // namespace

BOOST_AUTO_TEST_CASE(what_was_in_the_memory_of_kernels_does_not_matter) {
  std::vector<std::shared_ptr<Multibody>> models{pycraft::testing::robot()};
  for (const int n : {1, 2, 3, 5, 7, 8, 9, 12, 17, 53}) models.push_back(branched(n));
  for (const auto& model : models)
    for (const kernels::InstructionSet& set : kernels::instruction_sets()) {
      check(*model, set.one);
      check(*model, set.pack);
      check(*model, set.singles);
    }
}
