#include "algebra/engine/taped_plan.h"

#include <algorithm>

#include "algebra/engine/evaluate.h"
#include "algebra/engine/run.h"
#include "algebra/engine/written_plan.h"
#include "lanes/lane_sets.h"
#include "numerics/recorded_tape.h"

namespace pycraft {

namespace {

bool carries_out(const Plan& plan, bool (*on_tape)(const Plan&, const Step&)) {
  return std::all_of(plan.steps.begin(), plan.steps.end(), [&](const Step& s) { return on_tape(plan, s) && (!s.operand || carries_out(*s.operand, on_tape)); });
}

// Not what somebody else does, nor rows sorted by their sizes.
bool step_on_tape(const Plan&, const Step& s) { return s.kind != StepKind::apply_external && !(s.kind == StepKind::dense_factor && s.flag); }

bool decided_state_by_state(const Plan& plan, const Step& s) {
  if (s.kind == StepKind::factor || s.kind == StepKind::dense_factor) return false;
  if (s.kind != StepKind::invert_blocks && s.kind != StepKind::logdet_of_blocks) return true;
  const Space& space = plan.registers[s.in[0]].space;
  for (size_t k = 0; k < space.layout().of_body.size(); ++k)
    if (space.body_size(static_cast<int>(k)) > 1) return false;
  return true;
}

// A plan that is being written down as source: at the first state of its batch instead of one like any other, arrays of states from this one on; its
// one number, of which a scalar is made, is no result.
struct AsSource {
  int first_array;
  Recorded* number;
};
thread_local const AsSource* as_source = nullptr;

// Numbers of one size, none a simple ratio of another.
std::vector<double> generic(size_t size) {
  std::vector<double> x(size);
  for (size_t i = 0; i < size; ++i) x[i] = elimination::scattered<double>(i);
  return x;
}

}  // namespace

bool elimination::for_source() { return as_source != nullptr; }

bool recordable(const Plan& plan) {
  return plan.batched && plan.precision == Precision::double_ && carries_out(plan, step_on_tape) &&
         std::all_of(plan.contexts.begin(), plan.contexts.end(), [](const Context& c) { return !c.binding || c.binding->arithmetic.refinement.steps == 0; });
}

bool decides_once(const Plan& plan) { return !carries_out(plan, decided_state_by_state); }

void take_recorded_values(const Plan& plan, Workspace<Recorded>& w) {
  w.own_values.resize(plan.contexts.size());
  w.values.assign(plan.contexts.size(), nullptr);
  for (size_t c = 0; c < plan.contexts.size(); ++c) {
    const auto& [source, binding] = plan.contexts[c];
    source->check_current();
    std::unique_ptr<SkoValues<Recorded>>& own = w.own_values[c] = source->make_values(Recorded());
    if (!own) throw Recording::OffTape();
    const bool batch = binding && binding->batch >= 0;
    const StateData at = batch && !as_source ? source->generic_state() : binding ? StateData{binding->q, binding->v} : *source->state();
    if (binding) own->use(binding->arithmetic.form);
    Recording::current()->take_states_from(batch ? (as_source ? as_source->first_array : 0) + 2 * static_cast<int>(c) : -1);
    own->move_to(at.q.data(), at.v.data());
    own->require(plan.groups[c]);
    w.values[c] = own.get();
  }
}

void take_recorded(const double* given, size_t size, int array, std::vector<Recorded>& to) {
  to.resize(size);
  for (size_t i = 0; i < size; ++i) to[i] = Recording::current()->input(given[i], array, static_cast<int>(i));
}

void record_result(size_t at, const Recorded& value) {
  if (as_source && as_source->number)
    *as_source->number = value;
  else
    Recording::current()->result(static_cast<int>(at), value);
}

namespace {

// A run in a workspace of recorded numbers, on inputs like any others.
PassCounts run_recorded(const Plan& plan, Workspace<Recorded>& workspace, int columns, bool with_x, Result& result) {
  Inputs inputs;
  const std::vector<double> x = generic(with_x && plan.input >= 0 ? size_t(plan.domain.dimension()) * columns : 0);
  if (with_x) inputs.x = x.data();
  inputs.columns = columns;
  for (const auto& [name, r] : plan.vectors) inputs.vectors[name] = generic(plan.registers[r].space.dimension());
  Run<Recorded> run(plan, workspace, inputs, false, result, {});
  run.run(0);
  return run.counts();
}

}  // namespace

std::shared_ptr<const TapedPlan> taped(const std::shared_ptr<const Plan>& plan, int columns, bool with_x, size_t most) {
  Recording recording(most);
  Workspace<Recorded> workspace(plan);
  Result result;
  PassCounts counts;
  try {
    counts = run_recorded(*plan, workspace, columns, with_x, result);
  } catch (const Recording::OffTape&) {
    return nullptr;
  } catch (const Error&) {  // at this state there is no result
    return nullptr;
  }
  if (!recording.trusted() || !workspace.notes().empty()) return nullptr;
  kernels::Program program = kernels::program_of(recording.tape(), kernels::lane_set().functions.width);
  const size_t instructions = program.instructions;
  return std::make_shared<TapedPlan>(TapedPlan{std::move(program), counts, result.rows, result.columns, instructions});
}

// ------------------------------------------------------------------ plans as source

namespace {

const Step* outside(const Plan& plan) {
  for (const Step& s : plan.steps) {
    if (s.kind == StepKind::apply_external) return &s;
    if (const Step* const inner = s.operand ? outside(*s.operand) : nullptr) return inner;
  }
  return nullptr;
}

void check_writable(const Plan& plan) {
  const auto refuse = [&](const std::string& why) {
    throw EvaluationError("compile() cannot record " + plan.text + ": " + why + ". Evaluate it by at(q), which takes batches; or compile it at one state: at(q).compile()");
  };
  if (const Step* const s = outside(plan)) throw EvaluationError("compile() cannot see into '" + s->external->name + "', an operator from outside");
  for (const auto& [source, binding] : plan.contexts) {
    if (binding && binding->batch >= 0 && binding->batch != 1) refuse("it is bound to a batch of " + std::to_string(binding->batch) + " states");
    if (binding && binding->arithmetic.refinement.steps != 0) throw EvaluationError("compile() writes no refinement; bind " + plan.text + " without refine=");
    if (!source->make_values(Recorded())) refuse("it has letters of '" + source->name() + "', whose values are known at one state alone");
  }
  if (plan.precision != Precision::double_) throw EvaluationError("compile() writes code in double precision; " + plan.text + " is bound to a wider or narrower one");
  if (!carries_out(plan, step_on_tape)) refuse("a dense factor of it sorts its rows by their sizes");
}

// One plan on the recording of this thread, its arrays after those that are there. number: where its one number goes, instead of the tape's results.
void write_down(const std::shared_ptr<const Plan>& plan, WrittenPlan& made, Recorded* number = nullptr) {
  using Reads = WrittenPlan::Reads;
  check_writable(*plan);
  const AsSource writing{static_cast<int>(made.arrays.size()), number};
  struct Scope {
    explicit Scope(const AsSource& of) { as_source = &of; }
    ~Scope() { as_source = nullptr; }
  } scope(writing);
  for (const auto& [source, binding] : plan->contexts) {
    made.arrays.push_back({Reads::q, "", source->nq()});
    made.arrays.push_back({Reads::v, "", source->nv()});
  }
  made.arrays.push_back({Reads::x, "", plan->domain.dimension()});
  for (const auto& [name, r] : plan->vectors) made.arrays.push_back({Reads::vector, name, plan->registers[r].space.dimension()});
  Workspace<Recorded> workspace(plan);
  Result result;
  const bool with_x = plan->request == Request::apply && !(plan->domain == Space::euclidean(1));
  run_recorded(*plan, workspace, 1, with_x, result);
  made.rows = result.rows, made.columns = result.columns;
}

Recorded recorded(const Scalar& scalar, WrittenPlan& made) {
  const Scalar::Node& n = scalar.node();
  const auto term = [&](size_t i) { return recorded(n.terms[i], made); };
  const auto of_plan = [&](Request request) {
    const auto pool = prepare(n.operand, request);
    Recorded number(0);
    write_down({pool, &pool->plan()}, made, &number);
    return number;
  };
  switch (n.kind) {
    case ScalarKind::number: return n.value.nearest();
    case ScalarKind::trace: return of_plan(Request::trace);
    case ScalarKind::logdet: return of_plan(Request::logdet);
    case ScalarKind::norm: return of_plan(Request::norm);
    case ScalarKind::scaled: return Recorded(n.value.nearest()) * term(0);
    case ScalarKind::reciprocal: return Recorded(1) / term(0);
    case ScalarKind::sum:
    case ScalarKind::product: break;
  }
  const bool sum = n.kind == ScalarKind::sum;
  Recorded all(sum ? 0 : 1);
  for (size_t i = 0; i < n.terms.size(); ++i) all = sum ? all + term(i) : all * term(i);
  return all;
}

template <class WriteDown>
WrittenPlan written_down(const std::string& text, size_t most, WriteDown write) {
  WrittenPlan made;
  made.tape = recorded_tape(text, most, "evaluate it by at(q), which takes models of any size", [&](Recording&) { write(made); });
  std::sort(made.tape.results.begin(), made.tape.results.end(), [](const auto& a, const auto& b) { return a.entry < b.entry; });
  return made;
}

}  // namespace

WrittenPlan written(const std::shared_ptr<const Plan>& plan, size_t most) {
  return written_down(plan->text, most, [&](WrittenPlan& made) { write_down(plan, made); });
}

WrittenPlan written(const Scalar& scalar, size_t most) {
  return written_down(show(scalar), most, [&](WrittenPlan& made) {
    const Recorded value = recorded(scalar, made);
    Recording::current()->result(0, value);
    made.rows = made.columns = 1;
  });
}

}  // namespace pycraft
