// Frames: the way between two of them, what is kept at the present state, functions of time, refusals.
#define BOOST_TEST_MODULE frames
#include <boost/test/included/unit_test.hpp>

#include <cmath>

#include "dynamics/frame_cache.h"
#include "dynamics/frame_calls.h"
#include "runtime/errors.h"

using namespace pycraft;

namespace {

constexpr double eps = 2.220446049250313e-16;

Body link(const std::string& name, double x) {
  Body b;
  b.name = name;
  b.mass = 1;
  b.inertia = {1, 0, 0, 1, 0, 1};
  b.hinge.kind = HingeKind::pin;
  b.hinge.name = name + " hinge";
  b.hinge.placement.p = {x, 0, 0};
  b.hinge.subhinges = subhinges_of(HingeKind::pin, {{0, 0, 1}}, {0, 0, 0}, 0, b.hinge.name);
  return b;
}

// A trunk with two arms of two links each.
std::shared_ptr<FrameTree> two_arms() {
  auto model = std::make_shared<Multibody>("two arms");
  model->add_body(link("trunk", 0), "");
  model->add_body(link("left", 1), "trunk");
  model->add_body(link("left hand", 1), "left");
  model->add_body(link("right", -1), "trunk");
  model->add_body(link("right hand", -1), "right");
  model->add_node("eye", "left hand", {Matrix3<double>::identity(), {0, 0, 1}});
  return std::make_shared<FrameTree>(model);
}

bool says(const ModelError& error, const std::string& words) { return std::string(error.what()).find(words) != std::string::npos; }

}  // namespace

BOOST_AUTO_TEST_CASE(a_way_goes_by_the_nearest_frame_that_carries_both) {
  const auto frames = two_arms();
  const auto steps = [&](const std::string& a, const std::string& b) {
    const FramePath path = frames->path(frames->find(a), frames->find(b));
    return std::pair{path.up.size(), path.down.size()};
  };
  BOOST_TEST((steps("left hand", "right hand") == std::pair<size_t, size_t>{2, 2}));
  BOOST_TEST((steps("left hand", "left") == std::pair<size_t, size_t>{1, 0}));
  BOOST_TEST((steps("trunk", "eye") == std::pair<size_t, size_t>{0, 3}));
  BOOST_TEST((steps("eye", "base") == std::pair<size_t, size_t>{4, 0}));
  BOOST_TEST((steps("eye", "eye") == std::pair<size_t, size_t>{0, 0}));
  frames->add("tool", "eye", Pose<double>::identity());
  frames->add("bit", "tool", Pose<double>::identity());
  frames->add("lamp", "tool", Pose<double>::identity());
  BOOST_TEST((steps("bit", "lamp") == std::pair<size_t, size_t>{1, 1}));
  BOOST_TEST((steps("lamp", "left hand") == std::pair<size_t, size_t>{3, 0}));
  BOOST_TEST(frames->name(frames->carrier(frames->find("tool"))) == "eye");
}

BOOST_AUTO_TEST_CASE(what_is_kept_is_computed_once_a_state) {
  const auto frames = two_arms();
  Multibody& model = *frames->shared_model();
  FrameCache cache(frames);
  model.set_q({0.1, 0.2, 0.3, 0.4, 0.5});
  model.set_v({1, 2, 3, 4, 5});
  const FrameNumber a = frames->find("left hand"), b = frames->find("right hand");
  const auto m = cache.motion(a, b, MotionPart::velocity);
  BOOST_TEST(std::abs(m.V.angular[2] - (2 + 3 - 4 - 5)) <= 8 * eps);
  BOOST_TEST(cache.counts().steps[0] == 4u);
  cache.motion(a, b, MotionPart::velocity);
  BOOST_TEST(cache.counts().steps[0] == 4u);
  BOOST_TEST(cache.counts().pairs == 1u);
  model.set_q({0.7, 0.2, 0.3, 0.4, 0.5});  // the trunk carries both
  cache.motion(a, b, MotionPart::velocity);
  BOOST_TEST(cache.counts().steps[0] == 4u);
  BOOST_TEST(cache.counts().pairs == 1u);
  model.set_q({0.7, 0.2, 0.3, 0.4, 0.6});
  cache.motion(a, b, MotionPart::pose);
  BOOST_TEST(cache.counts().steps[0] == 5u);
  BOOST_TEST(cache.counts().pairs == 2u);
}

BOOST_AUTO_TEST_CASE(a_function_of_time_moves_a_frame) {
  const auto frames = two_arms();
  FrameCache cache(frames);
  int called = 0;
  frames->add("rider", "left hand", Pose<double>::identity(), [&called](double t) {
    ++called;
    return FrameMotion{{Matrix3<double>::identity(), {0, 0, t * t}}, Vector6<double>{{0, 0, 0}, {0, 0, 2 * t}}, Vector6<double>{{0, 0, 0}, {0, 0, 2}}};
  });
  cache.set_time(3);
  BOOST_TEST(called == 0);
  const FrameNumber rider = frames->find("rider"), hand = frames->find("left hand");
  const auto m = cache.motion(rider, hand, MotionPart::acceleration);
  BOOST_TEST(m.X.p[2] == 9);
  BOOST_TEST(m.V.linear[2] == 6);
  BOOST_TEST(m.A.linear[2] == 2);
  const auto back = cache.motion(hand, rider, MotionPart::acceleration);
  BOOST_TEST(back.X.p[2] == -9);
  BOOST_TEST(back.V.linear[2] == -6);
  BOOST_TEST(back.A.linear[2] == -2);
  BOOST_TEST(called == 1);
  cache.set_time(4);
  BOOST_TEST(cache.motion(rider, hand, MotionPart::pose).X.p[2] == 16);
  BOOST_TEST(called == 2);

  // at given states: the same numbers, in quad precision too
  FrameCalls calls(frames);
  const FrameQuestion asked{rider, base_frame, MotionAxes::aligned};
  const std::vector<double> q = {0.1, 0.2, 0.3, 0.4, 0.5}, v = {1, 2, 3, 4, 5};
  frames->shared_model()->set_q(q), frames->shared_model()->set_v(v);
  double wide[6];
  calls.motion(asked, MotionPart::velocity, false, {Given{"q", q.data(), 5}, Given{"v", v.data(), 5}}, calls.times(asked, {4.0}), Precision::quad, 1, wide);
  const auto now = cache.motion(rider, base_frame, MotionPart::velocity);
  const Vector6<double> V = in_axes(MotionAxes::aligned, now, Matrix3<double>::identity(), now.V);
  for (int i = 0; i < 6; ++i) BOOST_TEST(std::abs(wide[i] - V[i]) <= 200 * eps * 10);
}

BOOST_AUTO_TEST_CASE(refusals_leave_all_as_it_was) {
  const auto frames = two_arms();
  frames->add("a", "trunk", Pose<double>::identity());
  frames->add("b", "a", Pose<double>::identity());
  const auto edits = frames->edits();
  BOOST_CHECK_EXCEPTION(frames->attach("a", "b"), ModelError, [](const ModelError& e) { return says(e, "'a' cannot stand on 'b', which stands on it: 'b' on 'a'"); });
  BOOST_CHECK_EXCEPTION(frames->remove("a"), ModelError, [](const ModelError& e) { return says(e, "'b' stands on it"); });
  BOOST_CHECK_EXCEPTION(frames->find("left hnd"), ModelError, [](const ModelError& e) { return says(e, "the nearest is 'left hand'"); });
  BOOST_CHECK_EXCEPTION(frames->move("eye", Pose<double>::identity()), ModelError, [](const ModelError& e) { return says(e, "a node"); });
  BOOST_TEST(frames->edits() == edits);
  frames->shared_model()->remove_body("trunk");
  BOOST_CHECK_EXCEPTION(frames->path(frames->find("b"), base_frame), ModelError, [](const ModelError& e) { return says(e, "'a' of 'two arms' stood on 'trunk'"); });
}
