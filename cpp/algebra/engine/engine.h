// The engine: runs a plan's steps at one precision, for one state, or for the states of a batch, in one thread or several. All memory of
// a run is kept in a workspace, one a thread, and reused, so that a second run of the same plan in one thread allocates nothing.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "algebra/planning/plan.h"
#include "runtime/interrupt.h"
#include "runtime/mutex.h"

namespace pycraft {

class Packs;
template <class S>
class Run;

// Numbers that leave the engine: doubles, or exact expansions of wider scalars.
struct Result {
  std::vector<double> values;                   // (batch,) rows, columns, row-major
  std::vector<std::vector<double>> expansions;  // per value, only if asked for
  int batch = -1, rows = 0, columns = 1;
  double* into = nullptr;                       // where the values go instead, of a caller that knows how many there are
};

// Passes of the last run, by kind of step: what was executed, not what was planned.
struct PassCounts {
  int values = 0, gathers = 0, scatters = 0, kernels = 0, eliminations = 0, dense = 0;
  PassCounts& operator+=(const PassCounts& other);
  PassCounts times(int states) const;
};

struct Inputs {
  const double* x = nullptr;  // (batch,) rows, columns; null: the scalar 1
  int columns = 1;
  bool batched = false;       // x has a leading batch axis
  std::map<std::string, std::vector<double>> vectors;
};

// A plan with the workspaces of its runs. Runs in several threads each take their own.
class ExecutionPool {
 public:
  // packs: of plans that differ by their states alone; of its own where there is none.
  explicit ExecutionPool(std::shared_ptr<const Plan> plan, std::shared_ptr<Packs> packs = nullptr);
  ~ExecutionPool();
  const Plan& plan() const { return *plan_; }
  bool current() const;  // made for the models as they are now
  // False where the models changed since the plan was made: it is to be made anew.
  bool run(const Inputs& inputs, bool expansions, Result& result);
  PassCounts last_counts() const;
  std::vector<std::string> run_notes() const;

 private:
  template <class S>
  void run_at(const Inputs& inputs, bool expansions, Result& result);
  struct Packed;
  template <class S>
  Packed run_packs(Run<S>& run, const Inputs& inputs, Result* expanded);
  struct Impl;
  std::shared_ptr<const Plan> plan_;
  std::unique_ptr<Impl> impl_;
};

}  // namespace pycraft
