#include "algebra/planning/planner.h"

#include <algorithm>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/patterns.h"
#include "algebra/language/properties.h"
#include "algebra/planning/check_shapes.h"
#include "algebra/planning/costs.h"
#include "algebra/planning/plan_tangents.h"
#include "algebra/planning/planning.h"
#include "algebra/planning/recognise.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

using namespace planning;

// ------------------------------------------------------------------ registers and steps

int Planner::new_register(RegisterKind kind, const Space& rows, const Space& columns, bool wide) {
  plan_.registers.push_back({kind, rows, columns, nullptr, wide});
  return static_cast<int>(plan_.registers.size()) - 1;
}

int Planner::emit(Step step, Register out) {
  check_interrupt();
  if (plan_.steps.size() >= most_)
    throw EvaluationError("the plan of " + plan_.text + " takes more than " + std::to_string(most_steps) +
                          " steps: parts of it are applied to many vectors; evaluate such a part, and go on with it as a constant");
  plan_.registers.push_back(std::move(out));
  step.out = static_cast<int>(plan_.registers.size()) - 1;
  step.symbol.binding = nullptr;  // the context holds it
  plan_.steps.push_back(std::move(step));
  return plan_.steps.back().out;
}

int Planner::context_of(const Symbol& symbol, unsigned groups) {
  const Context wanted{symbol.source, symbol.binding};
  auto found = std::find(plan_.contexts.begin(), plan_.contexts.end(), wanted);
  if (found == plan_.contexts.end()) {
    plan_.contexts.push_back(wanted);
    plan_.groups.push_back(0);
    plan_.hinge_diagonal.push_back(symbol.source->traits().hinge_diagonal);
    found = plan_.contexts.end() - 1;
  }
  const int c = static_cast<int>(found - plan_.contexts.begin());
  plan_.groups[c] |= groups;
  return c;
}

std::string Planner::shown(const Expression& e) const { return for_costs_ ? std::string() : show(e); }

int Planner::id_of(const Expression& e) {
  const auto [known, fresh] = ids_of_nodes_.try_emplace(e.get(), -1);
  if (fresh) {
    met_.push_back(e);
    known->second = ids_.try_emplace(e, static_cast<int>(ids_.size())).first->second;
  }
  return known->second;
}

// The sweeps that make the values go in front; a run skips those that are cached.
void Planner::emit_values() {
  std::vector<Step> front;
  for (size_t c = 0; c < plan_.contexts.size(); ++c) {
    const std::pair<unsigned, const char*> names[] = {{Group::kinematics, "E, H, M, J"},
                                                      {Group::articulated, "P, D, G (Riccati sweep, tip to base)"},
                                                      {Group::composite, "R (composite-body sweep, tip to base)"},
                                                      {Group::compliance, "Υ (Lyapunov sweep, base to tip)"},
                                                      {Group::velocities, "velocities (base to tip)"},
                                                      {Group::inverse, "ℳ⁻¹ over links (Riccati sweep, tip to base)"}};
    for (const auto& [group, text] : names) {
      if (!(plan_.groups[c] & group)) continue;
      Step s{StepKind::values};
      s.context = static_cast<int>(c);
      s.groups = group;
      s.flops = group_flops(*plan_.contexts[c].source, group);
      s.bytes = group_bytes(*plan_.contexts[c].source, group);
      s.tier = 0;
      s.text = text;
      front.push_back(s);
    }
  }
  plan_.steps.insert(plan_.steps.begin(), std::make_move_iterator(front.begin()), std::make_move_iterator(front.end()));
}

// ------------------------------------------------------------------ requests

namespace {

// Steps whose result nobody reads (left by attempts that a better way overtook) go.
void drop_unused(Plan& plan) {
  std::vector<char> needed(plan.registers.size(), 0);
  if (plan.output >= 0) needed[plan.output] = 1;
  std::vector<Step> kept;
  for (auto s = plan.steps.rbegin(); s != plan.steps.rend(); ++s) {
    if (s->out >= 0 && !needed[s->out]) continue;
    each_register_read(*s, [&](int r) { needed[r] = 1; });
    kept.push_back(std::move(*s));
  }
  std::reverse(kept.begin(), kept.end());
  plan.steps = std::move(kept);
}

// The identity of a space's numbers as a map to its dual, W of ‖X‖² = tr(X* W X); none for spaces of nodes.
std::optional<Expression> euclidean_weight(const Space& space) {
  if (space == space.dual()) return identity(space);
  if (!space.belongs_to_bodies()) return std::nullopt;
  std::vector<std::vector<double>> blocks;
  for (size_t k = 0; k < space.layout().of_body.size(); ++k) {
    const size_t n = size_t(space.body_size(static_cast<int>(k)));
    blocks.emplace_back(n * n, 0.0);
    for (size_t i = 0; i < n; ++i) blocks.back()[i * n + i] = 1;
  }
  return constant_blocks(std::move(blocks), space, space.dual(), "I");
}

// Of the symbols where one is bound, else of the leaves whose numbers hang on no state.
Precision precision_of(const Expression& e) {
  std::optional<Precision> symbols, leaves;
  visit(e, [&](const Expression& x) {
    const Symbol& s = x.node().symbol;
    if (!s.binding) return;
    auto& found = s.source ? symbols : leaves;
    const Precision p = s.binding->arithmetic.precision;
    if (s.source && found.value_or(p) != p) throw EvaluationError("two precisions in one expression: bind all of it with one .at(..., precision=...)");
    found = p;
  });
  return symbols ? *symbols : leaves.value_or(Precision::double_);
}

// Whether the plan, or an operand's, takes diagonal blocks from the factors of an elimination, or numbers from triangular factors.
bool reads_factors(const Plan& plan) {
  return std::any_of(plan.steps.begin(), plan.steps.end(), [](const Step& s) {
    return s.kind == StepKind::selected_blocks || (s.kind == StepKind::dense_factor && s.flag) || (s.operand && reads_factors(*s.operand));
  });
}

// Determinants, traces, diagonals, triangular factors and diagonal blocks of what is solved have no residual that a solve would correct:
// refinement of them is the next precision up. Of what is not solved there is none.
bool refined_by_precision(const Plan& plan) {
  const auto uses = [&](auto which) { return std::any_of(plan.steps.begin(), plan.steps.end(), which); };
  if (uses([](const Step& s) { return s.kind == StepKind::apply_external || (s.operand && std::any_of(s.operand->steps.begin(), s.operand->steps.end(), [](const Step& o) { return o.kind == StepKind::apply_external; })); }))
    return false;  // what comes from outside computes in double precision
  switch (plan.request) {
    case Request::block_diagonal:
    case Request::diagonal:
    case Request::trace:
      return std::any_of(plan.groups.begin(), plan.groups.end(), [](unsigned g) { return (g & (Group::articulated | Group::compliance | Group::inverse)) != 0; }) ||
             uses([](const Step& s) { return s.kind == StepKind::factor || s.kind == StepKind::dense_factor || s.kind == StepKind::invert_blocks || s.operand; });
    case Request::logdet: return true;
    default: return reads_factors(plan);
  }
}

bool refinement_asked(const Plan& plan) {
  return std::any_of(plan.contexts.begin(), plan.contexts.end(), [](const Context& c) { return c.binding && c.binding->arithmetic.refinement.steps != 0; });
}

// Whether a step of the plan, or of an operand's, is a solve that refinement corrects.
bool solves(const Plan& plan) {
  return std::any_of(plan.steps.begin(), plan.steps.end(), [](const Step& s) {
    return s.kind == StepKind::solve || s.kind == StepKind::mass_matrix_solve || s.kind == StepKind::dense_solve || (s.operand && solves(*s.operand));
  });
}

Precision wider(Precision precision) {
  return precision == Precision::digits100 ? precision : static_cast<Precision>(static_cast<int>(precision) + 1);
}

}  // namespace

Plan Planner::plan(const Expression& typed, Request request) {
  plan_ = Plan{};
  plan_.request = request;
  plan_.text = shown(typed);
  typed.check_current();
  more_digits_ = precision_of(typed) > Precision::double_;
  Expression e = lower(typed, false);
  if (options_.rules) e = optimise(with_swept_tangents(e, request), plan_.notes);
  one_cut_ = cut_in_one_way(e);
  plan_.domain = e.domain();
  plan_.codomain = e.codomain();
  switch (request) {
    case Request::apply: apply_to_input(e); break;
    case Request::dense: plan_dense(e); break;
    case Request::block_diagonal:
    case Request::diagonal:
    case Request::trace: plan_diagonal(e, typed); break;
    case Request::logdet: plan_.output = logdet(e); break;
    case Request::norm: plan_norm(e); break;
  }
  finish();
  plan_arithmetic(typed);
  return std::move(plan_);
}

void Planner::apply_to_input(const Expression& e) {
  plan_.input = new_register(RegisterKind::vector, e.domain(), {}, true);
  plan_.output = apply(e, plan_.input);
}

void Planner::apply_to_identity(const Expression& e) {
  plan_.columns_of_identity = true;
  apply_to_input(e);
}

void Planner::plan_dense(const Expression& e) {
  const Register out{RegisterKind::dense, e.codomain(), e.domain(), nullptr, false};
  const double bytes = 8.0 * e.domain().dimension() * e.codomain().dimension();
  if (cut_alike(e.domain(), e.codomain()) && is_block_diagonal(e)) {
    Step s{StepKind::gather_blocks};
    s.in = {blocks(e)};
    s.bytes = bytes;
    s.text = "blocks as a matrix";
    plan_.output = emit(std::move(s), out);
    return;
  }
  const auto with_rotors = mass_matrices_with_rotors(e);
  const bool with_J = e.kind() == NodeKind::sum && e.children().size() == 2 && with_rotors.size() == 1 && with_rotors[0].coefficient == 1;
  const Symbol* model = with_J ? &with_rotors[0].model : mass_matrix_model(e);
  if (!options_.rules || !model) return apply_to_identity(e);
  Step s{StepKind::mass_matrix_dense};
  s.flag = with_J;
  s.context = context_of(*model, Group::kinematics | Group::composite);
  s.flops = mass_matrix_dense_flops(*model->source);
  s.bytes = bytes;
  s.tier = 1;
  s.text = "composite-body assembly of HφMφ*H*";
  plan_.output = emit(std::move(s), out);
}

void Planner::plan_diagonal(const Expression& e, const Expression& typed) {
  if (plan_.request == Request::block_diagonal) {
    if (!cut_alike(e.domain(), e.codomain())) return apply_to_identity(e);
    plan_.output = diagonal_blocks(e);
    return;
  }
  const bool trace = plan_.request == Request::trace;
  const char* what = trace ? "trace" : "diagonal";
  if (e.domain().dimension() != e.codomain().dimension())
    throw SpaceError(std::string(what) + " of " + show(typed) + ", which maps " + e.domain().description() + " to " + e.codomain().description() + ": it is not square");
  if (!cut_at_the_same_rows(e.domain(), e.codomain())) return apply_to_identity(e);  // entries (i, i) lie in no body's block
  Step s{trace ? StepKind::trace_of_blocks : StepKind::diagonal_of_blocks};
  s.in = {diagonal_blocks(e)};
  s.text = what;
  plan_.output = emit(std::move(s), {trace ? RegisterKind::scalar : RegisterKind::vector, e.codomain(), {}, nullptr, false});
}

// Small or tall operators column by column; long ones as tr(X*X) over the tree.
void Planner::plan_norm(const Expression& e) {
  const Register scalar{RegisterKind::scalar, {}, {}, nullptr, false};
  const bool bodies = cut_alike(e.domain(), e.codomain());
  const std::optional<Expression> weight = e.domain().dimension() > 600 && bodies ? euclidean_weight(e.codomain()) : std::nullopt;
  if (weight) {
    const Expression square = lower(e.T() * *weight * e, false);
    std::string reason;
    if (is_block_diagonal(e) || build_realization(*this, square, true, reason)) {
      Step s{StepKind::root_of_trace};
      s.in = {diagonal_blocks(square)};
      s.text = "norm from tr(X*X)";
      plan_.output = emit(std::move(s), scalar);
      return;
    }
  }
  apply_to_identity(e);
  Step s{StepKind::norm_of_vector};
  s.in = {plan_.output};
  s.text = "norm, columns of the identity some at a time";
  plan_.output = emit(std::move(s), scalar);
}

// Batch, precision and refinement of what was typed: theorems may leave nothing in the plan that hangs on a state.
void Planner::plan_arithmetic(const Expression& typed) {
  // A theorem may have used J = 0 and left nothing of a model: the plan hangs on it all the same.
  for (const Context& c : contexts(typed))
    if (std::none_of(plan_.contexts.begin(), plan_.contexts.end(), [&](const Context& known) { return known.source == c.source; })) {
      plan_.contexts.push_back(c);
      plan_.groups.push_back(0);
      plan_.hinge_diagonal.push_back(c.source->traits().hinge_diagonal);
    }
  plan_.batch = batch_of(typed);
  plan_.batched = plan_.batch >= 0;
  plan_.precision = precision_of(typed);
  if (!refinement_asked(plan_)) return;
  if (refined_by_precision(plan_)) {
    plan_.precision = wider(plan_.precision);
    plan_.notes.push_back("refinement: there is no solve to correct here, so all of it is computed one precision up");
  } else if (!solves(plan_)) {
    plan_.notes.push_back("refinement: there is no solve here, so nothing is corrected");
  }
}

// Where other steps ask for P, D or G, ℳ⁻¹ goes by those, too.
void Planner::share_articulated() {
  for (size_t c = 0; c < plan_.contexts.size(); ++c) {
    unsigned& groups = plan_.groups[c];
    if (!(groups & Group::inverse) || !(groups & Group::articulated)) continue;
    groups = (groups & ~unsigned(Group::inverse)) | Group::kinematics;
    for (Step& s : plan_.steps)
      if (s.kind == StepKind::mass_matrix_solve && s.context == static_cast<int>(c)) s.flag = false;
  }
}

void Planner::finish() {
  drop_unused(plan_);
  check_shapes(plan_);
  share_articulated();
  emit_values();
}

Plan Planner::plan_lowered(const Expression& e) {
  plan_ = Plan{};
  plan_.request = Request::apply;
  plan_.text = shown(e);
  plan_.domain = e.domain();
  plan_.codomain = e.codomain();
  apply_to_input(e);
  finish();
  return std::move(plan_);
}

std::shared_ptr<const Plan> make_plan(const Expression& e, Request request, const PlanOptions& options) {
  std::shared_ptr<const Plan> made;
  with_stack_for(e.node().depth, [&] { made = std::make_shared<const Plan>(Planner(options).plan(e, request)); });
  return made;
}

double Plan::flops() const {
  double sum = 0;
  for (const Step& s : steps) sum += s.flops;
  return sum;
}

double Plan::bytes() const {
  double sum = 0;
  for (const Step& s : steps) sum += s.bytes;
  return sum;
}

bool Plan::calls_outside() const {
  return std::any_of(steps.begin(), steps.end(), [](const Step& s) { return s.external || (s.operand && s.operand->calls_outside()); });
}
bool Plan::has_dense_step() const {
  return std::any_of(steps.begin(), steps.end(), [](const Step& s) { return s.tier == 4; });
}

}  // namespace pycraft
