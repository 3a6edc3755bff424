#include "algebra/engine/plan_cache.h"

#include <algorithm>
#include <mutex>

#include "algebra/engine/in_use.h"
#include "algebra/engine/packs.h"
#include "algebra/language/memo.h"

namespace pycraft {

namespace {

bool bound_to(const Plan& plan, const std::shared_ptr<const Binding>& binding) {
  return std::all_of(plan.contexts.begin(), plan.contexts.end(), [&](const Context& c) { return c.binding == binding; }) &&
         std::all_of(plan.steps.begin(), plan.steps.end(), [&](const Step& s) { return !s.operand || bound_to(*s.operand, binding); });
}

// The same plan at another state, or at none.
std::shared_ptr<const Plan> rebound(const Plan& plan, const std::shared_ptr<const Binding>& binding) {
  auto made = std::make_shared<Plan>(plan);
  for (Context& c : made->contexts) c.binding = binding;
  for (Step& s : made->steps)
    if (s.operand) s.operand = rebound(*s.operand, binding);
  if (made->batched && binding) made->batch = binding->batch;
  return made;
}

// Of models as they are now.
bool current(const Plan& plan) {
  for (size_t c = 0; c < plan.contexts.size(); ++c)
    if (plan.contexts[c].source->traits().hinge_diagonal != plan.hinge_diagonal[c]) return false;
  return true;
}

}  // namespace

PlanCache::BoundKey PlanCache::key_of(Request request, bool rules, const Binding& binding) {
  const Arithmetic& how = binding.arithmetic;
  return {request, rules, how.form, how.refinement.steps, how.refinement.residual, how.precision, binding.batch >= 0};
}

PlanCache::Made PlanCache::find_bound(const BoundKey& key, const std::shared_ptr<const Binding>& binding) {
  Made known;
  {
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(pools_, bound_);
    const auto found = bound_.find(key);
    if (found != bound_.end()) known = found->second;
  }
  if (!known.plan || !current(*known.plan)) return {};
  return {rebound(*known.plan, binding), known.packs};
}

PlanCache::Made PlanCache::keep_bound(const BoundKey& key, const std::shared_ptr<const Binding>& binding, const std::shared_ptr<const Plan>& plan) {
  if (!bound_to(*plan, binding)) return {plan, nullptr};
  const Made without{rebound(*plan, nullptr), std::make_shared<Packs>()};
  std::lock_guard<Mutex> lock(mutex_);
  if (mutex_.abandoned()) leave_behind(pools_, bound_);
  bound_[key] = without;
  return {plan, without.packs};
}

PlanCache::Made PlanCache::made(const Expression& e, Request request, const PlanOptions& options) {
  const auto all = contexts(e);
  const InUse use(all);
  const std::shared_ptr<Memo>& origin = e.node().memo()->origin();
  const std::shared_ptr<const Binding> binding = all.empty() ? nullptr : all[0].binding;
  if (!origin || !binding) return {make_plan(e, request, options), nullptr};
  e.check_current();
  PlanCache& of_origin = origin->get<PlanCache>();
  const BoundKey key = key_of(request, options.rules, *binding);
  if (Made known = of_origin.find_bound(key, binding); known.plan) return known;
  return of_origin.keep_bound(key, binding, make_plan(e, request, options));
}

// The plan is made outside the lock: a signal's handler, called in between, may ask for the same one.
std::shared_ptr<ExecutionPool> PlanCache::find_or_make(const Expression& e, Request request, const PlanOptions& options) {
  const Key key{request, options.rules};
  {
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(pools_, bound_);
    const auto kept = pools_.find(key);
    if (kept != pools_.end() && kept->second->current()) return kept->second;
  }
  const Made known = made(e, request, options);
  auto pool = std::make_shared<ExecutionPool>(known.plan, known.packs);
  std::lock_guard<Mutex> lock(mutex_);
  std::shared_ptr<ExecutionPool>& kept = pools_[key];
  if (!kept || !kept->current()) kept = pool;
  return kept;
}

}  // namespace pycraft
