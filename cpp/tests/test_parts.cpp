// Parts of a model: their numbers are the whole's, without a copy; what ends them; states read beside others that set them.
#define BOOST_TEST_MODULE parts
#include <boost/test/included/unit_test.hpp>

#include <atomic>
#include <thread>

#include "dynamics/batch_dynamics.h"
#include "dynamics/centroidal.h"
#include "operators/multibody_operators.h"
#include "random_tree.h"
#include "runtime/errors.h"

using namespace pycraft;

namespace {

Body rod(const std::string& name, HingeKind kind = HingeKind::pin) {
  Body b;
  b.name = name;
  b.mass = 1;
  b.com = {0.5, 0.1, 0};
  b.inertia = {0.01, 0, 0, 1.0 / 12, 0, 1.0 / 12};
  b.hinge.kind = kind;
  b.hinge.name = name + " hinge";
  b.hinge.placement.p = {1, 0, 0};
  std::vector<Vector3<double>> axes;
  if (kind == HingeKind::pin) axes = {{0, 0, 1}};
  b.hinge.subhinges = subhinges_of(kind, axes, {0, 0, 0}, 0, b.hinge.name);
  return b;
}

//   torso ─ arm ─ hand;  torso ─ leg ─ foot
std::shared_ptr<Multibody> robot() {
  auto mb = std::make_shared<Multibody>("robot");
  mb->add_body(rod("torso", HingeKind::free), "");
  mb->add_body(rod("arm"), "torso");
  mb->add_body(rod("hand", HingeKind::ball), "arm");
  mb->add_body(rod("leg"), "torso");
  mb->add_body(rod("foot"), "leg");
  std::vector<double> q = mb->zero_q(), v(mb->nv());
  for (size_t i = 7; i < q.size(); ++i) q[i] += 0.1 * static_cast<double>(i);
  for (size_t i = 0; i < v.size(); ++i) v[i] = 0.3 - 0.1 * static_cast<double>(i);
  mb->set_q(q), mb->set_v(v);
  return mb;
}

std::shared_ptr<Multibody> part(const std::shared_ptr<Multibody>& whole, std::vector<int> bodies, bool moving = false) {
  return Multibody::part_of(whole, "part", std::move(bodies), moving);
}

std::vector<double> accelerations(const std::shared_ptr<Multibody>& model, const std::vector<double>& q, const std::vector<double>& v) {
  std::vector<double> tau(model->nv(), 0.3), out(model->nv());
  BatchDynamics(model).forward_dynamics({"q", q.data(), model->nq()}, {"v", v.data(), model->nv()}, {"tau", tau.data(), model->nv()}, {}, Precision::double_, out.data());
  return out;
}

}  // namespace

BOOST_AUTO_TEST_CASE(coordinates_that_follow_one_another_are_the_wholes_own) {
  const auto whole = robot(), arm = part(whole, {1, 2}), middle = part(whole, {0, 3});
  BOOST_TEST(arm->state()->q.data() == whole->state()->q.data() + 7);
  BOOST_TEST(arm->state()->v.data() == whole->state()->v.data() + 6);
  BOOST_TEST(middle->nq() == 8);
  BOOST_TEST(middle->state()->q[7] == whole->state()->q[12]);
  BOOST_TEST(middle->state().get() == middle->state().get());  // made once
  middle->set_q({1, 0, 0, 0, 1, 2, 3, 0.7});
  BOOST_TEST(whole->state()->q[12] == 0.7);
  BOOST_TEST(whole->state()->q[4] == 1);
  BOOST_TEST(arm->state()->q.data() == whole->state()->q.data() + 7);
}

BOOST_AUTO_TEST_CASE(a_part_computes_what_its_bodies_alone_do) {
  const auto whole = robot(), arm = part(whole, {1, 2});
  auto alone = std::make_shared<Multibody>("alone");
  alone->add_body(rod("arm"), "");
  alone->add_body(rod("hand", HingeKind::ball), "arm");
  const std::vector<double> q = arm->state()->q.copy(), v = arm->state()->v.copy();
  BOOST_TEST(accelerations(arm, q, v) == accelerations(alone, q, v), boost::test_tools::per_element());
  whole->set_mass_properties(2, 5, {0, 1, 0}, {1, 0, 0, 1, 0, 1});
  alone->set_mass_properties(1, 5, {0, 1, 0}, {1, 0, 0, 1, 0, 1});
  BOOST_TEST(accelerations(arm, q, v) == accelerations(alone, q, v), boost::test_tools::per_element());
  arm->set_gravity({0, -9, 0}), alone->set_gravity({0, -9, 0});
  BOOST_TEST(whole->gravity()[1] == -9);
  BOOST_TEST(accelerations(arm, q, v) == accelerations(alone, q, v), boost::test_tools::per_element());
}

BOOST_AUTO_TEST_CASE(a_moving_base_is_where_its_carrier_is) {
  const auto whole = robot(), hand = part(whole, {2}, true);
  BOOST_TEST(hand->bodies() == 2);
  BOOST_TEST(hand->body(1).parent == 0);
  double pose[7], velocity[6];
  motion_of_body(*whole, 1, *whole->state(), pose, velocity);
  for (int i = 0; i < 7; ++i) BOOST_TEST(hand->state()->q[i] == pose[i]);
  for (int i = 0; i < 6; ++i) BOOST_TEST(hand->state()->v[i] == velocity[i]);
  BOOST_TEST(std::abs(pose[0] - std::cos(0.35)) < 1e-15);  // torso unturned, the arm by 0.7 about z
  BOOST_TEST(pose[4] == 2);
}

BOOST_AUTO_TEST_CASE(sets_hang_together) {
  const auto whole = robot();
  BOOST_CHECK_THROW(part(whole, {1, 3}), ModelError);
  BOOST_CHECK_THROW(part(whole, {0, 2}), ModelError);
  BOOST_CHECK_THROW(part(whole, {}), ModelError);
  BOOST_TEST((path_between(*whole, 2, 4) == std::vector<int>{0, 1, 2, 3, 4}));
  BOOST_TEST((path_between(*whole, -1, 2) == std::vector<int>{0, 1, 2}));
  BOOST_TEST((outboard_of(*whole, 0, {1}) == std::vector<int>{0, 3, 4}));
  BOOST_CHECK_THROW(outboard_of(*whole, 1, {3}), ModelError);
}

BOOST_AUTO_TEST_CASE(structure_that_changes_ends_a_part) {
  const auto whole = robot(), arm = part(whole, {1, 2});
  const auto hand = part(arm, {1});
  const auto operators = operators_of(arm);
  whole->add_body(rod("tool"), "foot");
  BOOST_CHECK_THROW(operators->check_current(), StaleOperatorError);
  BOOST_CHECK_THROW(arm->nq(), StaleOperatorError);
  BOOST_CHECK_THROW(arm->state(), StaleOperatorError);
  BOOST_CHECK_THROW(hand->compiled<double>(), StaleOperatorError);
  BOOST_CHECK_THROW(part(whole, {1, 2})->add_body(rod("more"), "hand"), ModelError);
}

BOOST_AUTO_TEST_CASE(a_part_in_use_keeps_the_whole_from_edits) {
  const auto whole = robot(), hand = part(part(whole, {1, 2}), {1});
  {
    const ModelInUse use(*hand);
    BOOST_CHECK_THROW(whole->set_gravity({0, 0, 1}), ModelError);
    BOOST_CHECK_THROW(whole->remove_body("foot"), ModelError);
  }
  whole->set_gravity({0, 0, 1});  // nothing was left locked
  BOOST_TEST(hand->gravity()[2] == 1);
}

BOOST_AUTO_TEST_CASE(states_are_read_while_others_set_them) {
  const auto whole = robot(), hand = part(whole, {2}, true), middle = part(whole, {0, 3});
  std::atomic<bool> ready{false}, wrong{false};
  std::thread sets([&] {
    std::vector<double> q = whole->state()->q.copy();
    for (int i = 0; i < 2000; ++i) q[12] = q[4] = i, whole->set_q(q);
    ready = true;
  });
  do {
    const auto at = middle->state();
    if (at->q[7] != at->q[4] && at->q[4] != 0) wrong = true;  // of one state, never of two
    wrong = wrong || hand->state()->q.size() != 11;
  } while (!ready);
  sets.join();
  BOOST_TEST(!wrong);
  BOOST_TEST(middle->state()->q[7] == 1999);
}

BOOST_AUTO_TEST_CASE(two_rods_are_one_about_their_middle) {
  auto mb = std::make_shared<Multibody>("rods");
  for (const char* name : {"inner", "outer"}) {
    Body b = rod(name);
    b.com = {0.5, 0, 0};
    b.inertia = {0, 0, 0, 1.0 / 12, 0, 1.0 / 12};
    b.hinge.placement.p = {mb->bodies() ? 1.0 : 0.0, 0, 0};
    mb->add_body(b, mb->bodies() ? "inner" : "");
  }
  const double q[2] = {0, 0}, v[2] = {1, 0};
  double out[Centroidal<double>::sums];
  Centroidal<double>(*mb).sum(q, v, out);
  BOOST_TEST(out[0] == 1);
  BOOST_TEST(out[4] == 1);
  BOOST_TEST(std::abs(out[6 + 8] - 2.0 / 3) < 1e-15);
  BOOST_TEST(std::abs(out[15 + 2] - 2.0 / 3) < 1e-15);
  BOOST_TEST(out[15 + 4] == 2);
}
