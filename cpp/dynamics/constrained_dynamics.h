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
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011 (tree augmentation); J. Baumgarte, Stabilization of constraints, 1972.
#pragma once

#include <memory>
#include <vector>

#include "dynamics/batches.h"
#include "dynamics/interbody_forces.h"
#include "model/loops.h"
#include "numerics/rank_factors.h"
#include "recursions/loop_columns.h"

namespace pycraft {

// Of unit columns of W that of which less is left counts as dependent: what noise, ε/σ² in λ and ε/σ in θ̈, and what is left out, σ in the
// rows, are of one size there. States and models are doubles: in a wider scalar their rounding would make a direction of what has none, as of the
// redundant row of a spatial linkage.
template <class S>
S rank_tolerance() {
  using std::sqrt;
  return maximum(S(sqrt(epsilon<S>())), S(64 * epsilon<double>()));
}

// rad/s, m/s: what is slower is what rounding leaves of velocities that stopped.
inline constexpr double stopped = 1e-13;

// r̈ + 2α ṙ + β² r = 0
struct Baumgarte {
  double alpha = 0, beta = 0;
};

// What computes at one state.
template <class S>
class ConstrainedWorkspace {
 public:
  // terms: what is added to J; nothing is prescribed here but as a row.
  explicit ConstrainedWorkspace(const Multibody& model, const HingeTerms& terms = {});

  struct Asked {
    const S *q, *v, *tau;
    const S* wrenches = nullptr;              // six numbers a node
    const PushedNodes* pushed = nullptr;
    const Applied<S>* applied = nullptr;      // null: the model's gravity and those wrenches
    Form form = Form::fast;
    Refinement refinement;
    const std::vector<Baumgarte>* gains = nullptr;  // of rows; null: none
    const S* driven = nullptr;                // (rows) Q θ̈ + c = driven; null: zero
  };
  void accelerate(const std::shared_ptr<const ResolvedLoops>& loops, const Asked& asked);
  // Q v⁺ = 0, v⁺ = v + (ℳ + J)⁻¹ (p + Q*λ)
  void project(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const S* v, const S* p, Form form);
  // q onto the rows of positions by Newton's steps, each the shortest in kinetic energy, then v onto all, Q v = rates (null: zero); as far as
  // that is sure.
  void bring(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, const S* rates, Form form);
  // The same; EvaluationError names a row where a state is further off than these steps reach.
  void take_onto(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, const S* rates, Form form);
  // How far a state is off each row, by the size of the row's entries: of positions r, of all Qθ̇ - rates; v null: not those.
  void find_off(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const S* v, const S* rates, std::vector<S>& positions, std::vector<S>& velocities);
  // What J has in addition at coordinates that are driven, until it is set again; of all coordinates.
  void add_to_hinges(const S* inertia) { added_.assign(inertia, inertia + model_->nv); }
  // += Q*λ of some rows.
  void add_forces(int first, int end, S* out) const;

  const std::vector<S>& result() const { return x_; }        // θ̈ or v⁺
  const std::vector<S>& multipliers() const { return lambda_; }
  int rank() const;
  // The force of a loop on b, or on a, in its axes about its origin.
  Vector6<S> force(int loop, bool on_a) const;

 private:
  void set_loops(const std::shared_ptr<const ResolvedLoops>& loops);
  void find_bias(const Asked& asked);         // Q̇θ̇ with gains and what drives the rows, and the size of what it is the sum of
  void factor(const S* bias);                 // the rows' columns, of the tree's factors; of accelerations with Q̇θ̇, else null
  // x += (ℳ + J)⁻¹Q*λ such that Q x + target = 0, and adds λ. `first`: where rows conflict, false if a wider scalar may tell them apart, else refused.
  bool meet(const S* target, bool first);
  bool apart_in_own_units();                  // whether rows that depend on each other in units of energy are independent in their own
  void correct(const Asked& asked, const Applied<S>& applied);
  void add_correction();
  bool sure(const Asked& asked, const Applied<S>& applied, bool refuse);
  bool sure_by_squares(const Asked& asked, const Applied<S>& applied);
  // The most by which what is returned may miss a row or an equation of motion, of the largest number in it.
  static S certified() { return S(64) * rank_tolerance<S>(); }
  void close(S* q);
  S size_of(int row) const;
  void place(const S* q, Form form);
  void find_forces(const Asked& asked, const S* x, const Applied<S>& applied);  // of the motion θ̈ = x, to generalized_
  static S largest(const std::vector<S>& of);
  void solve(const S* r, S* x);
  S energy(const S* x);                       // x* (ℳ + J)⁻¹ x
  S energy_of_hinges(const S* x);             // x* D⁻¹ x
  S unit(int row) const {                     // of a row: what its rounding is, by epsilon
    using std::sqrt;
    return sqrt(unit_squares_[row]);
  }
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
  std::vector<std::vector<int>> asking_;      // of every group: rows that are not zero
  std::vector<std::vector<int>> active_;      // of those: rows of which columns are not rounding
  std::vector<int> all_, loop_of_;            // bodies, tips first; of rows
  std::vector<Vector6<S>> z_, alpha_;
  std::vector<S> x_, lambda_, c_, unit_squares_, dense_, epsilon_, scratch_, target_, part_, b_, conflict_, scale_, sizes_, off_, r_, delta_, bias_, moved_, gone_, slip_, added_, generalized_, before_, load_;
  const HingeTerms terms_;
  std::unique_ptr<RigidDynamics<Wider<S>>> wider_;
};
template <>
inline constexpr bool available_at<ConstrainedWorkspace, Digits50> = false;
template <>
inline constexpr bool available_at<ConstrainedWorkspace, Digits100> = false;

extern template class ConstrainedWorkspace<Single>;
extern template class ConstrainedWorkspace<double>;
extern template class ConstrainedWorkspace<Extended>;
extern template class ConstrainedWorkspace<Quad>;

}  // namespace pycraft
