// Plans that are made once: of an expression, and of all that it is bound to by `at`.
#pragma once

#include <map>
#include <memory>
#include <tuple>
#include <utility>

#include "algebra/engine/engine.h"
#include "algebra/language/expression.h"
#include "runtime/mutex.h"

namespace pycraft {

// Plans of one expression, one per request, with the workspaces of their runs: kept in its memo.
class PlanCache {
 public:
  std::shared_ptr<ExecutionPool> find_or_make(const Expression& e, Request request, const PlanOptions& options);

 private:
  using Key = std::pair<Request, bool>;  // a request, with rules or without
  // A plan, and the programs of all that differ from it by their states alone.
  struct Made {
    std::shared_ptr<const Plan> plan;
    std::shared_ptr<Packs> packs;
  };
  Made made(const Expression& e, Request request, const PlanOptions& options);

  // A plan hangs on how a state is computed and on whether it is one or many, not on the state: every expression that is this one bound to a
  // state has the plan of the first that was planned.
  using BoundKey = std::tuple<Request, bool, Form, int, ResidualPrecision, Precision, bool>;
  static BoundKey key_of(Request request, bool rules, const Binding& binding);
  Made find_bound(const BoundKey& key, const std::shared_ptr<const Binding>& binding);
  Made keep_bound(const BoundKey& key, const std::shared_ptr<const Binding>& binding, const std::shared_ptr<const Plan>& plan);

  Mutex mutex_;
  std::map<Key, std::shared_ptr<ExecutionPool>> pools_;
  std::map<BoundKey, Made> bound_;  // their bindings are left out, so that no state is kept
};

}  // namespace pycraft
