// Forward dynamics of a model on its loops by tree augmentation: the accelerations of the tree alone, and what the loops' forces add.
//
//   (ℳ + J) θ̈ = T - 𝒞 + Q*λ,   Q θ̈ + c = 0,   c = Q̇θ̇ + 2α Qθ̇ + β² r
//   Q(ℳ + J)⁻¹Q* λ = -(Q θ̈_free + c),   θ̈ = θ̈_free + (ℳ + J)⁻¹Q*λ
//
// c without Q̇θ̇ is wrong at speed; α and β are Baumgarte's, zero by default. Of redundant rows λ has the least 2-norm; rows that ask different
// accelerations of the same motion are refused by name. What is returned was put into both equations (recursions/loop_columns.h,
// numerics/rank_factors.h). The same factors take velocities onto the rows: Q v⁺ = 0 after an impulse of the loops, v⁺ = v + (ℳ + J)⁻¹Q*λ.
//
// Cost O(N) and O(depth) a row, and the factors of each group of loops that share hinges inboard of them (numerics/rank_factors.h).
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, ch. 11 (tree augmentation); J. Baumgarte, Stabilization of constraints, 1972.
#pragma once

#include <memory>
#include <vector>

#include "dynamics/batches.h"
#include "dynamics/interbody_forces.h"
#include "model/loops.h"
#include "numerics/rank_factors.h"
#include "recursions/loop_columns.h"

namespace pycraft {

// What computes at one state.
template <class S>
class ConstrainedWorkspace {
 public:
  explicit ConstrainedWorkspace(const Multibody& model);

  struct Asked {
    const S *q, *v, *tau;                     // tau null: v is taken onto the rows; v null there: none
    const S* wrenches = nullptr;              // six numbers a node
    const PushedNodes* pushed = nullptr;
    Form form = Form::fast;
    Refinement refinement;
    double alpha = 0, beta = 0;
  };
  void accelerate(const std::shared_ptr<const ResolvedLoops>& loops, const Asked& asked);
  // Q v⁺ = 0, v⁺ = v + (ℳ + J)⁻¹ (p + Q*λ)
  void project(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const S* v, const S* p, Form form);

  const std::vector<S>& result() const { return x_; }        // θ̈ or v⁺
  const std::vector<S>& multipliers() const { return lambda_; }
  int rank() const;
  // The force of a loop on b, or on a, in its axes about its origin.
  Vector6<S> force(int loop, bool on_a) const;

 private:
  void set_loops(const std::shared_ptr<const ResolvedLoops>& loops);
  void factor();                              // the rows' columns, of the tree's factors
  void meet(const S* target, bool first);     // x += (ℳ + J)⁻¹Q*λ such that Q x + target = 0, and adds λ
  void correct(const Asked& asked, const Applied<S>& applied);
  bool sure(const Asked& asked, const Applied<S>& applied, bool refuse);
  void solve(const S* r, S* x);
  S energy_norm(const S* x);                  // (x* (ℳ + J)⁻¹ x)^½
  [[noreturn]] void refuse_rows(const std::vector<S>& off, const S& worst, const char* what) const;

  const Multibody& source_;
  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<S>> model_;
  RigidBlocks<S> blocks_;
  PointAccelerations<S> points_;
  InterbodyForces<S> forces_;
  std::shared_ptr<const ResolvedLoops> loops_;
  LoopGroups groups_;
  LoopBuffers<S> buffers_;
  LoopRows<S> rows_;
  std::vector<MinimumNormSystem<S>> systems_;
  std::vector<std::vector<int>> active_;      // of every group: rows of which columns are not rounding
  std::vector<int> all_, loop_of_;            // bodies, tips first; of rows
  std::vector<Vector6<S>> z_, alpha_;
  std::vector<S> x_, lambda_, c_, unit_, dense_, epsilon_, scratch_, target_, part_, b_, conflict_, scale_, sizes_, off_, r_, delta_, bias_;
  std::unique_ptr<RigidDynamics<Wider<S>>> wider_;
};
template <>
inline constexpr bool available_at<ConstrainedWorkspace, Digits50> = false;
template <>
inline constexpr bool available_at<ConstrainedWorkspace, Digits100> = false;

class ConstrainedDynamics : public Batches<ConstrainedWorkspace> {
 public:
  explicit ConstrainedDynamics(std::shared_ptr<LoopSet> loops) : Batches(loops->shared_model()), loops_(std::move(loops)) {}

  struct Asked {
    Given q, v, input, wrenches;              // input: T of accelerations, an impulse p of velocities
    const PushedNodes* pushed = nullptr;
    Form form = Form::fast;
    Refinement refinement;
    Precision precision = Precision::double_;
    double alpha = 0, beta = 0;
    bool velocities = false;
  };
  // A state: θ̈ or v⁺ (nv), λ (rows), of each loop the force on b and on a (6 each, in their axes about their origins), the rank of Q.
  struct Results {
    double *x, *multipliers, *forces;
    int* rank;
  };
  void run(const Asked& asked, const Results& out);

 private:
  std::shared_ptr<LoopSet> loops_;
};

extern template class ConstrainedWorkspace<Single>;
extern template class ConstrainedWorkspace<double>;
extern template class ConstrainedWorkspace<Extended>;
extern template class ConstrainedWorkspace<Quad>;

}  // namespace pycraft
