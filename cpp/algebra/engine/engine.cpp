#include "algebra/engine/engine.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <mutex>

#include "algebra/engine/in_use.h"
#include "algebra/engine/packs.h"
#include "algebra/engine/run.h"
#include "lanes/lane_sets.h"

namespace pycraft {

struct ExecutionPool::Impl {
  Mutex mutex;
  template <class S>
  using Free = std::vector<std::unique_ptr<Workspace<S>>>;
  PerScalar<Free> free;
  PassCounts counts;
  std::vector<std::string> notes;
  std::string packed;                            // what of the last run was done in packs
  int threads = 1;                               // that share the states of a batch
  InPlace in_place;
  std::shared_ptr<Packs> packs;                  // null: no batch of it is recorded
  std::vector<std::atomic<std::uint64_t>> seen;  // per context: the parameters that the plan was last found to be made for

  template <class S>
  std::unique_ptr<Workspace<S>> taken(const std::shared_ptr<const Plan>& plan) {
    {
      std::lock_guard<Mutex> lock(mutex);
      if (mutex.abandoned()) leave_behind(free, notes, packed);
      auto& kept = std::get<Free<S>>(free);
      if (!kept.empty()) {
        std::unique_ptr<Workspace<S>> workspace = std::move(kept.back());
        kept.pop_back();
        return workspace;
      }
    }
    return std::make_unique<Workspace<S>>(plan);
  }
  // Under the lock.
  template <class S>
  void keep(std::unique_ptr<Workspace<S>> workspace) {
    std::get<Free<S>>(free).push_back(std::move(workspace));
  }
};

// As many threads as a batch was bound with. An operator from outside is called by the caller's own alone.
static int threads_of(const Plan& plan) {
  int threads = 1;
  for (const Context& c : plan.contexts)
    if (c.binding && c.binding->batch >= 0) threads = std::max(threads, c.binding->threads);
  return plan.calls_outside() ? 1 : threads;
}

ExecutionPool::ExecutionPool(std::shared_ptr<const Plan> plan, std::shared_ptr<Packs> packs) : plan_(std::move(plan)), impl_(std::make_unique<Impl>()) {
  impl_->seen = std::vector<std::atomic<std::uint64_t>>(plan_->contexts.size());
  for (auto& parameters : impl_->seen) parameters = ~std::uint64_t(0);  // none
  impl_->threads = threads_of(*plan_);
  impl_->in_place = InPlace(*plan_);
  if (recordable(*plan_)) impl_->packs = packs ? std::move(packs) : std::make_shared<Packs>();
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

PassCounts& PassCounts::operator+=(const PassCounts& other) {
  values += other.values, gathers += other.gathers, scatters += other.scatters;
  kernels += other.kernels, eliminations += other.eliminations, dense += other.dense;
  return *this;
}

PassCounts PassCounts::times(int states) const {
  return {states * values, states * gathers, states * scatters, states * kernels, states * eliminations, states * dense};
}

PassCounts ExecutionPool::last_counts() const {
  std::lock_guard<Mutex> lock(impl_->mutex);
  return impl_->counts;
}
std::vector<std::string> ExecutionPool::run_notes() const {
  std::lock_guard<Mutex> lock(impl_->mutex);
  std::vector<std::string> notes = impl_->notes;
  if (!impl_->packed.empty()) notes.push_back(impl_->packed);
  return notes;
}

// What of a batch was done in packs: of the states before `from` all but some.
struct ExecutionPool::Packed {
  std::vector<int> left;
  int from = 0;
  bool shaped = false;  // the result
  PassCounts counts;
  std::string note;
  int state(int i) const { return i < static_cast<int>(left.size()) ? left[i] : from + i - static_cast<int>(left.size()); }
};

template <class S>
ExecutionPool::Packed ExecutionPool::run_packs(Run<S>& run, const Inputs& inputs, Result* expanded) {
  Packed done;
  if (!impl_->packs || run.states() < 2) return done;
  Packs::Way way = impl_->packs->way(plan_, inputs, run.states());
  if (way.tried > 0) {
    const double begin = Packs::seconds_of_thread();
    for (; done.from < way.tried; ++done.from) run.run(done.from);
    done.shaped = true;
    way = impl_->packs->way_after(plan_, inputs, run.states(), done.from, Packs::seconds_of_thread() - begin);
  }
  if (!way.taped) return done;
  const TapedPlan& taped = *way.taped;
  if (!done.shaped) run.shape(taped.rows, taped.columns);
  done.left = impl_->packs->run(taped, *plan_, inputs, done.from, run.states(), impl_->threads, run.out());
  const size_t size = size_t(taped.rows) * taped.columns;
  for (size_t i = done.from * size; expanded && i < run.states() * size; ++i) expanded->expansions[i] = {run.out()[i]};
  done.counts = taped.counts.times(run.states() - done.from - static_cast<int>(done.left.size()));
  if (done.from < run.states())
    done.note = "packs: " + std::to_string(run.states() - done.from) + " states, " + std::to_string(taped.instructions) + " instructions for " +
              std::to_string(kernels::lane_set().functions.width) + " at a time";
  if (!done.left.empty()) done.note += "; " + std::to_string(done.left.size()) + " of them by themselves";
  done.from = run.states(), done.shaped = true;
  return done;
}

// The others of so many states in threads, each in a workspace of its own, which go to `used`.
template <class S, class State, class Taken>
static PassCounts run_others(const Run<S>& first, int states, State state, int threads, std::vector<std::unique_ptr<Workspace<S>>>& used, Taken taken) {
  used.resize(threads);
  std::vector<std::unique_ptr<Run<S>>> runs(threads);
  share_out(1, states, threads, [&](int thread, int i) {
    std::unique_ptr<Run<S>>& own = runs[thread];
    if (!own) {
      used[thread] = taken();
      own = std::make_unique<Run<S>>(first, *used[thread]);
    }
    own->run(state(i));
  });
  std::erase(used, nullptr);
  PassCounts counts;
  for (const auto& run : runs)
    if (run) counts += run->counts();
  return counts;
}

template <class S>
void ExecutionPool::run_at(const Inputs& inputs, bool expansions, Result& result) {
  std::unique_ptr<Workspace<S>> workspace = impl_->taken<S>(plan_);
  std::vector<std::unique_ptr<Workspace<S>>> others;
  PassCounts counts;
  std::string note;
  {
    Run<S> run(*plan_, *workspace, inputs, expansions, result, impl_->in_place);
    if (run.states() == 0) run.run_none();
    Packed packed;
    if constexpr (std::is_same_v<S, double>) packed = run_packs(run, inputs, expansions ? &result : nullptr);
    const int states = static_cast<int>(packed.left.size()) + run.states() - packed.from, threads = std::min(impl_->threads, states - 1);
    for (int i = 0; i < (threads > 1 ? 1 : states); ++i) run.run(packed.state(i));  // the first one finds the shape of the result
    counts = run.counts();
    counts += packed.counts;
    note = std::move(packed.note);
    if (threads > 1) counts += run_others(run, states, [&](int i) { return packed.state(i); }, threads, others, [&] { return impl_->taken<S>(plan_); });
  }
  std::lock_guard<Mutex> lock(impl_->mutex);
  impl_->counts = counts;
  impl_->packed = std::move(note);
  if (!workspace->notes().empty()) impl_->notes = workspace->notes();
  impl_->keep(std::move(workspace));
  for (auto& other : others) {
    for (const std::string& note : other->notes())
      if (std::find(impl_->notes.begin(), impl_->notes.end(), note) == impl_->notes.end()) impl_->notes.push_back(note);
    impl_->keep(std::move(other));
  }
}

bool ExecutionPool::run(const Inputs& inputs, bool expansions, Result& result) {
  const InUse use(plan_->contexts);
  if (!current()) return false;
  at_precision(plan_->precision, [&]<class S>(S) { run_at<S>(inputs, expansions, result); });
  return true;
}

}  // namespace pycraft
