// Scenes in C++: nothing is allocated at a state, an effect of one's own, derivatives of forces, passes that ran.
#define BOOST_TEST_MODULE scenes
#include <boost/test/included/unit_test.hpp>
#include <cmath>

#include "allocations.h"
#include "robot.h"
#include "simulation/effects/bushing.h"
#include "simulation/effects/coulomb_friction.h"
#include "simulation/effects/damping.h"
#include "simulation/effects/fixman.h"
#include "simulation/effects/fluid_drag.h"
#include "simulation/effects/gravity.h"
#include "simulation/effects/gravity_compensation.h"
#include "simulation/effects/gravity_gradient.h"
#include "simulation/effects/implicit_damping.h"
#include "simulation/effects/implicit_spring.h"
#include "simulation/effects/langevin.h"
#include "simulation/effects/limits.h"
#include "simulation/effects/motor.h"
#include "simulation/effects/node_damper.h"
#include "simulation/effects/node_spring.h"
#include "simulation/effects/nose_hoover.h"
#include "simulation/effects/point_mass_gravity.h"
#include "simulation/effects/prescribed_motion.h"
#include "simulation/effects/quadratic_damping.h"
#include "simulation/effects/rotor_inertia.h"
#include "simulation/effects/servo.h"
#include "simulation/effects/spring.h"
#include "simulation/effects/torque_source.h"
#include "simulation/effects/wrench.h"
#include "simulation/integrators/integrate.h"
#include "simulation/scene_equations.h"

using namespace pycraft;
using pycraft::testing::allocations_of;
using pycraft::testing::random_numbers;
using pycraft::testing::robot;

namespace {

using EffectPointer = std::shared_ptr<const Effect>;

std::shared_ptr<Multibody> machine() {
  const auto mb = robot();
  mb->add_node("a", "body2", {Matrix3<double>::identity(), {0.1, 0.2, 0.3}});
  mb->add_node("b", "body5", {Matrix3<double>::identity(), {-0.2, 0.1, 0}});
  return mb;
}

std::vector<double> moved(const Multibody& mb, int seed) {
  const std::vector<double> zero = mb.zero_q(), u = random_numbers(mb.nv(), seed);
  std::vector<double> q(mb.nq());
  mb.integrate(zero.data(), u.data(), q.data());
  return q;
}

const Names all = std::nullopt, pin = std::vector<std::string>{"hinge1"};

// Every effect of the library, with numbers that make each of its branches count.
std::vector<EffectPointer> every_effect(const Multibody& mb) {
  std::vector<double> six(36, 0.1);
  for (int i = 0; i < 6; ++i) six[7 * i] = 2 + i;
  const Names balls_and_pins = std::vector<std::string>{"hinge[12345]"};
  return {std::make_shared<Gravity>(Vector3<double>{0, 0, -9.81}),
          std::make_shared<PointMassGravity>(mb, 3.0, Vector3<double>{5, 4, 3}, all),
          std::make_shared<GravityGradient>(mb, 3.0, Vector3<double>{5, 4, 3}, all),
          std::make_shared<GravityCompensation>(mb, all, std::vector<double>{0.7}, std::vector<double>{}, Vector3<double>{0, 0, -9.81}),
          std::make_shared<FluidDrag>(2.0, 0.3, Vector3<double>{0.1, 0.2, 0.3}, std::vector<BoxInFluid>{{2, Pose<double>{Matrix3<double>::identity(), {0.1, 0, 0}}, {0.1, 0.2, 0.3}}}),
          std::make_shared<Damping>(mb, all, std::vector<double>{0.2}),
          std::make_shared<QuadraticDamping>(mb, all, std::vector<double>{0.2}),
          std::make_shared<CoulombFriction>(mb, all, std::vector<double>{0.2}, 0.1),
          std::make_shared<ImplicitDamping>(mb, all, std::vector<double>{0.2}),
          std::make_shared<ImplicitSpring>(mb, all, std::vector<double>{0.2}, std::vector<double>{0.1}),
          std::make_shared<Spring>(mb, balls_and_pins, std::vector<double>{2.0}, std::vector<double>{0.0}),
          std::make_shared<NodeSpring>(mb, "a", "b", 3.0, 0.2),
          std::make_shared<NodeDamper>(mb, "a", "b", 0.5),
          std::make_shared<Bushing>(mb, "", "b", six, six, Pose<double>::identity()),
          std::make_shared<TorqueSource>(mb, all, harmonic({1}, {2}, {3}, {4}), DriveLimits{{2.0}, {0.5}, 0.5}),
          std::make_shared<Servo>(mb, all, std::vector<double>{3.0}, std::vector<double>{0.3}, piecewise_polynomial({0, 1, 2}, {1, -1, 0.5, 0.2}, 1), DriveLimits{}),
          std::make_shared<Motor>(mb, all, constant_in_time({0.4}), MotorNumbers{{1}, {20}, {3}, {0.01}}, DriveLimits{}),
          std::make_shared<RotorInertia>(mb, all, std::vector<double>{0.2}, std::vector<double>{2.0}),
          std::make_shared<Limits>(mb, all, std::vector<double>{30}, std::vector<double>{0.2}, std::vector<double>{-0.1}, std::vector<double>{0.1}),
          std::make_shared<Wrench>(mb, "b", constant_in_time({1, 2, 3, 4, 5, 6}), "a"),
          std::make_shared<PrescribedMotion>(mb, pin, harmonic({0.3}, {1}, {0}, {0.1}))};
}

// A tank that empties: its level is a state, and what flows out pushes.
class Jet : public Effect {
 public:
  explicit Jet(int coordinate) : coordinate(coordinate) {}
  std::string kind() const override { return "jet"; }
  Declaration declaration() const override {
    Declaration d;
    d.coordinates = {coordinate};
    d.states = {2.0};
    d.events = 1;
    d.work = true;
    return d;
  }
  PYCRAFT_BINDS
  const int coordinate;
};
template <class S>
struct BoundJet : BoundEffect<S> {
  explicit BoundJet(const Jet& of) : j(of.coordinate) {}
  void forces(const At<S>& at, const Forces<S>& out) override { out.generalized[j] += S(3) * at.own[0]; }
  void rates(const At<S>& at, S* out) override { out[0] = -at.own[0]; }
  void events(const At<S>& at, S* out) override { out[0] = at.own[0] - S(0.125); }  // as good as empty
  int j;
};
PYCRAFT_BIND_EFFECT(Jet, BoundJet)

}  // namespace

BOOST_AUTO_TEST_CASE(nothing_is_allocated_at_a_state) {
  const auto mb = machine();
  const std::vector<double> q = moved(*mb, 1), v = random_numbers(mb->nv(), 2);
  Scene whole(mb);
  for (const EffectPointer& effect : every_effect(*mb)) {
    Scene scene(mb);
    scene.add("", effect), whole.add("", effect);
    for (const Scene* one : {&scene, &whole}) {
      if (one == &whole && effect->kind() != "prescribed") continue;  // complete with the last one
      for (const Form form : forms) {
        CompiledScene<double> compiled(*one, Solving{form, {}, OnSingular::raise});
        std::vector<double> out(mb->nv()), powers(compiled.effects().workers().size());
        BOOST_TEST(allocations_of([&] { compiled.accelerations(0.3, q.data(), v.data(), nullptr, out.data()); }) == 0, effect->kind());
        BOOST_TEST(allocations_of([&] { compiled.accelerations(0.3, q.data(), nullptr, nullptr, out.data()); }) == 0, effect->kind() << " at rest");
        BOOST_TEST(allocations_of([&] { compiled.accelerations_and_powers(0.3, q.data(), v.data(), nullptr, out.data(), powers.data()); }) == 0, effect->kind() << " with works");
        for (double x : out) BOOST_TEST(std::isfinite(x), effect->kind());
      }
    }
  }
}

BOOST_AUTO_TEST_CASE(steps_allocate_nothing) {
  const auto mb = machine();
  Scene scene(mb);
  for (const EffectPointer& effect : every_effect(*mb)) scene.add("", effect);
  scene.add("", std::make_shared<Jet>(2));
  CompiledScene<double> compiled(scene, {});
  SceneEquations<double> equations(compiled, true);
  const std::vector<double> q = moved(*mb, 1), v = random_numbers(mb->nv(), 2), x = equations.initial(0.0, q.data(), v.data(), nullptr);
  BOOST_TEST(x.size() == q.size() + v.size() + 1 + compiled.effects().workers().size());
  for (const Integrator integrator : integrators_by(Way::at_states)) {
    if (integrator == Integrator::bulirsch_stoer) continue;  // a step of Boost.Odeint's own keeps two arrays
    long counts[2];
    for (const int twice : {0, 1}) {
      const std::vector<double> times{0, 0.01 * (1 + twice)};
      counts[twice] = allocations_of([&] { integrate<double>(equations, x, times, {integrator, 1e-6, 1e-6, 1e-3, true}, [](const double&, const std::vector<double>&) {}); });
    }
    // What is made once, of arrays for a step that the run's end cuts, may differ by a few; ten steps more would be ten at least.
    BOOST_TEST(std::abs(counts[0] - counts[1]) <= 4, integrator_name(integrator) << ": " << counts[0] << " allocations, in as long again " << counts[1]);
  }
}

// Impulses, thermostats with states of their own, the Fixman potential: once they have their room.
BOOST_AUTO_TEST_CASE(thermostats_allocate_nothing) {
  const auto mb = machine();
  Scene scene(mb);
  scene.add("", std::make_shared<Langevin>(*mb, all, 0.7, std::vector<double>{0.4}, 0.2, 3));
  scene.add("", std::make_shared<NoseHoover>(*mb, all, 0.7, 0.3, 3));
  scene.add("", std::make_shared<Fixman>(*mb, 0.7));
  scene.add("", std::make_shared<RotorInertia>(*mb, all, std::vector<double>{0.2}, std::vector<double>{2.0}));
  CompiledScene<double> compiled(scene, Solving{});
  const std::vector<double> q = moved(*mb, 1), own(compiled.effects().own(), 0.3);
  std::vector<double> v = random_numbers(mb->nv(), 2), out(mb->nv()), rates(own.size()), gained(1), potential(4);
  double kinetic = 0, after = 0;
  for (int time = 0; time < 2; ++time) {
    const int allocations = allocations_of([&] {
      compiled.accelerations(0.1, q.data(), v.data(), own.data(), out.data());
      compiled.effects().rates(rates.data());
      compiled.energies(0.1, q.data(), v.data(), own.data(), &kinetic, potential.data());
      compiled.give_impulses(0.1, q.data(), v.data(), own.data(), gained.data());
    });
    if (time == 1) BOOST_TEST(allocations == 0);
  }
  compiled.energies(0.1, q.data(), v.data(), own.data(), &after, potential.data());
  BOOST_TEST(std::abs(after - kinetic - gained[0]) < 1e-12 * (after + kinetic));  // the heat of an impulse
  BOOST_TEST(std::abs(gained[0]) > 1e-3);
  const std::vector<double> before = v;
  compiled.give_impulses(0.2, q.data(), v.data(), own.data(), gained.data());  // none falls on that time
  BOOST_TEST((v == before && gained[0] == 0));
}

BOOST_AUTO_TEST_CASE(an_effect_of_ones_own_with_a_state) {
  const auto mb = std::make_shared<Multibody>("cart");
  Body b;
  b.name = "cart", b.mass = 2, b.hinge.name = "rail", b.hinge.kind = HingeKind::slider;
  b.hinge.subhinges = subhinges_of(HingeKind::slider, {{1, 0, 0}}, {0, 0, 0}, 0, "rail");
  mb->add_body(b, "");
  Scene scene(mb);
  BOOST_TEST(scene.add("", std::make_shared<Jet>(0)) == "jet");
  CompiledScene<Quad> compiled(scene, {});
  SceneEquations<Quad> equations(compiled, true);
  const Quad zero(0);
  std::vector<Quad> end;
  integrate<Quad>(equations, equations.initial(Quad(0), &zero, &zero, nullptr), {0, 1}, {Integrator::dop853, 1e-20, 1e-22}, [&](const Quad&, const std::vector<Quad>& x) { end = x; });
  using std::exp;
  const Quad level = Quad(2) * exp(Quad(-1)), speed = Quad(3) * (Quad(2) - level) / Quad(2);  // m v̇ = 3 y
  BOOST_TEST(to_double(Quad(end[2] - level)) < 1e-19);
  BOOST_TEST(to_double(Quad(end[1] - speed)) < 1e-19);
  BOOST_TEST(to_double(Quad(end[3] * SceneEquations<Quad>::unit_of_work() - speed * speed)) < 1e-18);  // its work is the kinetic energy
}

// ∂ forces/∂q along every coordinate and ∂ forces/∂v, exactly, against differences.
BOOST_AUTO_TEST_CASE(derivatives_of_forces) {
  const auto mb = machine();
  const auto numbers = mb->compiled<double>();
  const auto with_derivatives = std::make_shared<const CompiledModel<WithDerivatives>>(broadcast<WithDerivatives>(*numbers));
  const int nq = mb->nq(), nv = mb->nv();
  const std::vector<double> q = moved(*mb, 3), v = random_numbers(nv, 4);
  std::vector<EffectPointer> effects = every_effect(*mb);
  effects.push_back(std::make_shared<Fixman>(*mb, 1.7));
  for (const EffectPointer& effect : effects) {
    Scene scene(mb);
    scene.add("", effect);
    SceneForces<double> plain(scene, numbers);
    SceneForces<WithDerivatives> forces(scene, with_derivatives);
    for (int j = 0; j < nv; ++j) {
      std::vector<double> e(nv, 0.0), rate(nq), at(nq), lower(nv), upper(nv);
      e[j] = 1;
      configuration_rate(*numbers, q.data(), e.data(), rate.data());
      std::vector<WithDerivatives> x(q.begin(), q.end()), y(v.begin(), v.end()), out(nv);
      for (int i = 0; i < nq; ++i) x[i].d[0] = rate[i];
      y[j].d[1] = 1;
      forces.generalized_forces(WithDerivatives(0.3), x.data(), y.data(), nullptr, out.data());
      const double h = 1e-6;
      const auto differs = [&](int direction, const char* what) {
        for (int i = 0; i < nv; ++i) {
          const double slope = (upper[i] - lower[i]) / (2 * h);
          BOOST_TEST(std::abs(out[i].d[direction] - slope) < 1e-6 * (1 + std::abs(slope)), effect->kind() << ", " << what << " " << j << ": " << out[i].d[direction] << " and " << slope);
        }
      };
      for (double& y_j : e) y_j *= h;
      mb->integrate(q.data(), e.data(), at.data()), plain.generalized_forces(0.3, at.data(), v.data(), nullptr, upper.data());
      for (double& y_j : e) y_j *= -1;
      mb->integrate(q.data(), e.data(), at.data()), plain.generalized_forces(0.3, at.data(), v.data(), nullptr, lower.data());
      differs(0, "along coordinate");
      std::vector<double> faster = v;
      faster[j] += h, plain.generalized_forces(0.3, q.data(), faster.data(), nullptr, upper.data());
      faster[j] -= 2 * h, plain.generalized_forces(0.3, q.data(), faster.data(), nullptr, lower.data());
      differs(1, "along velocity");
    }
  }
}

// At the attitude of rest, where a length has no derivative, springs of balls and bushings have theirs.
BOOST_AUTO_TEST_CASE(derivatives_at_rest) {
  const auto mb = machine();
  const auto numbers = std::make_shared<const CompiledModel<WithDerivatives>>(broadcast<WithDerivatives>(*mb->compiled<double>()));
  const std::vector<double> zero = mb->zero_q();
  Scene scene(mb);
  std::vector<double> six(36, 0.0);
  for (int i = 0; i < 6; ++i) six[7 * i] = 2;
  scene.add("", std::make_shared<Spring>(*mb, Names({"hinge2"}), std::vector<double>{3.0}, std::vector<double>{0.0}));
  scene.add("", std::make_shared<Bushing>(*mb, "", "body0", six, six, Pose<double>{Matrix3<double>::identity(), {0.3, 0, 0.1}}));
  SceneForces<WithDerivatives> forces(scene, numbers);
  std::vector<WithDerivatives> q(zero.begin(), zero.end()), v(mb->nv(), WithDerivatives(0)), out(mb->nv());
  const int ball = mb->q_offset(2), of_ball = mb->v_offset(2);
  q[ball + 1].d[0] = 0.5, q[1].d[1] = 0.5;  // unit rates of the first coordinate of each
  forces.generalized_forces(WithDerivatives(0), q.data(), v.data(), nullptr, out.data());
  BOOST_TEST(out[of_ball].d[0] == -3.0);
  BOOST_TEST(out[0].d[1] == -2.0);
  for (const WithDerivatives& x : out)
    for (double d : x.d) BOOST_TEST(std::isfinite(d));
}

BOOST_AUTO_TEST_CASE(passes_are_counted) {
  const auto mb = machine();
  Scene scene(mb);
  scene.add("gravity", std::make_shared<Gravity>(Vector3<double>{0, 0, -1}));
  scene.add("wrench", std::make_shared<Wrench>(*mb, "b", constant_in_time({1, 2, 3, 4, 5, 6}), "world"));
  scene.add("damping", std::make_shared<Damping>(*mb, all, std::vector<double>{0.2}));
  scene.set_on("damping", false);
  CompiledScene<double> compiled(scene, {});
  const std::vector<double> q = moved(*mb, 1), v = random_numbers(mb->nv(), 2);
  std::vector<double> out(mb->nv());
  for (int i = 0; i < 5; ++i) compiled.accelerations(0.0, q.data(), v.data(), nullptr, out.data());
  compiled.accelerations(0.0, q.data(), nullptr, nullptr, out.data());
  for (const auto& [list, times] : {std::pair(SceneList::motion, 5L), std::pair(SceneList::rest, 1L), std::pair(SceneList::works, 0L)}) {
    const auto passes = compiled.passes(list);
    BOOST_TEST((passes.front().name == "poses" && passes.back().name == "accelerations"));
    for (const PassRecord& pass : passes) {
      BOOST_TEST(pass.times == times, pass.name);
      BOOST_TEST(pass.name != "damping");
    }
  }
}

BOOST_AUTO_TEST_CASE(events_of_effects) {
  const auto mb = machine();
  Scene scene(mb);
  const double none = std::numeric_limits<double>::infinity();
  scene.add("", std::make_shared<Limits>(*mb, pin, std::vector<double>{30}, std::vector<double>{0}, std::vector<double>{-0.25}, std::vector<double>{0.75}));
  scene.add("", std::make_shared<Damping>(*mb, all, std::vector<double>{0.2}));
  scene.add("", std::make_shared<Jet>(0));
  scene.add("lower", std::make_shared<Limits>(*mb, pin, std::vector<double>{30}, std::vector<double>{0}, std::vector<double>{-0.5}, std::vector<double>{none}));
  CompiledScene<double> compiled(scene, {});
  SceneEquations<double> equations(compiled, true);
  const std::vector<double> q = mb->zero_q(), v = random_numbers(mb->nv(), 2);
  const int at = compiled.numbers().q_offset[mb->body_index("body1")];
  std::vector<double> x = equations.initial(0.0, q.data(), v.data(), nullptr), out(4);
  x[at] = 0.5;
  BOOST_TEST(equations.event_names() == (std::vector<std::string>{"limits", "limits", "jet", "lower"}), boost::test_tools::per_element());
  BOOST_TEST(allocations_of([&] { equations.events(0.0, x, out.data()); }) == 0);
  BOOST_TEST(out == (std::vector<double>{0.75, 0.25, 2 - 0.125, 1.0}), boost::test_tools::per_element());
  scene.add("", std::make_shared<PrescribedMotion>(*mb, pin, constant_in_time({0.25})));
  CompiledScene<double> driven(scene, {});
  SceneEquations<double> others(driven, false);
  others.events(0.0, x, out.data());  // of where the motion is, not of x
  BOOST_TEST(out == (std::vector<double>{0.5, 0.5, 2 - 0.125, 0.75}), boost::test_tools::per_element());
}
