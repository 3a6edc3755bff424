// ℳ⁻¹ on columns by links: that plans take it where they may, beside the numbers of the rigid blocks, and what it leaves to them.
#define BOOST_TEST_MODULE link_inverse
#include <boost/test/included/unit_test.hpp>
#include <limits>

#include "algebra/engine/evaluate.h"
#include "kernel_case.h"
#include "operators/multibody_operators.h"
#include "operators/rigid_values.h"
#include "robot.h"
#include "uneven.h"

using namespace pycraft;
using namespace pycraft::testing;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

struct Values {
  std::shared_ptr<MultibodyOperators> source;  // outlives its values
  std::unique_ptr<SkoValues<double>> values;
  explicit Values(const std::shared_ptr<Multibody>& model, Form form = Form::fast) : source(operators_of(model)), values(source->make_values(double())) { values->use(form); }
  SkoValues<double>* operator->() const { return values.get(); }
  bool by_links() const { return dynamic_cast<const RigidValues<double>&>(*values).inverts_by_links(); }
};

struct Solved {
  std::vector<double> by_itself, by_bodies;
  bool links;
};
// Three columns, by what Group::inverse holds and by the articulated group.
Solved solved(const Case& of, Form form = Form::fast) {
  const Values values(of.model, form);
  const int n = of.model->nv(), m = 3;
  const std::vector<double> x = random_numbers(n * m, 5);
  std::vector<double> scratch(size_t(6) * of.model->bodies() * m);
  Solved out{std::vector<double>(x.size()), std::vector<double>(x.size()), false};
  values->move_to(of.q.data(), of.v.data());
  values->require(Group::inverse);
  out.links = values.by_links();
  values->inverse_by_itself(x.data(), out.by_itself.data(), m, scratch.data());
  values->require(Group::kinematics | Group::articulated);
  values->mass_matrix_inverse(x.data(), out.by_bodies.data(), m, scratch.data());
  return out;
}

// Largest condition number that ℳ of these models has: what both ways may be off by.
constexpr double condition = 1e5;

}  // namespace

BOOST_AUTO_TEST_CASE(links_serve_every_kind_of_hinge) {
  using enum HingeKind;
  const std::vector<std::vector<HingeKind>> sorts = {{pin}, {slider}, {screw}, {ball, pin}, {free, pin}, {universal}, {pin, ball, screw, slider, free, universal}};
  for (size_t i = 0; i < sorts.size(); ++i)
    for (int seed = 1; seed < 4; ++seed) {
      const Solved s = solved(Case(heavy_tips(sorts[i], 2), 10 * seed));
      BOOST_TEST(s.links, "hinges " << i << " are not solved by links");
      BOOST_TEST(off(s.by_itself, s.by_bodies) < condition * eps, "hinges " << i);
    }
  const Solved turned = solved(Case(robot(), 3, {1, 3, 4}, 0.7));
  BOOST_TEST((turned.links && off(turned.by_itself, turned.by_bodies) < condition * eps));
}

// Where kernels do not know a hinge, a pivot is in doubt, or the form is another one, the numbers of the blocks serve, to the bit.
BOOST_AUTO_TEST_CASE(what_links_decline_goes_by_bodies) {
  const auto same = [](const Solved& s, const char* what) { BOOST_TEST((!s.links && s.by_itself == s.by_bodies), what); };
  const auto rotor_on_ball = robot();
  rotor_on_ball->set_rotor_inertia(2, {0.1, 0.2, 0.3});
  same(solved(Case(rotor_on_ball, 3)), "a rotor on a ball");
  for (const Form form : {Form::ud, Form::square_root}) same(solved(Case(robot(), 3), form), form_name(form));
  int declined = 0;
  for (int seed = 1; seed < 60; ++seed) {
    const Case of(uneven(seed, 0.6), seed);
    try {
      const Solved s = solved(of);
      if (s.links) continue;
      ++declined;
      same(s, "a pivot in doubt");
    } catch (const Error&) {  // the general recursions refuse it
      ++declined;
    }
  }
  BOOST_TEST(declined > 5);
}

BOOST_AUTO_TEST_CASE(a_singular_hinge_is_refused_as_by_bodies) {
  const auto model = robot();
  model->set_mass_properties(5, 0, {0, 0, 0}, {0, 0, 0, 0, 0, 0});
  const Case of(model, 3);
  const auto refused = [&](unsigned groups) -> std::string {
    const Values values(model);
    values->move_to(of.q.data(), of.v.data());
    try {
      values->require(groups);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  BOOST_TEST(!refused(Group::inverse).empty());
  BOOST_TEST(refused(Group::inverse) == refused(Group::kinematics | Group::articulated));
}

// Values move from state to state, and from model to model: nothing of an old one is left.
BOOST_AUTO_TEST_CASE(values_that_move) {
  const auto model = robot();
  const Case one(model, 3), other(model, 7);
  const int n = model->nv();
  const std::vector<double> x = random_numbers(n, 5);
  std::vector<double> scratch(size_t(6) * model->bodies());
  const auto at = [&](const Values& values, const Case& of) {
    std::vector<double> y(n);
    values->move_to(of.q.data(), of.v.data());
    BOOST_TEST(!values.by_links());
    values->require(Group::inverse);
    BOOST_TEST(values.by_links());
    values->inverse_by_itself(x.data(), y.data(), 1, scratch.data());
    return y;
  };
  const Values kept(model);
  for (int turn = 0; turn < 2; ++turn) {
    for (const Case* of : {&one, &other, &one}) {
      const Values fresh(model);
      BOOST_TEST(at(kept, *of) == at(fresh, *of), boost::test_tools::per_element());
    }
    model->set_rotor_inertia(1, {0.5 + turn});
  }
}

// Which group a plan asks for.
BOOST_AUTO_TEST_CASE(plans_share_what_other_steps_need) {
  const auto model = robot();
  const auto source = operators_of(model);
  const Letters o(source);
  const Expression inverse = (o.H * o.phi * o.M * o.phi.T() * o.H.T()).inv();
  const auto groups = [](const Expression& e) { return make_plan(e, Request::apply, {})->groups.at(0); };
  BOOST_TEST(groups(inverse) == unsigned(Group::inverse));
  BOOST_TEST(groups(o.M * o.H.T() * inverse) == unsigned(Group::inverse | Group::kinematics));
  for (const Expression& e : {inverse + o.D, o.D * inverse, inverse * o.H * o.psi * o.K})
    BOOST_TEST(groups(e) == unsigned(Group::kinematics | Group::articulated));
}
