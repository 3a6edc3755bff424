// The engine: runs a plan's steps at one precision, for one state or state after state of a batch. All memory of a run is kept in a
// workspace and reused, so that a second run of the same plan allocates nothing.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "algebra/interrupt.h"
#include "algebra/plan.h"
#include "algebra/scalar_expression.h"

namespace pycraft {

// Numbers that leave the engine: doubles, or exact expansions of wider scalars.
struct Result {
  std::vector<double> values;                   // (batch,) rows, columns, row-major
  std::vector<std::vector<double>> expansions;  // per value, only if asked for
  int batch = -1, rows = 0, columns = 1;
};

// Passes of the last run, by kind of step: what was executed, not what was planned.
struct PassCounts {
  int values = 0, gathers = 0, scatters = 0, kernels = 0, eliminations = 0, dense = 0;
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
  explicit ExecutionPool(std::shared_ptr<const Plan> plan);
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
  struct Impl;
  std::shared_ptr<const Plan> plan_;
  std::unique_ptr<Impl> impl_;
};

// ------------------------------------------------------------------ evaluation of expressions
std::shared_ptr<ExecutionPool> prepare(const Expression& e, Request request, bool rules = true);
void evaluate(const Expression& e, Request request, const Inputs& inputs, Result& result, bool rules = true, bool expansions = false);
// y = e x
void apply(const Expression& e, const Inputs& inputs, Result& result, bool rules = true, bool expansions = false);
// dense, block_diagonal, diagonal, trace, logdet, norm
void evaluate(const Expression& e, Request request, Result& result, bool rules = true, bool expansions = false);
std::vector<double> evaluate(const Scalar& s, int* batch, bool rules = true);

// ‖a - b‖, ‖a‖, ‖b‖ (largest entries), both sides evaluated as typed, no theorem used, the difference taken at the bound precision.
// on_one_path: only blocks (i, j) with i and j on one path to the base. at_most: only what a exceeds b by.
// Operators of many columns are compared on a few random vectors of signs instead of column by column.
struct Residual {
  double difference = 0, left = 0, right = 0;
};
Residual residual(const Expression& a, const Expression& b, const std::map<std::string, std::vector<double>>& vectors, bool on_one_path = false,
                  bool at_most = false);
Residual residual(const Scalar& a, const Scalar& b);

}  // namespace pycraft
