#include "algebra/engine/packs.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <ctime>
#include <mutex>

#include "algebra/engine/run.h"

namespace pycraft {

namespace {

std::atomic<int> forced{0};

// Of what decides once, from how many states on a batch is recorded.
constexpr int long_batch = 64;
// States that a batch runs by themselves to learn what they take.
constexpr int first_tried = 4;
// What an operation takes to write down and to make ready, and at a state in a pack; how many a plan's flop comes to, zeros and ones left out.
constexpr double seconds_to_record = 150e-9, seconds_in_pack = 0.1e-9, operations_a_flop = 0.7;
constexpr size_t most_operations = 2'000'000;
// Batches in packs that took longer than their states would by themselves, until there are no more of them.
constexpr int most_slower = 3;

}  // namespace

double Packs::seconds_of_thread() {
#if defined(CLOCK_THREAD_CPUTIME_ID)
  timespec t;
  if (clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t) == 0) return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
#endif
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int Packs::record_from(int states) { return forced.exchange(states); }

Packs::Kept& Packs::kept(const Plan& plan, const Inputs& inputs) {
  std::vector<Version> versions;
  for (const Context& c : plan.contexts) versions.push_back({c.source->parameters(), c.binding ? nullptr : c.source->state()});
  const bool with_x = inputs.x != nullptr;
  auto found = std::find_if(all_.begin(), all_.end(), [&](const Kept& k) { return k.columns == inputs.columns && k.with_x == with_x && k.versions == versions; });
  if (found == all_.end()) {
    if (all_.size() == most_kept) all_.pop_back();
    Kept made;
    made.versions = std::move(versions), made.columns = inputs.columns, made.with_x = with_x;
    found = all_.insert(all_.end(), std::move(made));
  }
  std::rotate(all_.begin(), found, found + 1);
  return all_.front();
}

Packs::Way Packs::recorded(const std::shared_ptr<const Plan>& plan, const Inputs& inputs, size_t most) {
  std::shared_ptr<const TapedPlan> made = taped(plan, inputs.columns, inputs.x != nullptr, most);  // outside the lock: it may be interrupted
  const std::lock_guard<Mutex> lock(mutex_);
  Kept& k = kept(*plan, inputs);
  k.tried = true, k.taped = made;
  return {made};
}

Packs::Way Packs::way(const std::shared_ptr<const Plan>& plan, const Inputs& inputs, int states) {
  const int force = forced;
  if (states < force) return {};
  const bool once = decides_once(*plan);
  {
    const std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(all_);
    const Kept& k = kept(*plan, inputs);
    if (!force && states < (once ? long_batch : first_tried)) return {nullptr, once || k.tried ? 0 : states};
    if (k.tried) return {k.taped};
  }
  if (force || once) return recorded(plan, inputs, most_operations);
  return {nullptr, std::min(states, first_tried)};
}

Packs::Way Packs::way_after(const std::shared_ptr<const Plan>& plan, const Inputs& inputs, int states, int tried, double seconds) {
  const double alone = seconds / tried, ahead = alone * (states - tried);
  {
    const std::lock_guard<Mutex> lock(mutex_);
    Kept& k = kept(*plan, inputs);
    k.alone = k.alone > 0 ? std::min(k.alone, alone) : alone;
    k.spent += seconds + ahead;
    if (k.spent < seconds_to_record * operations_a_flop * plan->flops() * inputs.columns) return {};
  }
  return recorded(plan, inputs, std::min(most_operations, static_cast<size_t>(alone / seconds_in_pack)));
}

void Packs::compare(const TapedPlan& taped, const Plan& plan, const Inputs& inputs, double seconds_a_state) {
  const std::lock_guard<Mutex> lock(mutex_);
  Kept& k = kept(plan, inputs);
  if (forced || k.alone == 0 || k.taped.get() != &taped) return;
  k.slower = seconds_a_state > k.alone ? k.slower + 1 : 0;
  if (k.slower == most_slower) k.taped = nullptr;
}

std::vector<int> Packs::run(const TapedPlan& taped, const Plan& plan, const Inputs& inputs, int from, int states, int threads, double* out) {
  std::vector<kernels::Entries> arrays;
  for (const Context& c : plan.contexts) {
    const bool batch = c.binding && c.binding->batch >= 0;
    arrays.push_back({batch ? c.binding->q.data() : nullptr, batch ? size_t(c.binding->nq) : 0});
    arrays.push_back({batch ? c.binding->v.data() : nullptr, batch ? size_t(c.binding->nv) : 0});
  }
  arrays.push_back({inputs.x, inputs.batched ? size_t(plan.domain.dimension()) * inputs.columns : 0});
  for (const auto& [name, r] : plan.vectors) arrays.push_back({inputs.vectors.at(name).data(), 0});
  const double begin = seconds_of_thread();
  std::vector<int> left = kernels::replayed(taped.program, arrays, {from, states, threads, out, size_t(taped.rows) * taped.columns}, rooms_);
  if (threads == 1 && from < states) compare(taped, plan, inputs, (seconds_of_thread() - begin) / (states - from));
  return left;
}

}  // namespace pycraft
