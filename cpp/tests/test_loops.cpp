// Loops: rows in every scalar, without allocation, beside each other and beside edits.
#define BOOST_TEST_MODULE loops
#include <boost/test/included/unit_test.hpp>

#include <cmath>

#include "allocations.h"
#include "model/compiled_model.h"
#include "model/loops.h"
#include "recursions/loop_rows.h"
#include "runtime/errors.h"

using namespace pycraft;

namespace {

constexpr double eps = 2.220446049250313e-16;

Hinge hinge_of(HingeKind kind, const std::string& name, const std::vector<Vector3<double>>& axes, const Vector3<double>& position) {
  Hinge hinge;
  hinge.name = name, hinge.kind = kind, hinge.placement.p = position;
  hinge.subhinges = subhinges_of(kind, axes, {0, 0, 0}, kind == HingeKind::screw ? 0.2 : 0, name);
  return hinge;
}

// Three links in a row, and a free body: a loop of each sort among them.
std::shared_ptr<LoopSet> linkage() {
  auto model = std::make_shared<Multibody>("linkage");
  std::string parent;
  for (const std::string name : {"one", "two", "three"}) {
    model->add_body({name, -1, 1, {0.5, 0, 0}, {1, 0, 0, 1, 0, 1}, hinge_of(HingeKind::pin, name, {{0, 0, 1}}, {parent.empty() ? 0.0 : 1.0, 0, 0})}, parent);
    parent = name;
  }
  model->add_body({"free", -1, 1, {0, 0, 0}, {1, 0, 0, 1, 0, 1}, hinge_of(HingeKind::free, "free", {}, {0, 0, 0})}, "");
  auto loops = std::make_shared<LoopSet>(model);
  loops->add_hinge("pin", "", "three", hinge_of(HingeKind::pin, "pin", {{0, 0.6, 0.8}}, {0.5, 0.5, 0}));
  loops->add_hinge("weld", "free", "three", hinge_of(HingeKind::weld, "weld", {}, {0.1, 0, 0}));
  loops->add_hinge("screw", "two", "free", hinge_of(HingeKind::screw, "screw", {{0, 0, -1}}, {0, 0, 0}));
  loops->add_pair("wheel", {"", "free", PairKind::wheel, Pose<double>::identity(), Pose<double>::identity(), 0.5});
  loops->add_pair("sphere", {"", "two", PairKind::surface, Pose<double>::identity(), Pose<double>::identity(), 0, {Matrix3<double>::identity(), {0, 0, 0}, -1}});
  loops->add_coupling("gear", {{{"one", 0, {0, 1}}, {"two", 0, {0, -3, 0, 0.5}}}, 0.1, nullptr});
  return loops;
}

const std::vector<double> q = {0.3, -0.8, 1.1, 0.5, 0.5, -0.6, 0.1, 0.4, -0.2, 0.7}, v = {0.5, 1.5, -0.7, 0.2, -0.3, 0.9, 1.0, -0.4, 0.6};

template <class S>
struct Rows {
  std::vector<S> residual, jacobian, bias;
  explicit Rows(const LoopSet& set) {
    const auto loops = set.resolved();
    const auto model = set.model().compiled<S>();
    const std::vector<S> at(q.begin(), q.end()), along(v.begin(), v.end());
    LoopBuffers<S> w;
    residual.resize(loops->rows), bias.resize(loops->rows), jacobian.assign(loops->rows * model->nv, S(0));
    loop_residuals(*model, *loops, at.data(), w, residual.data());
    loop_jacobian(*model, *loops, at.data(), w, [&](int row, int i, const S& x) { jacobian[row * model->nv + i] = x; });
    loop_bias(*model, *loops, at.data(), along.data(), w, bias.data());
  }
};

// A hundred roundings of numbers near one, in the narrower of the two.
template <class S>
void check_against_digits(double tolerance) {
  const auto loops = linkage();
  const Rows<S> rows(*loops);
  const Rows<Digits50> exact(*loops);
  for (size_t i = 0; i < rows.residual.size(); ++i) {
    BOOST_TEST(std::abs(to_double(rows.residual[i]) - to_double(exact.residual[i])) < tolerance);
    BOOST_TEST(std::abs(to_double(rows.bias[i]) - to_double(exact.bias[i])) < 10 * tolerance);
  }
  for (size_t i = 0; i < rows.jacobian.size(); ++i) BOOST_TEST(std::abs(to_double(rows.jacobian[i]) - to_double(exact.jacobian[i])) < tolerance);
}

}  // namespace

BOOST_AUTO_TEST_CASE(rows_in_every_scalar) {
  check_against_digits<Single>(100 * 1.2e-7);
  check_against_digits<double>(100 * eps);
  check_against_digits<Extended>(100 * eps);
  check_against_digits<Quad>(100 * eps);
  check_against_digits<Digits100>(100 * eps);
}

BOOST_AUTO_TEST_CASE(rows_are_counted_and_named) {
  const auto rows = linkage()->resolved();
  BOOST_TEST(rows->rows == 5 + 6 + 5 + 3 + 1 + 1);
  BOOST_TEST(rows->names[0] == "pin: about x");
  BOOST_TEST(rows->names[15] == "screw: along and about z");
  BOOST_TEST(rows->names[20] == "gear");
  for (int i = 0; i < rows->rows; ++i) BOOST_TEST(rows->of_positions[i] == (i != 17 && i != 18), rows->names[i]);
}

BOOST_AUTO_TEST_CASE(rows_allocate_nothing) {
  const auto set = linkage();
  const auto loops = set->resolved();
  const auto model = set->model().compiled<double>();
  LoopBuffers<double> w;
  std::vector<double> out(loops->rows), Q(loops->rows * model->nv);
  BOOST_TEST(testing::allocations_of([&] { loop_residuals(*model, *loops, q.data(), w, out.data()); }) == 0);
  BOOST_TEST(testing::allocations_of([&] { loop_jacobian(*model, *loops, q.data(), w, [&](int row, int i, double x) { Q[row * model->nv + i] = x; }); }) == 0);
  BOOST_TEST(testing::allocations_of([&] { loop_bias(*model, *loops, q.data(), v.data(), w, out.data()); }) == 0);
}

BOOST_AUTO_TEST_CASE(what_was_resolved_is_kept_until_something_changes) {
  const auto set = linkage();
  const auto first = set->resolved();
  BOOST_TEST(first == set->resolved());
  const_cast<Multibody&>(set->model()).add_node("eye", "one", {Matrix3<double>::identity(), {0, 0, 1}});
  BOOST_TEST(first != set->resolved());
  set->remove("wheel");
  BOOST_TEST(set->resolved()->rows == first->rows - 3);
  BOOST_CHECK_THROW(set->remove("wheel"), ModelError);
}
