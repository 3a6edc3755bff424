// From an expression to a plan, in three tiers: a recognised kernel; sweeps of resolvents; realization and elimination. Only a full
// dense constant, somebody else's operator under an inverse, or (found at run time) a singular pivot goes to a dense factorization.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "algebra/language/expression.h"
#include "algebra/language/mixed_hash.h"
#include "algebra/language/scalar_expression.h"
#include "algebra/planning/plan.h"
#include "algebra/planning/realization.h"

namespace pycraft {

// Steps of one plan; beyond it a shared part occurs too many times over.
constexpr size_t most_steps = 200000;

class Planner {
 public:
  explicit Planner(const PlanOptions& options) : options_(options) {}

  // The request as a plan. Recurses as deep as the expression is nested (with_stack_for).
  Plan plan(const Expression& e, Request request);

 private:
  friend class RealizationBuilder;
  friend class SharedCosts;

  // The operand of a dense factorization, lowered, for the plan of `whole`, which holds the factors of what is dense inside it.
  Planner(const PlanOptions& options, Planner& whole) : options_(options), for_costs_(whole.for_costs_), whole_(&whole) {}
  Plan plan_lowered(const Expression& lowered);
  void finish();
  void share_articulated();

  // ---- what is asked for
  void apply_to_input(const Expression& e);
  void apply_to_identity(const Expression& e);  // its columns some at a time
  void plan_dense(const Expression& e);
  void plan_diagonal(const Expression& e, const Expression& typed);
  void plan_norm(const Expression& e);
  void plan_arithmetic(const Expression& typed);

  // ---- steps and registers
  int new_register(RegisterKind kind, const Space& rows, const Space& columns, bool wide);
  int emit(Step step, Register out);
  int context_of(const Symbol& symbol, unsigned groups);
  void emit_values();

  // ---- vectors: registers of y = e x
  int apply(const Expression& e, int x);
  int apply_anew(const Expression& e, int x);
  int apply_given(const Expression& e, const Expression& given, bool transposed, int x);
  int apply_product(const std::vector<Expression>& factors, int x);
  size_t apply_kernel(const std::vector<Expression>& factors, size_t end, int& x);
  int emit_vector(Step s, const Space& space, int x);
  int emit_kernel(StepKind kind, const Symbol& model, bool with_J, int x, const char* text);
  bool inverse_by_itself(const Symbol& model) const;
  int apply_sum(const Expression& e, int x);
  int apply_symbol(const Expression& letter, bool transposed, bool inverted, int x);
  int apply_inverse(const Expression& e, int x);
  int apply_inverse_tangent(const Symbol& symbol, int x);
  int apply_blocks(int block, bool transposed, int x, const std::string& text);
  int vector_value(const Expression& e);
  int named_vector(const std::string& name, const Space& space);
  void read_also(const Plan& operand);   // what an operand's plan reads: models at their states, named vectors
  int column(const Expression& e);   // a vector expression as one column, whatever the run's width
  int solve_realization(const Expression& e, int x);
  int dense_factor(const Expression& operand, const std::string& reason);   // a register of the whole plan
  int solve_dense(const Expression& operand, int x, const std::string& reason);
  std::optional<Expression> gram_root(const Expression& e) const;
  int factor_gram(const Expression& e, const Expression& root);
  std::shared_ptr<const Plan> plan_operand(const Expression& operand);

  // ---- block registers of block-diagonal expressions
  int blocks(const Expression& e);
  int blocks_anew(const Expression& e);
  int blocks_of_sum(const Expression& e);
  int blocks_of_product(const Expression& e);
  int blocks_of_function(const Expression& e);
  int emit_blocks(Step s, const Expression& e, const std::string& text);
  int multiply_blocks(int a, int b);
  int identity_blocks(const Space& rows, const Space& columns);
  int zero_blocks(const Space& rows, const Space& columns);

  // ---- structure
  std::optional<int> diagonal_by_structure(const Expression& e);   // block register of blockdiag(e), no elimination
  std::optional<int> structural_diagonal(const Expression& e);     // the same, not remembered
  int diagonal_blocks(const Expression& e);
  std::optional<int> diagonal_by_theorem(const std::vector<Expression>& factors);
  std::optional<int> diagonal_of_product(const Expression& e);
  std::optional<int> diagonal_of_congruence(const Expression& e);
  int logdet(const Expression& e);
  int logdet_by_elimination(const Expression& e);
  int combine_scalars(std::vector<int> in, std::vector<Coefficient> coefficients, const std::string& text, const Coefficient& constant);
  std::optional<std::vector<int>> logdet_of_factors(const std::vector<Expression>& factors);
  std::optional<int> logdet_by_structure(const Expression& e);

  int id_of(const Expression& e);                // the same for equal expressions
  std::string shown(const Expression& e) const;  // as steps have it
  double vector_bytes(const Space& space) const { return 8.0 * space.dimension(); }

  struct PairHash {
    size_t operator()(const std::pair<int, int>& p) const { return mix(size_t(p.first), size_t(p.second)); }
  };

  PlanOptions options_;
  bool one_cut_ = true;              // no coordinates are cut into bodies in two ways
  bool for_costs_ = false;           // nobody reads what steps and plans say of themselves
  bool part_ = false;                // of another plan
  bool more_digits_ = false;         // bound to a precision above double
  Plan plan_;
  size_t most_ = most_steps;         // steps that the plan may have
  std::unordered_map<Expression, int, ExpressionHash> ids_;
  std::unordered_map<const Expression::Node*, int> ids_of_nodes_;   // of those in met_
  std::vector<Expression> met_;
  std::unordered_map<std::pair<int, int>, int, PairHash> vector_memo_, block_product_memo_;
  std::unordered_map<int, int> block_memo_;
  std::unordered_map<int, std::optional<int>> diagonal_memo_;
  Planner* whole_ = nullptr;                // null: this is the whole plan
  std::map<int, int> dense_memo_;           // of the whole plan: factors by operand
  std::map<int, int> imported_;             // of an operand's plan: its registers for those of the whole
};

}  // namespace pycraft
