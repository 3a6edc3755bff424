#include "algebra/engine/taped_plan.h"

#include <algorithm>

#include "algebra/engine/run.h"
#include "lanes/lane_sets.h"
#include "numerics/recorded.h"

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

// Numbers of one size, none a simple ratio of another.
std::vector<double> generic(size_t size) {
  std::vector<double> x(size);
  for (size_t i = 0; i < size; ++i) x[i] = elimination::scattered<double>(i);
  return x;
}

}  // namespace

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
    const StateData at = batch ? source->generic_state() : binding ? StateData{binding->q, binding->v} : *source->state();
    if (binding) own->use(binding->arithmetic.form);
    Recording::current()->take_states_from(batch ? 2 * static_cast<int>(c) : -1);
    own->move_to(at.q.data(), at.v.data());
    own->require(plan.groups[c]);
    w.values[c] = own.get();
  }
}

void take_recorded(const double* given, size_t size, int array, std::vector<Recorded>& to) {
  to.resize(size);
  for (size_t i = 0; i < size; ++i) to[i] = Recording::current()->input(given[i], array, static_cast<int>(i));
}

void record_result(size_t at, const Recorded& value) { Recording::current()->result(static_cast<int>(at), value); }

std::shared_ptr<const TapedPlan> taped(const std::shared_ptr<const Plan>& plan, int columns, bool with_x, size_t most) {
  Recording recording(most);
  Workspace<Recorded> workspace(plan);
  Inputs inputs;
  const std::vector<double> x = generic(with_x && plan->input >= 0 ? size_t(plan->domain.dimension()) * columns : 0);
  if (with_x) inputs.x = x.data();
  inputs.columns = columns;
  for (const auto& [name, r] : plan->vectors) inputs.vectors[name] = generic(plan->registers[r].space.dimension());
  Result result;
  PassCounts counts;
  try {
    Run<Recorded> run(*plan, workspace, inputs, false, result, {});
    run.run(0);
    counts = run.counts();
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

}  // namespace pycraft
