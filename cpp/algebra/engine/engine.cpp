#include "algebra/engine/engine.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <mutex>

#include "algebra/engine/block_steps.h"
#include "algebra/engine/dense_steps.h"
#include "algebra/engine/refined_solves.h"
#include "algebra/engine/scalar_steps.h"
#include "algebra/engine/vector_steps.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// No model of these contexts is edited while it lives.
class InUse {
 public:
  explicit InUse(const std::vector<Context>& contexts) : contexts_(contexts) {
    for (const Context& c : contexts_) entered_ = c.source->enter_use();
  }
  ~InUse() {
    for (const Context& c : contexts_) c.source->leave_use(entered_);
  }
  InUse(const InUse&) = delete;

 private:
  const std::vector<Context>& contexts_;
  unsigned entered_ = 0;
};

}  // namespace

struct ExecutionPool::Impl {
  Mutex mutex;
  template <class S>
  using Free = std::vector<std::unique_ptr<Workspace<S>>>;
  PerScalar<Free> free;
  PassCounts counts;
  std::vector<std::string> notes;
  std::vector<std::atomic<std::uint64_t>> seen;  // per context: the parameters that the plan was last found to be made for
};

ExecutionPool::ExecutionPool(std::shared_ptr<const Plan> plan) : plan_(std::move(plan)), impl_(std::make_unique<Impl>()) {
  impl_->seen = std::vector<std::atomic<std::uint64_t>>(plan_->contexts.size());
  for (auto& parameters : impl_->seen) parameters = ~std::uint64_t(0);  // none
}
ExecutionPool::~ExecutionPool() = default;

bool ExecutionPool::current() const {
  for (size_t c = 0; c < plan_->contexts.size(); ++c) {
    const SkoSource& source = *plan_->contexts[c].source;
    source.check_current();
    const std::uint64_t parameters = source.parameters();
    if (impl_->seen[c] == parameters) continue;
    if (source.traits().hinge_diagonal != plan_->hinge_diagonal[c]) return false;
    impl_->seen[c] = parameters;
  }
  return true;
}

PassCounts ExecutionPool::last_counts() const {
  std::lock_guard<Mutex> lock(impl_->mutex);
  return impl_->counts;
}
std::vector<std::string> ExecutionPool::run_notes() const {
  std::lock_guard<Mutex> lock(impl_->mutex);
  return impl_->notes;
}

[[noreturn]] static void throw_beyond_range(const Plan& plan, const Inputs& inputs) {
  const size_t given = inputs.x ? size_t(plan.domain.dimension()) * inputs.columns * (inputs.batched ? plan.batch : 1) : 0;
  bool finite = std::all_of(inputs.x, inputs.x + given, [](double x) { return std::isfinite(x); });
  for (const auto& [_, x] : inputs.vectors) finite &= std::all_of(x.begin(), x.end(), [](double y) { return std::isfinite(y); });
  if (!finite) throw EvaluationError("the vector that '" + plan.text + "' is applied to has an entry that is no finite number");
  throw EvaluationError("the value of '" + plan.text + "' is beyond the range of its numbers: take other units, or a wider precision (.at(precision=\"extended\"))");
}

template <class S>
void ExecutionPool::run_at(const Inputs& inputs, bool expansions, Result& result) {
  const Plan& plan = *plan_;
  std::unique_ptr<Workspace<S>> workspace;
  {
    std::lock_guard<Mutex> lock(impl_->mutex);
    if (impl_->mutex.abandoned()) leave_behind(impl_->free, impl_->notes);
    auto& free = std::get<Impl::Free<S>>(impl_->free);
    if (!free.empty()) {
      workspace = std::move(free.back());
      free.pop_back();
    }
  }
  if (!workspace) workspace = std::make_unique<Workspace<S>>(plan_);
  Workspace<S>& w = *workspace;
  const int states = plan.batched ? plan.batch : 1;
  PassCounts counts;

  // Of this run alone: an operator from outside, or a signal's handler, may run another one on this thread before this one is over.
  std::vector<ValuesInUse<S>>& held = w.held;
  std::vector<SkoValues<S>*>& values = w.values;
  held.clear();
  held.resize(plan.contexts.size());
  values.assign(plan.contexts.size(), nullptr);
  if (w.own_values.size() != plan.contexts.size()) w.own_values.resize(plan.contexts.size());
  for (size_t c = 0; c < plan.contexts.size(); ++c) {
    const Context& context = plan.contexts[c];
    if (!context.binding) {
      held[c] = context.source->template current_values<S>(plan.groups[c]);
    } else if (context.binding->batch < 0) {
      held[c] = context.binding->template values<S>(context.source, plan.groups[c]);
    } else {
      context.source->check_current();
      if (!w.own_values[c]) {
        w.own_values[c] = context.source->make_values(S());
        w.own_values[c]->use(context.binding->arithmetic.form);
      }
      values[c] = w.own_values[c].get();
      continue;
    }
    values[c] = held[c].get();
  }

  const Register* out = plan.output >= 0 ? &plan.registers[plan.output] : nullptr;
  const bool identity_columns = plan.columns_of_identity;
  result.batch = plan.batched ? states : (inputs.batched ? -2 : -1);
  bool in_range = true;
  const auto store = [&](size_t at, const S& value) {
    result.values[at] = to_double(value);
    in_range &= std::isfinite(result.values[at]);
    if (expansions) result.expansions[at] = expansion(value);
  };
  const auto shape = [&](int rows, int columns) {
    result.rows = rows;
    result.columns = columns;
    result.values.resize(size_t(states) * rows * columns);
    if (expansions) result.expansions.resize(result.values.size());
  };
  const int n_in = plan.domain.dimension(), n_out = plan.codomain.dimension();
  for (const auto& [name, r] : plan.vectors) {
    const auto given = inputs.vectors.find(name);
    if (given == inputs.vectors.end()) throw EvaluationError("the vector '" + name + "' has no value: give it by name");
    if (static_cast<int>(given->second.size()) != plan.registers[r].space.dimension())
      throw EvaluationError("the vector '" + name + "' has " + std::to_string(given->second.size()) + " entries; it lies in " +
                            plan.registers[r].space.description());
  }
  const auto run_state = [&](int b) {
    for (size_t c = 0; c < plan.contexts.size(); ++c) {
      const Context& context = plan.contexts[c];
      if (!context.binding || context.binding->batch < 0) continue;
      values[c]->move_to(context.binding->q.data() + size_t(b) * context.binding->nq, context.binding->v.data() + size_t(b) * context.binding->nv);
      values[c]->require(plan.groups[c]);
    }
    // Blocks and factors of the last run serve again where the values are the same.
    bool fresh = w.generations.size() != values.size();
    w.generations.resize(values.size());
    for (size_t c = 0; c < values.size(); ++c) {
      fresh |= w.generations[c] != values[c]->generation();
      w.generations[c] = values[c]->generation();
    }
    if (values.empty()) fresh = !w.ran;
    w.state = b;
    w.ran = true;
    for (const auto& [name, r] : plan.vectors) {
      const std::vector<double>& given = inputs.vectors.at(name);
      w.vector(r).assign(given.begin(), given.end());
    }
    if (identity_columns) {
      const bool is_norm = plan.request == Request::norm, is_trace = plan.request == Request::trace, is_diagonal = plan.request == Request::diagonal;
      if (b == 0) shape(is_norm || is_trace ? 1 : n_out, is_norm || is_trace || is_diagonal ? 1 : n_in);
      const int output = is_norm ? plan.steps.back().in[0] : plan.output;
      S squares = S(0), sum = S(0);
      for (int start = 0; start < n_in || start == 0; start += columns_at_a_time) {
        const int m = std::min(columns_at_a_time, n_in - start);
        if (m <= 0) break;
        std::vector<S>& x = w.vector(plan.input);
        x.assign(size_t(n_in) * m, S(0));
        for (int j = 0; j < m; ++j) x[size_t(start + j) * m + j] = S(1);
        w.run(values, m, start == 0 && fresh, counts);
        const std::vector<S>& y = w.vector(output);
        for (int i = 0; i < n_out; ++i)
          for (int j = 0; j < m; ++j) {
            const S value = y[size_t(i) * m + j];
            if (is_norm)
              squares += value * value;
            else if (is_trace)
              sum += i == start + j ? value : S(0);
            else if (is_diagonal) {
              if (i == start + j) store(size_t(b) * n_out + i, value);
            } else
              store(size_t(b) * n_out * n_in + size_t(i) * n_in + start + j, value);
          }
        check_interrupt();
      }
      using std::sqrt;
      if (is_norm) store(b, sqrt(squares));
      if (is_trace) store(b, sum);
      return;
    }
    const int m = inputs.columns;
    if (plan.input >= 0) {
      std::vector<S>& x = w.vector(plan.input);
      x.resize(size_t(n_in) * m);
      const double* given = inputs.x ? inputs.x + (inputs.batched ? size_t(b) * n_in * m : 0) : nullptr;
      for (size_t i = 0; i < x.size(); ++i) x[i] = given ? S(given[i]) : S(1);
    }
    w.run(values, m, fresh, counts);
    if (states > 1) check_interrupt();
    switch (out->kind) {
      case RegisterKind::vector: {
        const int columns = out->wide ? m : 1;
        if (b == 0) shape(n_out, columns);
        const std::vector<S>& y = w.vector(plan.output);
        for (size_t i = 0; i < y.size(); ++i) store(size_t(b) * y.size() + i, y[i]);
        break;
      }
      case RegisterKind::dense: {
        if (b == 0) shape(n_out, n_in);
        const std::vector<S>& y = w.dense(plan.output);
        for (size_t i = 0; i < y.size(); ++i) store(size_t(b) * y.size() + i, y[i]);
        break;
      }
      case RegisterKind::blocks: {
        const std::vector<S>& y = w.blocks(plan.output).data;
        if (b == 0) shape(static_cast<int>(y.size()), 1);
        for (size_t i = 0; i < y.size(); ++i) store(size_t(b) * y.size() + i, y[i]);
        break;
      }
      default:
        if (b == 0) shape(1, 1);
        store(b, w.scalar(plan.output));
    }
  };
  for (int b = 0; b < states; ++b)
    naming_state(b, plan.batched ? states : 1, [&] {
      run_state(b);
      if (!in_range) throw_beyond_range(plan, inputs);
    });
  if (states == 0) shape(plan.request == Request::trace || plan.request == Request::logdet || plan.request == Request::norm ? 1 : n_out,
                         plan.request == Request::dense ? n_in : inputs.columns);
  held.clear();
  std::lock_guard<Mutex> lock(impl_->mutex);
  impl_->counts = counts;
  if (!w.notes().empty()) impl_->notes = w.notes();
  std::get<Impl::Free<S>>(impl_->free).push_back(std::move(workspace));
}

bool ExecutionPool::run(const Inputs& inputs, bool expansions, Result& result) {
  const InUse use(plan_->contexts);
  if (!current()) return false;
  at_precision(plan_->precision, [&]<class S>(S) { run_at<S>(inputs, expansions, result); });
  return true;
}

// The plan is made outside the lock: a signal's handler, called in between, may ask for the same one.
std::shared_ptr<ExecutionPool> PlanCache::find_or_make(const Expression& e, Request request, const PlanOptions& options) {
  const std::pair<Request, bool> key{request, options.rules};
  {
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(pools_);
    const auto known = pools_.find(key);
    if (known != pools_.end() && known->second->current()) return known->second;
  }
  const auto all = contexts(e);
  const InUse use(all);
  auto pool = std::make_shared<ExecutionPool>(make_plan(e, request, options));
  std::lock_guard<Mutex> lock(mutex_);
  std::shared_ptr<ExecutionPool>& kept = pools_[key];
  if (!kept || !kept->current()) kept = pool;
  return kept;
}

}  // namespace pycraft
