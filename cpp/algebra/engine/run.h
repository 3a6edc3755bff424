// One run of a plan: where its values come from, what it is applied to, where its results go.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "algebra/engine/block_steps.h"
#include "algebra/engine/dense_steps.h"
#include "algebra/engine/in_place.h"
#include "algebra/engine/refined_solves.h"
#include "algebra/engine/scalar_steps.h"
#include "algebra/engine/vector_steps.h"
#include "numerics/finite.h"
#include "runtime/errors.h"

namespace pycraft {

[[noreturn]] inline void throw_beyond_range(const Plan& plan, const Inputs& inputs) {
  const size_t given = inputs.x ? size_t(plan.domain.dimension()) * inputs.columns * (inputs.batched ? plan.batch : 1) : 0;
  bool finite = std::all_of(inputs.x, inputs.x + given, [](double x) { return std::isfinite(x); });
  for (const auto& [_, x] : inputs.vectors) finite &= std::all_of(x.begin(), x.end(), [](double y) { return std::isfinite(y); });
  if (!finite) throw EvaluationError("the vector that '" + plan.text + "' is applied to has an entry that is no finite number");
  throw EvaluationError("the value of '" + plan.text + "' is beyond the range of its numbers: take other units, or a wider precision (.at(precision=\"extended\"))");
}

// Arrays of inputs of what is recorded: configurations and velocities of every context, x, and the named vectors in their order.
inline int array_of_x(const Plan& plan) { return 2 * static_cast<int>(plan.contexts.size()); }

// Of recorded runs (taped_plan.cpp): at one state like any other, instead of those of a batch.
void take_recorded_values(const Plan& plan, Workspace<Recorded>& w);
void take_recorded(const double* given, size_t size, int array, std::vector<Recorded>& to);
void record_result(size_t at, const Recorded& value);

// One run of a plan in a workspace, state after state, or some of the states of a run that began with the first.
template <class S>
class Run {
 public:
  Run(const Plan& plan, Workspace<S>& workspace, const Inputs& inputs, bool expansions, Result& result, const InPlace& in_place)
      : plan_(plan), w_(workspace), inputs_(inputs), expansions_(expansions), result_(result), states_(plan.batched && !is_recorded<S> ? plan.batch : 1) {
    if constexpr (of_doubles) in_place_ = in_place, in_place_.output &= !expansions;
    take_values();
    check_vectors();
    result_.batch = plan.batched ? states_ : (inputs.batched ? -2 : -1);
  }
  // Beside another one that holds the values of what is no batch and has shaped the result.
  Run(const Run& first, Workspace<S>& workspace)
      : plan_(first.plan_), w_(workspace), inputs_(first.inputs_), expansions_(first.expansions_), result_(first.result_), out_(first.out_), in_place_(first.in_place_), states_(first.states_) {
    w_.values = first.w_.values;
    make_own_values();
  }
  // What was held of the models goes with the run: an operator from outside, or a signal's handler, may run another one on this thread
  // before this one is over.
  ~Run() { w_.held.clear(); }
  Run(const Run&) = delete;

  int states() const { return states_; }
  const PassCounts& counts() const { return counts_; }
  void run(int b) {
    naming_state(b, states_, [&] {
      run_state(b);
      if (!in_range_) throw_beyond_range(plan_, inputs_);
    });
  }
  // The result of no states.
  void run_none() {
    const bool number = plan_.request == Request::trace || plan_.request == Request::logdet || plan_.request == Request::norm;
    shape(number ? 1 : plan_.codomain.dimension(), plan_.request == Request::dense ? plan_.domain.dimension() : inputs_.columns);
  }

  void shape(int rows, int columns) {
    result_.rows = rows;
    result_.columns = columns;
    const size_t all = size_t(states_) * rows * columns;
    if (!result_.into) result_.values.resize(all);
    out_ = result_.into ? result_.into : result_.values.data();
    if (expansions_) result_.expansions.resize(all);
  }
  double* out() const { return out_; }  // once it has a shape

 private:
  // The values of every context: those that are kept for the model's state or a binding's, or the workspace's own for a batch.
  void take_values() {
    if constexpr (is_recorded<S>) return take_recorded_values(plan_, w_);
    w_.held.clear();
    w_.held.resize(plan_.contexts.size());
    w_.values.assign(plan_.contexts.size(), nullptr);
    make_own_values();
    for (size_t c = 0; c < plan_.contexts.size(); ++c) {
      const Context& context = plan_.contexts[c];
      if (!context.binding) {
        w_.held[c] = context.source->template current_values<S>(plan_.groups[c]);
      } else if (context.binding->batch < 0) {
        w_.held[c] = context.binding->template values<S>(context.source, plan_.groups[c]);
      } else {
        continue;
      }
      w_.values[c] = w_.held[c].get();
    }
  }

  void make_own_values() {
    w_.own_values.resize(plan_.contexts.size());
    for (size_t c = 0; c < plan_.contexts.size(); ++c) {
      const Context& context = plan_.contexts[c];
      if (!context.binding || context.binding->batch < 0) continue;
      context.source->check_current();
      if (!w_.own_values[c]) {
        w_.own_values[c] = context.source->make_values(S());
        w_.own_values[c]->use(context.binding->arithmetic.form);
      }
      w_.values[c] = w_.own_values[c].get();
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
    if constexpr (is_recorded<S>) return true;
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
    int array = array_of_x(plan_);
    for (const auto& [name, r] : plan_.vectors) {
      const std::vector<double>& given = inputs_.vectors.at(name);
      take(given.data(), given.size(), ++array, w_.vector(r));
    }
    if (plan_.columns_of_identity) return run_columns(b, fresh);
    const int n_in = plan_.domain.dimension(), n_out = plan_.codomain.dimension(), m = inputs_.columns;
    const Register& out = plan_.registers[plan_.output];
    const size_t size = size_t(n_out) * (out.wide ? m : 1);
    const Lent lent(*this);
    if (plan_.input >= 0) take_input(b, size_t(n_in) * m);
    if (b == 0 && out.kind == RegisterKind::vector) shape(n_out, out.wide ? m : 1);
    if (in_place_.output) w_.lend(plan_.output, reinterpret_cast<S*>(out_ + size_t(b) * size));
    w_.run(w_.values, m, fresh, counts_);
    if (states_ > 1) check_interrupt();
    switch (out.kind) {
      case RegisterKind::vector:
        if (in_place_.output)
          in_range_ &= all_finite(out_ + size_t(b) * size, size);
        else
          store_all(b, w_.numbers(plan_.output), size);
        return;
      case RegisterKind::dense:
        if (b == 0) shape(n_out, n_in);
        return store_all(b, w_.dense(plan_.output).data(), size_t(n_out) * n_in);
      case RegisterKind::blocks: {
        const std::vector<S>& y = w_.blocks(plan_.output).data;
        if (b == 0) shape(static_cast<int>(y.size()), 1);
        return store_all(b, y.data(), y.size());
      }
      default:
        if (b == 0) shape(1, 1);
        store(b, w_.scalar(plan_.output));
    }
  }

  void take_input(int b, size_t size) {
    const double* given = inputs_.x ? inputs_.x + (inputs_.batched ? size_t(b) * size : 0) : nullptr;
    if constexpr (of_doubles) {
      if (given && in_place_.input) return w_.lend(plan_.input, const_cast<double*>(given));  // no step writes to it
    }
    if (given)
      take(given, size, array_of_x(plan_), w_.vector(plan_.input));
    else
      w_.vector(plan_.input).assign(size, S(1));
  }
  // Numbers that were given, as the inputs of this array of what is recorded.
  static void take(const double* given, size_t size, int array, std::vector<S>& to) {
    if constexpr (is_recorded<S>)
      take_recorded(given, size, array, to);
    else
      to.assign(given, given + size);
  }
  struct Lent {  // until the state is done, be it by an error
    Run& run;
    explicit Lent(Run& r) : run(r) {}
    ~Lent() {
      if (run.plan_.input >= 0) run.w_.lend(run.plan_.input, nullptr);
      if (run.plan_.output >= 0) run.w_.lend(run.plan_.output, nullptr);
    }
  };

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

  void store(size_t at, const S& value) {
    if constexpr (is_recorded<S>) return record_result(at, value);
    out_[at] = to_double(value);
    in_range_ &= std::isfinite(out_[at]);
    if (expansions_) result_.expansions[at] = expansion(value);
  }
  void store_all(int b, const S* y, size_t size) {
    if constexpr (of_doubles) {
      if (!expansions_) {
        std::copy_n(y, size, out_ + size_t(b) * size);
        in_range_ &= all_finite(y, size);
        return;
      }
    }
    for (size_t i = 0; i < size; ++i) store(size_t(b) * size + i, y[i]);
  }

  const Plan& plan_;
  Workspace<S>& w_;
  const Inputs& inputs_;
  bool expansions_, in_range_ = true;
  Result& result_;
  double* out_ = nullptr;
  static constexpr bool of_doubles = std::is_same_v<S, double>;
  InPlace in_place_;
  int states_;
  PassCounts counts_;
};

}  // namespace pycraft
