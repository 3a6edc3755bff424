// The model: order of bodies, lumped welds, edits that carry the state, checks of numbers; and the dynamics on top of it.
#define BOOST_TEST_MODULE multibody
#include <boost/test/included/unit_test.hpp>

#include "dynamics/rigid_dynamics.h"
#include "operators/multibody_operators.h"
#include "random_tree.h"
#include "runtime/errors.h"

using namespace pycraft;
using namespace pycraft::testing;

namespace {

Body rod(const std::string& name, HingeKind kind = HingeKind::pin, double mass = 1) {
  Body b;
  b.name = name;
  b.mass = mass;
  b.com = {0.5, 0, 0};
  b.inertia = {0.01, 0, 0, mass / 12, 0, mass / 12};
  b.hinge.kind = kind;
  b.hinge.name = name + " hinge";
  b.hinge.placement.p = {1, 0, 0};
  std::vector<Vector3<double>> axes;
  if (kind == HingeKind::pin) axes = {{0, 0, 1}};
  b.hinge.subhinges = subhinges_of(kind, axes, {0, 0, 0}, 0, b.hinge.name);
  return b;
}

std::vector<std::string> names(const Multibody& mb) {
  std::vector<std::string> all;
  for (int k = 0; k < mb.bodies(); ++k) all.push_back(mb.body(k).name);
  return all;
}

}  // namespace

BOOST_AUTO_TEST_CASE(bodies_are_kept_depth_first) {
  auto mb = std::make_shared<Multibody>("tree");
  mb->add_body(rod("a"), "");
  mb->add_body(rod("b"), "a");
  mb->add_body(rod("c"), "a");
  mb->add_body(rod("d"), "b");
  BOOST_TEST((names(*mb) == std::vector<std::string>{"a", "b", "d", "c"}));
  BOOST_TEST(mb->body(3).parent == 0);
}

BOOST_AUTO_TEST_CASE(what_stands_on_frames_is_a_pose_to_rounding_and_to_the_bit_on_a_body) {
  auto mb = std::make_shared<Multibody>("frames");
  mb->add_body(rod("a"), "");
  const double turn = 0.7;
  Pose<double> X{Matrix3<double>{std::cos(turn), -std::sin(turn), 0, std::sin(turn), std::cos(turn), 0, -0.0, 0, 1}, {-0.0, 1, 0}};
  mb->add_node("n0", "a", X);
  BOOST_TEST((std::signbit(mb->nodes()[0].pose.R.m[6]) && std::signbit(mb->nodes()[0].pose.p[0])));
  std::string last_name = "n0";
  for (int k = 1; k < 1000; ++k) {
    const std::string name = last_name + "'";
    mb->add_node(name, last_name, X);
    last_name = name;
  }
  const Matrix3<double> last = mb->nodes().back().pose.R, gram = transpose(last) * last;
  for (int i = 0; i < 9; ++i) BOOST_TEST(std::abs(gram.m[i] - (i % 4 == 0)) < 2e-14);
  BOOST_TEST(std::abs(last.m[0] - std::cos(1000 * turn)) < 1e-10);
  X.p[0] = 1.7e308;
  mb->add_node("far", "a", X);
  BOOST_CHECK_THROW(mb->add_node("farther", "far", X), ModelError);
}

BOOST_AUTO_TEST_CASE(edits_carry_the_state_and_make_operators_stale) {
  auto mb = std::make_shared<Multibody>("tree");
  mb->add_body(rod("a"), "");
  mb->add_body(rod("c", HingeKind::ball), "a");
  mb->set_q({0.5, 0.6, 0.8, 0, 0});
  mb->set_v({1, 2, 3, 4});
  const auto before = operators_of(mb);
  mb->add_node("tool", "c", Pose<double>::identity());
  BOOST_CHECK_NO_THROW(before->check_current());
  mb->add_body(rod("b"), "a");
  BOOST_CHECK_THROW(before->check_current(), StaleOperatorError);
  BOOST_TEST((mb->state()->q == std::vector<double>{0.5, 0.6, 0.8, 0, 0, 0}));
  BOOST_TEST((mb->state()->v == std::vector<double>{1, 2, 3, 4, 0}));
  mb->remove_body("c");
  BOOST_TEST((mb->state()->q == std::vector<double>{0.5, 0}));
  BOOST_TEST(mb->nodes().empty());
  BOOST_TEST(operators_of(mb) != before);
}

BOOST_AUTO_TEST_CASE(welds_lump_or_stay) {
  double mass[2];
  std::vector<double> M[2];
  for (bool keep : {false, true}) {
    auto mb = std::make_shared<Multibody>("arm", keep);
    mb->add_body(rod("a"), "");
    mb->add_body(rod("hand", HingeKind::weld, 2.5), "a");
    mb->add_body(rod("finger"), "hand");
    BOOST_TEST(mb->bodies() == (keep ? 3 : 2));
    mb->set_q({0.3, -0.7});
    RigidDynamics<double> w(*mb);
    M[keep].resize(4);
    w.mass_matrix(mb->state()->q.data(), M[keep].data());
    mass[keep] = mb->body(0).mass;
    if (!keep) {
      BOOST_TEST(mb->nodes()[0].name == "hand");
      BOOST_CHECK_THROW(mb->body_index("hand"), ModelError);
    }
  }
  BOOST_TEST(mass[0] == 3.5);
  for (int i = 0; i < 4; ++i) BOOST_TEST(std::abs(M[0][i] - M[1][i]) < 1e-14 * 20);
}

BOOST_AUTO_TEST_CASE(numbers_are_checked_and_named) {
  const auto message = [](auto f) -> std::string {
    try {
      f();
    } catch (const ModelError& e) {
      return e.what();
    }
    return "";
  };
  Multibody mb("arm");
  mb.add_body(rod("a"), "");
  const auto add = [&](auto change) {
    return message([&] {
      Body b = rod("b");
      change(b);
      mb.add_body(b, "a");
    });
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  BOOST_TEST(has(add([](Body& b) { b.mass = -1; }), "body 'b': its mass is -1"));
  BOOST_TEST(has(add([](Body& b) { b.mass = NAN; }), "body 'b': its mass is nan"));
  BOOST_TEST(has(add([](Body& b) { b.inertia.s[0] = -1; }), "principal moment"));
  BOOST_TEST(has(add([](Body& b) { b.name = "a"; }), "already"));
  BOOST_TEST(has(add([](Body& b) { b.hinge.placement.R(0, 0) = 2; }), "not orthogonal"));
  BOOST_TEST(has(message([&] { mb.add_body(rod("x"), "nobody"); }), "there are a"));
  BOOST_TEST(has(message([] { subhinges_of(HingeKind::pin, {{0, 0, 0}}, {0, 0, 0}, 0, "h"); }), "hinge 'h': its axis has length 0"));
  BOOST_TEST(mb.bodies() == 1);
  BOOST_TEST(has(message([&] { mb.set_q({NAN}); }), "hinge 'a hinge'"));
  BOOST_TEST(has(message([&] { mb.set_q({1, 2}); }), "takes 1 numbers"));
}

BOOST_AUTO_TEST_CASE(double_pendulum_in_closed_form) {
  // Two rods of 1 kg and 1 m: ℳ = [[5/3 + c, 1/3 + c/2], [1/3 + c/2, 1/3]], c = cos of the second angle.
  auto mb = std::make_shared<Multibody>("double pendulum");
  Body a = rod("a"), b = rod("b");
  a.hinge.placement.p = {0, 0, 0};
  mb->add_body(a, "");
  mb->add_body(b, "a");
  mb->set_gravity({0, -9.81, 0});
  const std::vector<double> q{0.4, 1.1}, v{0.7, -0.2}, vdot{1.5, 0.3};
  RigidDynamics<double> w(*mb);
  std::vector<double> M(4), tau(2), back(2);
  w.mass_matrix(q.data(), M.data());
  const double c = std::cos(q[1]), s = std::sin(q[1]);
  BOOST_TEST(std::abs(M[0] - (5.0 / 3 + c)) < 1e-14);
  BOOST_TEST(std::abs(M[1] - (1.0 / 3 + c / 2)) < 1e-14);
  BOOST_TEST(std::abs(M[3] - 1.0 / 3) < 1e-14);
  w.inverse_dynamics(q.data(), v.data(), vdot.data(), tau.data());
  const double g1 = 9.81 * (1.5 * std::cos(q[0]) + 0.5 * std::cos(q[0] + q[1])), g2 = 9.81 * 0.5 * std::cos(q[0] + q[1]);
  const double c1 = -0.5 * s * v[1] * (2 * v[0] + v[1]), c2 = 0.5 * s * v[0] * v[0];
  BOOST_TEST(std::abs(tau[0] - (M[0] * vdot[0] + M[1] * vdot[1] + c1 + g1)) < 1e-13);
  BOOST_TEST(std::abs(tau[1] - (M[2] * vdot[0] + M[3] * vdot[1] + c2 + g2)) < 1e-13);
  w.forward_dynamics(q.data(), v.data(), tau.data(), back.data());
  for (int i = 0; i < 2; ++i) BOOST_TEST(std::abs(back[i] - vdot[i]) < 1e-13);
}

BOOST_AUTO_TEST_CASE(massless_hinges_are_refused_by_the_bound) {
  const auto pair = [](double inner) {
    auto mb = std::make_shared<Multibody>("sliders");
    for (int k = 0; k < 2; ++k) {
      Body b;
      b.name = k ? "outer" : "inner";
      b.mass = k ? 1e9 : inner;
      b.hinge.kind = HingeKind::slider;
      b.hinge.subhinges = subhinges_of(HingeKind::slider, {{0.36, 0.48, 0.8}}, {0, 0, 0}, 0, b.name);
      mb->add_body(b, k ? "inner" : "");
    }
    RigidDynamics<double> w(*mb);
    const std::vector<double> q{0.1, 0.2}, v{0, 0}, tau{1, 2};
    std::vector<double> out(2);
    w.forward_dynamics(q.data(), v.data(), tau.data(), out.data());
    return out;
  };
  BOOST_CHECK_THROW(pair(0), SingularHingeError);
  const std::vector<double> a = pair(1e-3);  // θ̈ = (T1 - T2)/m1, and T2/m2 - θ̈1
  BOOST_TEST(std::abs(a[0] + 1e3) < 1e3 * 2.3e-16 * 1e12);  // D = 1e-3 comes out of a difference of 1e9s
}
