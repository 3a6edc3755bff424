// Rows of loops at given states, one or a batch, in any precision to quad. Cost: the hinges around the loops, a state.
#pragma once

#include <memory>

#include "dynamics/batches.h"
#include "model/loops.h"
#include "recursions/loop_rows.h"

namespace pycraft {

template <class S>
struct LoopWorkspace {
  explicit LoopWorkspace(const Multibody& model) : model(model.compiled<S>()) {}
  std::shared_ptr<const CompiledModel<S>> model;
  LoopBuffers<S> buffers;
};
template <>
inline constexpr bool available_at<LoopWorkspace, Digits50> = false;
template <>
inline constexpr bool available_at<LoopWorkspace, Digits100> = false;

class LoopCalls : public Batches<LoopWorkspace> {
 public:
  explicit LoopCalls(std::shared_ptr<LoopSet> loops) : Batches(loops->shared_model()), loops_(std::move(loops)) {}

  void residual(Precision precision, Given q, double* out);          // (rows) a state, zeros of rows of velocities
  void sizes(Precision precision, Given q, double* out);             // what rows are measured by, the largest of their entries' (rows) a state
  void jacobian(Precision precision, Given q, double* out);          // Q, (rows x nv) a state
  void rates(Precision precision, Given q, Given v, double* out);    // Qθ̇, (rows) a state
  void bias(Precision precision, Given q, Given v, double* out);     // Q̇θ̇, (rows) a state
  // Along displacements, and once along velocities: ∂(Qv)/∂q, ∂(Q v̇ + Q̇v)/∂q, ∂(Q̇v)/∂v (rows x nv each), then ∂(Q*λ)/∂q (nv x nv), a state; λ
  // (rows) is of all states. Cost: nv times the rows. EvaluationError names a function that has no third derivatives where they are needed.
  void derivatives(Precision precision, Given q, Given v, Given vdot, const double* multipliers, double* out);

 private:
  std::shared_ptr<LoopSet> loops_;
};

}  // namespace pycraft
