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
#include "numerics/finite.h"
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

namespace {

// One run of a plan in a workspace, state after state.
template <class S>
class Run {
 public:
  Run(const Plan& plan, Workspace<S>& workspace, const Inputs& inputs, bool expansions, Result& result)
      : plan_(plan), w_(workspace), inputs_(inputs), expansions_(expansions), result_(result), states_(plan.batched ? plan.batch : 1) {
    take_values();
    check_vectors();
    result_.batch = plan.batched ? states_ : (inputs.batched ? -2 : -1);
  }
  // What was held of the models goes with the run: an operator from outside, or a signal's handler, may run another one on this thread
  // before this one is over.
  ~Run() { w_.held.clear(); }
  Run(const Run&) = delete;

  PassCounts run() {
    for (int b = 0; b < states_; ++b)
      naming_state(b, states_, [&] {
        run_state(b);
        if (!in_range_) throw_beyond_range(plan_, inputs_);
      });
    const bool number = plan_.request == Request::trace || plan_.request == Request::logdet || plan_.request == Request::norm;
    if (states_ == 0) shape(number ? 1 : plan_.codomain.dimension(), plan_.request == Request::dense ? plan_.domain.dimension() : inputs_.columns);
    return counts_;
  }

 private:
  // The values of every context: those that are kept for the model's state or a binding's, or the workspace's own for a batch.
  void take_values() {
    w_.held.clear();
    w_.held.resize(plan_.contexts.size());
    w_.values.assign(plan_.contexts.size(), nullptr);
    if (w_.own_values.size() != plan_.contexts.size()) w_.own_values.resize(plan_.contexts.size());
    for (size_t c = 0; c < plan_.contexts.size(); ++c) {
      const Context& context = plan_.contexts[c];
      if (!context.binding) {
        w_.held[c] = context.source->template current_values<S>(plan_.groups[c]);
      } else if (context.binding->batch < 0) {
        w_.held[c] = context.binding->template values<S>(context.source, plan_.groups[c]);
      } else {
        context.source->check_current();
        if (!w_.own_values[c]) {
          w_.own_values[c] = context.source->make_values(S());
          w_.own_values[c]->use(context.binding->arithmetic.form);
        }
        w_.values[c] = w_.own_values[c].get();
        continue;
      }
      w_.values[c] = w_.held[c].get();
    }
  }

  void check_vectors() const {
    for (const auto& [name, r] : plan_.vectors) {
      const auto given = inputs_.vectors.find(name);
      if (given == inputs_.vectors.end()) throw EvaluationError("the vector '" + name + "' has no value: give it by name");
      if (static_cast<int>(given->second.size()) != plan_.registers[r].space.dimension())
        throw EvaluationError("the vector '" + name + "' has " + std::to_string(given->second.size()) + " entries; it lies in " +
                              plan_.registers[r].space.description());
    }
  }

  // Moves the values of batches to state b. Whether anything changed since the last run: else blocks and factors serve again.
  bool move_to(int b) {
    for (size_t c = 0; c < plan_.contexts.size(); ++c) {
      const Binding* binding = plan_.contexts[c].binding.get();
      if (!binding || binding->batch < 0) continue;
      w_.values[c]->move_to(binding->q.data() + size_t(b) * binding->nq, binding->v.data() + size_t(b) * binding->nv);
      w_.values[c]->require(plan_.groups[c]);
    }
    bool fresh = w_.generations.size() != w_.values.size();
    w_.generations.resize(w_.values.size());
    for (size_t c = 0; c < w_.values.size(); ++c) {
      fresh |= w_.generations[c] != w_.values[c]->generation();
      w_.generations[c] = w_.values[c]->generation();
    }
    if (w_.values.empty()) fresh = !w_.ran;
    w_.state = b;
    w_.ran = true;
    return fresh;
  }

  void run_state(int b) {
    const bool fresh = move_to(b);
    for (const auto& [name, r] : plan_.vectors) {
      const std::vector<double>& given = inputs_.vectors.at(name);
      w_.vector(r).assign(given.begin(), given.end());
    }
    if (plan_.columns_of_identity) return run_columns(b, fresh);
    const int n_in = plan_.domain.dimension(), m = inputs_.columns;
    if (plan_.input >= 0) {
      std::vector<S>& x = w_.vector(plan_.input);
      x.resize(size_t(n_in) * m);
      const double* given = inputs_.x ? inputs_.x + (inputs_.batched ? size_t(b) * n_in * m : 0) : nullptr;
      if (given)
        std::copy_n(given, x.size(), x.begin());
      else
        std::fill(x.begin(), x.end(), S(1));
    }
    w_.run(w_.values, m, fresh, counts_);
    if (states_ > 1) check_interrupt();
    const Register& out = plan_.registers[plan_.output];
    switch (out.kind) {
      case RegisterKind::vector: return store_all(b, w_.vector(plan_.output), plan_.codomain.dimension(), out.wide ? m : 1);
      case RegisterKind::dense: return store_all(b, w_.dense(plan_.output), plan_.codomain.dimension(), n_in);
      case RegisterKind::blocks: {
        const std::vector<S>& y = w_.blocks(plan_.output).data;
        return store_all(b, y, static_cast<int>(y.size()), 1);
      }
      default:
        if (b == 0) shape(1, 1);
        store(b, w_.scalar(plan_.output));
    }
  }

  // The operator itself, its diagonal, trace or norm, from columns of the identity, some at a time.
  void run_columns(int b, bool fresh) {
    const int n_in = plan_.domain.dimension(), n_out = plan_.codomain.dimension();
    const bool is_norm = plan_.request == Request::norm, is_trace = plan_.request == Request::trace, is_diagonal = plan_.request == Request::diagonal;
    if (b == 0) shape(is_norm || is_trace ? 1 : n_out, is_norm || is_trace || is_diagonal ? 1 : n_in);
    const int output = is_norm ? plan_.steps.back().in[0] : plan_.output;
    S squares = S(0), sum = S(0);
    for (int start = 0; start < n_in; start += columns_at_a_time) {
      const int m = std::min(columns_at_a_time, n_in - start);
      std::vector<S>& x = w_.vector(plan_.input);
      x.assign(size_t(n_in) * m, S(0));
      for (int j = 0; j < m; ++j) x[size_t(start + j) * m + j] = S(1);
      w_.run(w_.values, m, start == 0 && fresh, counts_);
      const std::vector<S>& y = w_.vector(output);
      for (int i = 0; i < n_out; ++i)
        for (int j = 0; j < m; ++j) {
          const S value = y[size_t(i) * m + j];
          if (is_norm) {
            squares += value * value;
          } else if (is_trace) {
            sum += i == start + j ? value : S(0);
          } else if (is_diagonal) {
            if (i == start + j) store(size_t(b) * n_out + i, value);
          } else {
            store(size_t(b) * n_out * n_in + size_t(i) * n_in + start + j, value);
          }
        }
      check_interrupt();
    }
    using std::sqrt;
    if (is_norm) store(b, sqrt(squares));
    if (is_trace) store(b, sum);
  }

  void shape(int rows, int columns) {
    result_.rows = rows;
    result_.columns = columns;
    const size_t all = size_t(states_) * rows * columns;
    if (!result_.into) result_.values.resize(all);
    out_ = result_.into ? result_.into : result_.values.data();
    if (expansions_) result_.expansions.resize(all);
  }
  void store(size_t at, const S& value) {
    out_[at] = to_double(value);
    in_range_ &= std::isfinite(out_[at]);
    if (expansions_) result_.expansions[at] = expansion(value);
  }
  void store_all(int b, const std::vector<S>& y, int rows, int columns) {
    if (b == 0) shape(rows, columns);
    if constexpr (std::is_same_v<S, double>) {
      if (!expansions_) {
        std::copy(y.begin(), y.end(), out_ + size_t(b) * y.size());
        in_range_ &= all_finite(y.data(), y.size());
        return;
      }
    }
    for (size_t i = 0; i < y.size(); ++i) store(size_t(b) * y.size() + i, y[i]);
  }

  const Plan& plan_;
  Workspace<S>& w_;
  const Inputs& inputs_;
  bool expansions_, in_range_ = true;
  Result& result_;
  double* out_ = nullptr;
  int states_;
  PassCounts counts_;
};

}  // namespace

template <class S>
void ExecutionPool::run_at(const Inputs& inputs, bool expansions, Result& result) {
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
  const PassCounts counts = Run<S>(*plan_, *workspace, inputs, expansions, result).run();
  std::lock_guard<Mutex> lock(impl_->mutex);
  impl_->counts = counts;
  if (!workspace->notes().empty()) impl_->notes = workspace->notes();
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
