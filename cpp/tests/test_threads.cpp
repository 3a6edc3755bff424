// Threads: evaluations beside each other, beside a changing state, beside edits that are refused. Meant for the thread sanitizer, too.
#define BOOST_TEST_MODULE threads
#include <atomic>
#include <boost/test/included/unit_test.hpp>
#include <thread>

#include "dynamics/rigid_dynamics.h"
#include "operators/multibody_operators.h"
#include "random_tree.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

using namespace pycraft;
using namespace pycraft::testing;

namespace {

constexpr int threads = 4, rounds = 60;
const std::thread::id main_thread = std::this_thread::get_id();

template <class F>
void in_parallel(F f) {
  std::vector<std::thread> all;
  for (int i = 0; i < threads; ++i) all.emplace_back([&f, i] { f(i); });
  for (std::thread& t : all) t.join();
}

std::shared_ptr<Multibody> serial_chain(int bodies) {
  auto mb = std::make_shared<Multibody>("chain");
  for (int k = 0; k < bodies; ++k) {
    Body b;
    b.name = "body" + std::to_string(k);
    b.mass = 1 + k;
    b.com = {0.5, 0.1, 0};
    b.inertia = {0.2, 0, 0, 0.3, 0, 0.4};
    b.hinge.kind = HingeKind::pin;
    b.hinge.name = "hinge" + std::to_string(k);
    b.hinge.placement.p = {1, 0, 0};
    b.hinge.subhinges = subhinges_of(HingeKind::pin, {{0, 0.6, 0.8}}, {0, 0, 0}, 0, b.hinge.name);
    mb->add_body(b, k == 0 ? "" : "body" + std::to_string(k - 1));
  }
  return mb;
}

Expression mass_matrix(const std::shared_ptr<SkoSource>& source) {
  const Letters o(source);
  return o.H * o.phi * o.M * o.phi.T() * o.H.T();
}

std::vector<double> applied(const Expression& e) {
  const std::vector<double> x(e.domain().dimension(), 1.0);
  Inputs in;
  in.x = x.data();
  Result r;
  apply(e, in, r);
  return r.values;
}

}  // namespace

BOOST_AUTO_TEST_CASE(one_expression_in_every_thread) {
  const auto tree = random_tree(5, {-1, 0, 1, 1, 0, 4, -1});
  const Letters o(tree);
  const Expression MM = mass_matrix(tree), e = (MM + 0.5 * o.I).inv() + MM.inv() * o.D;
  const std::vector<double> alone = applied((MM + 0.5 * o.I).inv() + MM.inv() * o.D);
  std::atomic<int> wrong{0};
  in_parallel([&](int) {
    for (int i = 0; i < rounds; ++i) {
      wrong += applied(e) != alone;
      const Expression inverse = MM.inv();  // one cache of plans for all of them
      applied(inverse.at(nullptr));
      applied(inverse);
    }
  });
  BOOST_TEST(wrong == 0);
}

BOOST_AUTO_TEST_CASE(a_state_that_changes_meanwhile) {
  const auto mb = serial_chain(5);
  const Expression MM = mass_matrix(operators_of(mb));
  const std::vector<double> a(5, 0.3), b(5, -0.8);
  mb->set_q(a);
  const std::vector<double> at_a = applied(MM);
  mb->set_q(b);
  const std::vector<double> at_b = applied(MM);
  std::atomic<int> wrong{0};
  in_parallel([&](int t) {
    for (int i = 0; i < rounds; ++i) {
      if (t == 0) mb->set_q(i % 2 ? a : b);
      const std::vector<double> y = applied(MM);
      wrong += y != at_a && y != at_b;
    }
  });
  BOOST_TEST(wrong == 0);
}

// An edit is made between evaluations or refused; whoever evaluates sees the model before or after it, and nothing in between.
BOOST_AUTO_TEST_CASE(edits_beside_evaluations) {
  const auto mb = serial_chain(4);
  const Expression MM = mass_matrix(operators_of(mb));
  DynamicsPool<double> pool;
  const std::vector<double> zero(4, 0.0), one(4, 1.0);
  const auto accelerations = [&] {
    std::vector<double> vdot(4);
    const ModelInUse use(*mb);
    pool.with(*mb, [&](RigidDynamics<double>& w) { w.forward_dynamics(zero.data(), zero.data(), one.data(), vdot.data()); });
    return vdot;
  };
  const auto weigh = [&](double mass) { mb->set_mass_properties(2, mass, {0.5, 0.1, 0}, {0.2, 0, 0, 0.3, 0, 0.4}); };
  std::vector<std::vector<double>> products, solutions;
  for (double mass : {7.0, 3.0}) {
    weigh(mass);
    products.push_back(applied(MM));
    solutions.push_back(accelerations());
  }
  std::atomic<int> wrong{0}, refused{0}, made{0};
  in_parallel([&](int t) {
    for (int i = 0; i < 4 * rounds; ++i) {
      if (t == 0) {
        try {
          weigh(i % 2 ? 7.0 : 3.0);
          ++made;
        } catch (const ModelError&) {
          ++refused;
        }
        continue;
      }
      const auto y = applied(MM), vdot = accelerations();
      wrong += std::find(products.begin(), products.end(), y) == products.end();
      wrong += std::find(solutions.begin(), solutions.end(), vdot) == solutions.end();
    }
  });
  BOOST_TEST(wrong == 0);
  BOOST_TEST(made + refused == 4 * rounds);
}

BOOST_AUTO_TEST_CASE(an_edit_within_an_evaluation_is_refused) {
  const auto mb = serial_chain(2);
  auto data = std::make_shared<ExternalData>();
  data->name = "L";
  data->apply = [&](const double* x, double* y, int m) {
    std::copy_n(x, 2 * m, y);
    mb->set_gravity({0, 0, -1});
  };
  const auto source = operators_of(mb);
  const Expression e = external(data, source->theta(), source->theta()) * mass_matrix(source);
  BOOST_CHECK_THROW(applied(e), ModelError);
  BOOST_CHECK_NO_THROW(mb->set_gravity({0, 0, -1}));
  BOOST_CHECK_THROW(applied(e), ModelError);
}

BOOST_AUTO_TEST_CASE(the_first_look_after_an_edit_in_every_thread) {
  for (int round = 0; round < rounds; ++round) {
    const auto mb = serial_chain(3);
    Body b;
    b.name = "late";
    b.mass = 1;
    b.hinge.kind = HingeKind::pin;
    b.hinge.name = "late hinge";
    b.hinge.subhinges = subhinges_of(HingeKind::pin, {{0, 0, 1}}, {0, 0, 0}, 0, b.hinge.name);
    mb->add_body(b, "body0");  // renumbers the bodies, when somebody looks
    std::atomic<int> wrong{0};
    in_parallel([&](int t) {
      if (t == 0) wrong += mb->zero_q().size() != 4;
      if (t == 1) wrong += mb->compiled<double>()->bodies != 4;
      if (t == 2) wrong += mb->structure().bodies() != 4;
      if (t == 3) wrong += mb->state()->q.size() != 4;
    });
    BOOST_TEST(wrong == 0);
  }
}

BOOST_AUTO_TEST_CASE(work_shared_out) {
  for (int from : {0, 1})
    for (int count : {0, 1, 3, 50, 1000})
      for (int crew : {1, 2, 7}) {
        std::vector<std::atomic<int>> done(count);
        std::vector<std::atomic<std::thread::id>> by(crew);
        std::atomic<int> wrong{0};
        share_out(from, from + count, crew, [&](int thread, int i) {
          ++done[i - from];
          const std::thread::id before = by[thread].exchange(std::this_thread::get_id());  // a number is one thread's
          wrong += before != std::thread::id() && before != std::this_thread::get_id();
          wrong += std::this_thread::get_id() == main_thread;
        });
        for (const auto& times : done) wrong += times != 1;
        BOOST_TEST(wrong == 0);
      }
}

BOOST_AUTO_TEST_CASE(the_first_error_of_work_shared_out) {
  for (int round = 0; round < rounds; ++round) {
    const int first = 7 * round % 200;
    std::vector<std::atomic<bool>> done(200);
    const auto fails = [&](int i) { return i == first || (i > first && i % 3 == 0); };
    try {
      share_out(0, 200, threads, [&](int, int i) {
        if (i == first) std::this_thread::yield();
        if (fails(i)) throw ModelError("item " + std::to_string(i));
        done[i] = true;
      });
      BOOST_ERROR("no error came through");
    } catch (const ModelError& error) {
      BOOST_TEST(std::string(error.what()) == "item " + std::to_string(first));
    }
    for (int i = 0; i < first; ++i) BOOST_TEST_REQUIRE(done[i].load());
  }
}

BOOST_AUTO_TEST_CASE(an_interrupt_of_work_shared_out) {
  struct Interrupt {};
  set_interrupt_check([] {
    if (std::this_thread::get_id() == main_thread) throw Interrupt{};  // asked of the caller alone
  });
  std::atomic<bool> ever{true};
  BOOST_CHECK_THROW(share_out(0, 1000000, threads, [&](int, int) {
    while (ever) check_interrupt();
  }), Interrupt);
  set_interrupt_check(nullptr);
}
