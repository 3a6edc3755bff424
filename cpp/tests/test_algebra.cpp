// The algebra on random trees of mixed block sizes, no mechanics: arithmetic, equality, structure, theorems, plans.
#define BOOST_TEST_MODULE algebra
#include <boost/test/included/unit_test.hpp>

#include "algebra/engine/evaluate.h"
#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/properties.h"
#include "algebra/planning/shared_costs.h"
#include "algebra/planning/simplify.h"
#include "algebra/theorems/polynomial.h"
#include "random_tree.h"
#include "runtime/errors.h"

using namespace pycraft;
using namespace pycraft::testing;

namespace {

const std::vector<int> branched{-1, 0, 1, 1, 0, 4, -1}, serial{-1, 0, 1, 2, 3};
// Products of a dozen blocks of a well-conditioned tree round to about a thousand epsilon.
constexpr double rounding = 1e-12;

// A letter of one's own: a record, and a source whose values know its blocks, twice M(k).
const SymbolDefinition& doubled() {
  static const SymbolDefinition record = {static_cast<SymbolId>(1000), "doubled", "M₂", "M_2", "twice the inertias", SpaceKind::V, SpaceKind::F, Pattern::block_diagonal,
                                          {.symmetric = true}};
  return record;
}

template <class S>
class DoubledValues final : public TreeValues<DenseBlocks<S>> {
 public:
  DoubledValues(const SkoStructure& tree, const MatrixTree& numbers) : TreeValues<DenseBlocks<S>>(tree), numbers_(numbers) {}
  void block(const Symbol& symbol, int k, S* out) const override {
    if (symbol.definition != &doubled()) return TreeValues<DenseBlocks<S>>::block(symbol, k, out);
    std::transform(numbers_.M[k].begin(), numbers_.M[k].end(), out, [](double x) { return S(2 * x); });
  }

 protected:
  void set_state(const double*, const double*) override {}
  void fill() override {
    const auto copy = [](const std::vector<double>& from, S* to) { std::transform(from.begin(), from.end(), to, [](double x) { return S(x); }); };
    for (int k = 0; k < this->tree_.bodies(); ++k) {
      if (this->tree_.parent[k] >= 0) copy(numbers_.E[k], this->blocks_.edge(k));
      copy(numbers_.H[k], this->blocks_.hinge_map(k)), copy(numbers_.M[k], this->blocks_.mass(k)), copy(numbers_.J[k], this->blocks_.hinge_diagonal(k));
    }
  }

 private:
  const MatrixTree& numbers_;
};

class DoubledTree final : public SkoSource {
 public:
  explicit DoubledTree(std::shared_ptr<MatrixTree> numbers) : SkoSource(numbers->structure(), "doubled"), numbers_(std::move(numbers)) {}
  Traits traits() const override { return numbers_->traits(); }
  BlockCosts costs(int k) const override { return numbers_->costs(k); }
  int nq() const override { return 0; }
  int nv() const override { return 0; }
  void check_state(const double*, size_t, const double*, size_t) const override {}
  std::shared_ptr<const StateData> state() const override { return numbers_->state(); }
  std::uint64_t parameters() const override { return 0; }
#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> make_values(S) const override { return std::make_unique<DoubledValues<S>>(structure(), *numbers_); }
  PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

 private:
  std::shared_ptr<MatrixTree> numbers_;
};

}  // namespace

BOOST_AUTO_TEST_CASE(dense_forms_follow_their_definitions) {
  for (bool with_J : {false, true}) {
    const Letters o(random_tree(1, branched, with_J));
    const Dense E = dense(o.E), H = dense(o.H), M = dense(o.M), J = dense(o.J), D = dense(o.D), G = dense(o.G), P = dense(o.P);
    const Dense I = Dense::Identity(E.rows(), E.cols());
    BOOST_TEST(difference(dense(o.phi), (I - E).inverse()) < rounding);
    BOOST_TEST(difference(D, H * P * H.transpose() + J) < rounding);
    BOOST_TEST(difference(G, P * H.transpose() * D.inverse()) < rounding);
    const Dense bar = I - G * H;
    BOOST_TEST(difference(dense(o.E_psi), E * bar) < rounding);
    BOOST_TEST(difference(dense(o.psi), (I - E * bar).inverse()) < rounding);
    BOOST_TEST(difference(M, P - E * bar * P * E.transpose()) < rounding);
    BOOST_TEST(difference(dense(o.K), E * G) < rounding);
    const Dense U = dense(o.Upsilon), psi = dense(o.psi);
    BOOST_TEST(difference(dense(o.Omega), psi.transpose() * H.transpose() * D.inverse() * H * psi) < rounding);
    BOOST_TEST(difference(dense(block_diagonal(o.Omega)), U) < rounding);
  }
}

BOOST_AUTO_TEST_CASE(theorems_hold_or_fail_as_stated) {
  for (const auto& parents : {branched, serial})
    for (bool with_J : {false, true}) {
      const auto tree = random_tree(3, parents, with_J);
      for (const Theorem& t : sko_theorems(tree)) {
        if (!std::holds_alternative<Expression>(t.lhs) || t.at_most) continue;
        const bool applies = unmet(t.hypotheses, tree->traits()) == Hypothesis::no_hypothesis;
        if (contains(t.hypotheses, Hypothesis::free_root)) continue;  // Υ has no inverse without one
        std::map<std::string, std::vector<double>> vectors;
        const Residual r = residual(std::get<Expression>(t.lhs), std::get<Expression>(t.rhs), vectors, t.on_one_path);
        const double relative = r.difference / std::max({r.left, r.right, 1.0});
        if (applies) BOOST_TEST(relative < 1e-10, t.name << " " << relative);
      }
    }
}

BOOST_AUTO_TEST_CASE(equality_is_structural) {
  const Letters o(random_tree(1, branched));
  BOOST_TEST(((o.H * o.phi) * o.M == o.H * (o.phi * o.M)));
  BOOST_TEST(((o.phi + o.psi) + o.tau == o.tau + (o.psi + o.phi)));
  BOOST_TEST((o.phi * (o.psi + o.tau) != o.phi * o.psi + o.phi * o.tau));
  BOOST_TEST((o.phi.T().T() != o.phi));
  BOOST_TEST((2.0 * o.phi != o.phi + o.phi));
  BOOST_TEST(show(o.H * o.phi * o.M * o.phi.T() * o.H.T()) == "H φ M φ* H*");
  BOOST_TEST(show((o.I - o.H * o.psi * o.K).T(), Style::latex) == "{\\left(I - H \\psi \\mathcal{K}\\right)}^{*}");
}

BOOST_AUTO_TEST_CASE(spaces_are_compared) {
  const Letters o(random_tree(1, branched)), other(random_tree(2, branched));
  BOOST_CHECK_THROW(o.H * o.H, SpaceError);
  BOOST_CHECK_THROW(o.phi + o.M, SpaceError);
  BOOST_CHECK_THROW(o.H * other.phi, SpaceError);
  BOOST_CHECK_THROW(o.H.inv(), SpaceError);
  BOOST_CHECK_THROW(o.M + o.I, SpaceError);
  try {
    o.H * o.H;
  } catch (const SpaceError& e) {
    const std::string text = e.what();
    BOOST_TEST(text.find("it cannot follow H, which ends in Θ") != std::string::npos, text);
  }
}

BOOST_AUTO_TEST_CASE(structure_is_known_by_rule) {
  const Letters o(random_tree(1, branched));
  BOOST_TEST(is_block_diagonal(o.E * o.P * o.E.T()));
  BOOST_TEST(!is_block_diagonal(o.E.T() * o.Upsilon * o.E));  // siblings
  BOOST_TEST(is_upper_triangular(o.phi * o.M));
  BOOST_TEST(is_lower_triangular(o.psi.T() * o.phi.T()));
  BOOST_TEST(!is_upper_triangular(o.phi * o.M * o.phi.T()));
  BOOST_TEST(is_symmetric(o.H * o.phi * o.M * o.phi.T() * o.H.T() + o.J));
  BOOST_TEST(!is_symmetric(o.phi));
}

BOOST_AUTO_TEST_CASE(inverses_of_any_rational_expression) {
  for (unsigned seed : {1u, 2u, 3u}) {
    const Letters o(random_tree(seed, branched, seed == 2));
    const Expression MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
    const Dense A = dense(MM), D = dense(o.D), I = Dense::Identity(A.rows(), A.cols()), J = dense(o.J);
    const double condition = (A + J).norm() * (A + J).inverse().norm();
    const double bound = 1e-13 * condition;
    BOOST_TEST(difference(dense((MM + o.J).inv()), (A + J).inverse()) < bound);
    BOOST_TEST(difference(dense((MM + 0.1 * o.I).inv()), (A + 0.1 * I).inverse()) < bound);
    BOOST_TEST(difference(dense((MM.inv() + 0.01 * o.D).inv()), (A.inverse() + 0.01 * D).inverse()) < bound);
    const Dense inner = I + dense(o.H) * dense(o.phi) * dense(o.K) * D;
    BOOST_TEST(difference(dense((o.I + o.H * o.phi * o.K * o.D).inv()), inner.inverse()) < bound);
    Result r;
    evaluate(MM + 0.3 * o.I, Request::logdet, r);
    BOOST_TEST(std::abs(r.values[0] - std::log((A + 0.3 * I).determinant())) < 1e-10);
    evaluate((MM + 0.3 * o.I).inv(), Request::diagonal, r);
    const Eigen::VectorXd diagonal = (A + 0.3 * I).inverse().diagonal();
    for (int i = 0; i < diagonal.size(); ++i) BOOST_TEST(std::abs(r.values[i] - diagonal[i]) < bound * diagonal.cwiseAbs().maxCoeff());
  }
}

BOOST_AUTO_TEST_CASE(low_rank_borders_and_full_constants) {
  const Letters o(random_tree(4, branched));
  const Space theta = o.source->theta();
  const int n = theta.dimension();
  std::mt19937 g(5);
  const std::vector<double> u = random_block(g, n, 2);
  const Expression U = constant(u, Space::euclidean(2), theta, "U");
  const Expression MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
  const Dense A = dense(MM), Ud = Eigen::Map<const Dense>(u.data(), n, 2);
  const Expression bordered = (MM + U * U.T()).inv();
  BOOST_TEST(!prepare(bordered, Request::apply)->plan().has_dense_step());
  BOOST_TEST(difference(dense(bordered), (A + Ud * Ud.transpose()).inverse()) < 1e-10);
  // the same as one array: its rank is found
  const Dense full = Ud * Ud.transpose();
  const Expression found = (MM + constant(std::vector<double>(full.data(), full.data() + full.size()), theta, theta, "UU*")).inv();
  BOOST_TEST(!prepare(found, Request::apply)->plan().has_dense_step());
  BOOST_TEST(difference(dense(found), dense(bordered)) < 1e-10);
  // a full matrix is dense, and the plan says so
  const Expression C = (MM + constant(random_positive(g, n), theta, theta, "C")).inv();
  BOOST_TEST(prepare(C, Request::apply)->plan().has_dense_step());
}

BOOST_AUTO_TEST_CASE(normal_forms_prove_what_they_should) {
  const Letters o(random_tree(1, branched, true));
  const Expression A = o.I + o.H * o.phi * o.K, MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
  BOOST_TEST(equal_by_theorems(MM + o.J, A * o.D * A.T()));
  BOOST_TEST(!equal_by_theorems(MM, A * o.D * A.T()));  // J is there
  BOOST_TEST(equal_by_theorems(o.psi.inv() * o.phi, o.I + o.K * o.H * o.phi));
  BOOST_TEST(!equal_by_theorems(o.phi, o.psi));
  const Letters p(random_tree(1, branched));
  BOOST_TEST(equal_by_theorems(p.H * p.psi * p.M * p.psi.T() * p.H.T(), p.D));
  BOOST_TEST((simplify(p.psi.inv() * p.phi) == lower(p.I + p.K * p.H * p.phi, false) || simplify(p.H * p.G).kind() == NodeKind::identity));
}

BOOST_AUTO_TEST_CASE(rules_change_no_value) {
  const Letters o(random_tree(6, branched, true));
  const Expression MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
  for (const Expression& e : {MM, MM.inv(), (MM + o.J).inv(), o.psi.inv() * o.phi, o.phi * o.R * o.phi.T(), o.tau_bar * o.P * o.tau_bar.T(), o.Omega * o.M * o.Omega,
                              o.H * (o.R + o.phi_tilde * o.R + o.R * o.phi_tilde.T()) * o.H.T(), (o.I + o.H * o.phi * o.K).inv()})
    BOOST_TEST(difference(dense(e, true), dense(e, false)) < 1e-9, show(e));
}

// Whatever was asked before, and of whatever parts in common: what a plan of its own would cost. Flops in another order round once each.
BOOST_AUTO_TEST_CASE(shared_costs_are_those_of_plans) {
  const auto tree = random_tree(6, branched, true);
  const Letters o(tree);
  const Space& theta = o.D.domain();
  std::mt19937 g(1);
  const Expression full = constant(random_block(g, theta.dimension(), theta.dimension()), theta, theta, "C");
  const Expression MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
  const Expression swept = block_diagonal(o.psi * (o.M + o.E * o.P_plus * o.E.T()) * o.psi.T());
  const std::vector<Expression> asked = {o.K * o.K.T(), o.tau * o.P * o.tau_bar.T(), MM, MM + o.J, (MM + 0.1 * o.I).inv(), (MM + full).inv() * o.D, o.H * swept * o.H.T() + o.D, swept * o.H.T() - 2 * (o.P * o.H.T()),
                                         o.psi.T() * o.Upsilon * o.psi, block_diagonal(o.phi.T() * o.E.T() * o.Upsilon * o.E * o.phi), o.K * (o.D.inv() + o.I) * o.K.T(), o.phi.inv() * o.R, 3 * o.Upsilon,
                                         (o.I - o.G * o.H) * o.P * (o.I - o.H.T() * o.G.T()) + o.G * o.D * o.G.T()};
  SharedCosts together({tree, nullptr}, true);
  for (int turn = 0; turn < 2; ++turn)
    for (const Expression& typed : asked) {
      const Expression e = lower(typed, false);
      const auto own = [](const Expression& x) { return make_plan(x, Request::apply, {false})->flops(); };
      BOOST_TEST(together.flops(e) == own(e), boost::test_tools::tolerance(1e-14) << show(e));
      Alphabet alphabet;
      const auto form = normal_form(e, alphabet);
      if (!form) continue;
      const Expression written = lower(to_expression(*form, alphabet, e.domain(), e.codomain()), false);
      BOOST_TEST(together.flops(*form, alphabet, e.domain(), e.codomain()) == own(written), boost::test_tools::tolerance(1e-14) << show(written));
    }
}

BOOST_AUTO_TEST_CASE(degenerate_trees) {
  SkoStructure none;
  none.finish();
  const Letters o(std::make_shared<MatrixTree>(none, "nothing", std::vector<std::vector<double>>{}, std::vector<std::vector<double>>{}, std::vector<std::vector<double>>{},
                                               std::vector<std::vector<double>>{}));
  const Expression MM = o.H * o.phi * o.M * o.phi.T() * o.H.T();
  BOOST_TEST(dense(MM).size() == 0);
  BOOST_TEST(dense(MM.inv()).size() == 0);
  Result r;
  evaluate(MM, Request::logdet, r);
  BOOST_TEST(r.values[0] == 0.0);
  const Letters one(random_tree(9, {-1}));
  BOOST_TEST(difference(dense((one.H * one.phi * one.M * one.phi.T() * one.H.T()).inv()), dense(one.D.inv())) < rounding);
}

BOOST_AUTO_TEST_CASE(a_letter_of_ones_own_is_a_record_and_blocks) {
  const auto tree = std::make_shared<DoubledTree>(random_tree(4, branched, true));
  const Letters o(tree);
  const Expression M2 = make_symbol(doubled(), tree);
  BOOST_TEST(show(o.H * o.phi * M2) == "H φ M₂");
  BOOST_TEST(show(M2, Style::latex) == "M_2");
  BOOST_TEST(is_block_diagonal(M2));
  BOOST_TEST(is_symmetric(o.phi * M2 * o.phi.T()));
  const Expression X = o.H * o.phi * M2 * o.phi.T() * o.H.T() + o.J;
  const Dense H = dense(o.H), phi = dense(o.phi), M = dense(o.M), J = dense(o.J);
  const Dense value = 2 * H * phi * M * phi.transpose() * H.transpose() + J;
  BOOST_TEST(difference(dense(X), value) < rounding);
  BOOST_TEST(difference(dense(X.inv()), value.inverse()) < rounding * value.norm() * value.inverse().norm());  // over the tree, as any sum is
  BOOST_TEST(difference(dense(block_diagonal(o.phi * M2 * o.phi.T())), 2 * dense(o.R)) < rounding);
  BOOST_TEST((M2 == make_symbol(doubled(), tree)));
  BOOST_CHECK_THROW(make_symbol(doubled(), tree, OfCoordinate{0}), EvaluationError);
}
