// Forward dynamics of a model on its loops by constraint embedding: accelerations by independent coordinates, without multipliers.
//
//   θ̇ = X θ̇_r,   θ̈ = X θ̈_r + γ,   γ_r = 0,  Q_d γ_d = -c,  c = Q̇θ̇ - (what prescribed rows are driven by)
//   X*(ℳ + J)X θ̈_r = X*(T - 𝒞 - (ℳ + J)γ)
//
// solved node by node of the tree that the loops are embedded in (recursions/embedded_nodes.h); the right side is T less the forces of the motion γ, by
// Newton-Euler. What is returned was put into both equations: rows, also those that hang on others, and X* of the equations of motion.
// The loops' forces are known afterwards, Q_d* λ = (forces - T)_d; of rows that hang on others λ is zero.
//
// Which coordinates are independent is chosen at a state, by elimination of Q with complete pivoting in units of energy: columns by 1/√ℳ_ii, rows by
// their sizes, so that entries of X are of order one; of nodes of many rows, row after row, each with the largest of its entries for pivot; or given,
// of a node as many as are free, and then the others are eliminated. Positions off the loops go back by Newton's steps of the dependent coordinates
// alone, velocities by X: what is independent stays, and follows an ordinary differential equation.
//
// Cost O(N), of a node of n coordinates with r independent ones O(n r²), and what its rows cost to eliminate: linear where each shares coordinates with a
// few before it, as in a ladder; never more than O(n³). Form fast; others are in operators (soa.embedded()).
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapter on constraint embedding.
#pragma once

#include <memory>
#include <vector>

#include "dynamics/constrained_dynamics.h"
#include "numerics/sparse_elimination.h"
#include "recursions/embedded_nodes.h"

namespace pycraft {

// What computes at one state.
template <class S>
class EmbeddedWorkspace {
 public:
  using Asked = typename ConstrainedWorkspace<S>::Asked;

  // terms: what is added to J; nothing is prescribed here but as a row.
  explicit EmbeddedWorkspace(const Multibody& model, const HingeTerms& terms = {});

  void accelerate(const std::shared_ptr<const ResolvedLoops>& loops, const Asked& asked);
  // Independent coordinates anew, as they are best at q, or those given (numbers), of nodes that have any among them. EvaluationError names
  // coordinates that are no independent ones at q, and such as are.
  void choose(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const std::vector<int>& given = {});
  // The dependent parts of q and v anew by the independent ones, Q v = rates (null: zero); as far as that is sure.
  void bring(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, const S* rates);
  // The same, and independent coordinates anew; EvaluationError names a row where a state is further off than these steps reach.
  void take_onto(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, const S* rates);

  void add_to_hinges(const S* inertia) { added_.assign(inertia, inertia + model_->nv); }
  void add_forces(int first, int end, S* out) const;   // += Q*λ of some rows
  Vector6<S> force(int loop, bool on_a) const { return rows_.force(*loops_, lambda_, loop, on_a); }
  const std::vector<S>& result() const { return x_; }  // θ̈
  const std::vector<S>& multipliers() const { return lambda_; }
  // Coordinates of the tree that are independent now, none chosen: empty.
  std::vector<int> independent() const;
  // Of Q: as many rows as are solved.
  int rank() const;

 private:
  // Of a node with loops: which of its rows, which of its coordinates by place, and Q_d in factors.
  struct Choice {
    std::vector<int> rows, dependent, independent;
    std::vector<char> depends, may_depend;   // of all its coordinates
    std::vector<S> weights;                  // of them
    SparseElimination<S> elimination;
  };
  void set_loops(const std::shared_ptr<const ResolvedLoops>& loops);
  void place(const S* q);
  void factor_rows();                        // of every node, at rows_
  void find_maps();                          // and X
  void choose_many(size_t node, bool given);
  void choose_few(size_t node, bool given);
  void choose_of(size_t node, bool given);
  S size_beside_weights(int row) const;
  void enter(int row, SparseElimination<S>& elimination) const;
  [[noreturn]] void refuse_held(size_t node, int row, int place);
  [[noreturn]] void refuse_choice(size_t node, const std::string& what);
  void put_dependent(S* rows_target, S* x);  // x_d = -Q_d⁻¹ target
  void velocities(S* v, const S* rates);
  void find_forces(const Asked& asked, const S* x, const Applied<S>& applied);
  S energy_size(const S* x) const;
  void certify(const Asked& asked, const S& size);
  void find_multipliers(const Asked& asked);
  S off(const S* q);                         // to residual_, and the largest, in units of the rows
  S size_of(int row) const;
  [[noreturn]] void refuse_rows(const std::vector<S>& off, const S& worst, const char* what) const;
  static constexpr int most_at_once = 32;    // rows of a node whose pivots are looked for among all of them
  static S certified() { return S(64) * rank_tolerance<S>(); }

  const Multibody& source_;
  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<S>> model_;
  RigidBlocks<S> blocks_;
  InterbodyForces<S> forces_;
  std::shared_ptr<const ResolvedLoops> loops_;
  std::vector<EmbeddedNode> nodes_;
  std::vector<Choice> choices_;              // of nodes
  bool chosen_ = false;
  std::vector<char> wanted_;                 // coordinates that are to be independent; empty: none is asked for
  EmbeddedTree<S> embedded_;
  LoopBuffers<S> buffers_;
  LoopRows<S> rows_;
  std::vector<S> x_, lambda_, c_, bias_, generalized_, load_, delta_, added_, residual_, moved_, unit_, weights_, off_, dense_, by_rows_;
};
template <>
inline constexpr bool available_at<EmbeddedWorkspace, Digits50> = false;
template <>
inline constexpr bool available_at<EmbeddedWorkspace, Digits100> = false;

extern template class EmbeddedWorkspace<Single>;
extern template class EmbeddedWorkspace<double>;
extern template class EmbeddedWorkspace<Extended>;
extern template class EmbeddedWorkspace<Quad>;

}  // namespace pycraft
