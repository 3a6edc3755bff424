// Block elimination of a realization over the tree, leaves to root. Body k's states form one pivot block; a body is coupled to its
// parent (through the few rows and columns that edges carry) and to the border (the states of low-rank terms), so nothing fills in:
//
//   U(k) = A(k,k)⁻¹ [A(k,p) A(k,b)],     [A(p,p) A(p,b); A(b,p) A(b,b)] -= [A(p,k); A(b,k)] U(k)
//
// Within a block, rows are compared in the powers of two of an equilibration (equilibration.h), and a state's own equation is taken unless
// another is ten times larger there, then the one that it is matched with: so the units of the model decide nothing, to the bit, and
// resolvents are eliminated by their own recursions, which do not lose what an elimination in another order does along a chain. A pivot that is rounding next to what was added
// up in its entry counts as zero. A singular pivot block is merged with its parent's (the re-ordering attempt). An expression that hides a
// well-conditioned operator behind large terms that cancel can make the elimination unstable: after every factorization a solve with a known
// solution, every state of it of the size that it takes in a solve, measures what was lost, and where that is more than seven digits, fronts are merged two by two, and again, until
// it is not. When everything is one front the elimination is dense, and the caller says so; a model too large for that is eliminated in
// a wider scalar (the caller's business: blocks and values may be narrower than S). Diagonal blocks of the inverse come base to tip:
//
//   Z(k,k) = A(k,k)⁻¹ + U(k) Z(pb,pb) L(k),   Z(k,b) = -U(k) Z(pb,b),   Z(b,k) = -Z(b,pb) L(k),   L(k) = [A(p,k); A(b,k)] A(k,k)⁻¹
//
// Cost O(N) with the pivot blocks' size cubed; one step of iterative refinement with every solve.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algebra/language/values.h"
#include "algebra/planning/realization.h"
#include "numerics/refinement.h"
#include "numerics/small_lu.h"
#include "numerics/small_matrix.h"
#include "runtime/errors.h"

namespace pycraft {

// Blocks of a block-diagonal operator, body after body, row-major.
template <class S>
struct BlockStorage {
  std::vector<int> rows, columns;
  std::vector<size_t> offset;
  std::vector<S> data;
  void shape(const Space& r, const Space& c) {
    const size_t bodies = r.layout().of_body.size();
    if (rows.size() == bodies && bodies) return;
    rows.clear(), columns.clear(), offset.assign(1, 0);
    for (size_t k = 0; k < bodies; ++k) {
      rows.push_back(r.body_size(k));
      columns.push_back(c.body_size(k));
      offset.push_back(offset.back() + size_t(rows[k]) * columns[k]);
    }
    data.assign(offset.back(), S(0));
  }
  S* at(int k) { return data.data() + offset[k]; }
  const S* at(int k) const { return data.data() + offset[k]; }
};

namespace elimination {

// Whether a recorded run is written down as source (written_plan.h): its guard is the solve whose solution is known, and none of natural right sides,
// which are three quarters of the operations.
bool for_source();

}  // namespace elimination

template <class S>
class TreeElimination {
 public:
  explicit TreeElimination(std::shared_ptr<const Realization> realization);

  // Assembles and factors. blocks(i): the i-th register; values(c): the numbers of context c; either may be of a narrower scalar.
  // False where a solution loses more than `tolerated` and the operator is too large for one front: note() says where, and a wider
  // scalar may decide.
  template <class Blocks, class Values>
  bool factor(Blocks&& blocks, Values&& values, S tolerated = most_lost());
  // A recorded one cannot be done in another way: states where it loses more, or in packs nearly as much, run by themselves.
  static S most_lost() { return is_recorded<S> && !elimination::for_source() ? S(S(1e6) * epsilon<S>()) : std::min(S(S(1e7) * epsilon<S>()), S(1e-2)); }

  // y = operator x, m columns, with one step of refinement or more. residual(x, s, r): r = b(x) - A s in a wider scalar.
  template <class T, class Blocks>
  void solve(const T* x, T* y, int m, Blocks&& blocks, const Refinement& how) {
    solve(x, y, m, blocks, how, [&](const T*, const S* s, S* r) {
      std::copy_n(residual_.data(), (total_ + border_) * m, r);
      subtract_product(s, r, m);
    });
  }
  template <class T, class Blocks, class Residual>
  void solve(const T* x, T* y, int m, Blocks&& blocks, const Refinement& how, Residual&& residual);

  // The system of a narrower elimination, its bodies merged as there, not factored: for residuals.
  template <class T, class Blocks, class Values>
  void assemble_as(const TreeElimination<T>& narrow, Blocks&& blocks, Values&& values);
  template <class T, class U, class Blocks>
  void residual(const T* x, const U* s, U* r, int m, Blocks&& blocks);

  // Diagonal blocks of the operator (inputs and outputs local).
  template <class T>
  void selected(BlockStorage<T>& out);

  S log_abs_determinant() const;
  const std::string& note() const { return note_; }
  bool dense() const { return dense_; }

 private:
  template <class T>
  friend class TreeElimination;
  struct Front {
    std::vector<int> bodies;                  // eliminated together, the topmost first
    int parent = -1;                          // front
    int n = 0;                                // states
    size_t matrix = 0, across = 0, over = 0;  // offsets of A(k,k), [A(k,p) A(k,b)], [A(p,k); A(b,k)]
    std::vector<int> columns, rows;           // states and equations of the parent front that edges join to this one
    std::vector<int> column_index, row_index; // their numbers by position in the parent front; -1 for the others
    size_t vector = 0;                        // offset of its states in a solution
    size_t sizes = 0;                         // offset of the sizes of A(k,k)'s entries
    int width() const { return static_cast<int>(columns.size()); }
    int height() const { return static_cast<int>(rows.size()); }
  };
  struct Place {  // where a state or an equation lies: front -1 is the border
    int front, position;
  };

  void lay_out(bool one_front);
  void make_fronts(bool one_front);
  int place(const std::vector<Space>& spaces, bool one_front, std::vector<std::vector<Place>>& at, std::vector<int>& used) const;
  void join_fronts();                                      // which of a parent's states and equations edges touch
  bool eliminate();
  void join_scales();
  void take_units(const S* solution);
  S in_units(const S& x, size_t i) const;
  S lost();                                                // relative error of a solve whose solution is known
  bool natural_sides_are_solved(S tolerated);              // to a backward error, row by row
  void coarsen();                                          // every other front merged into its parent
  S growth_ = S(0);
  template <class T>
  const S* own_scalar(const T* block, size_t entries, std::vector<S>& converted) const;
  void add_block(Place row, Place column, const S* block, int r, int c, S factor);
  template <class Blocks, class Values>
  void assemble(Blocks&& blocks, Values&& values);
  template <class Blocks>
  void add_term(const Realization::Term& t, Blocks&& blocks);
  template <class Blocks, class Values>
  void add_edge_term(const Realization::Term& t, Blocks&& blocks, Values&& values);
  template <class Values>
  void load_edge(const Realization::Term& t, int k, Values&& values);
  void add_border(const Realization::Border& t);
  template <class T, class Blocks>
  void right_hand_side(const T* x, int m, Blocks&& blocks);
  template <class T, class Blocks>
  void gather_output(const T* x, int m, Blocks&& blocks);
  template <class Term>
  void over_products(const S* s, S* r, int m, Term&& term) const;  // term(r(i), T(i,j), s(j)) for every entry of T
  void subtract_product(const S* s, S* r, int m) const {           // r -= T s
    over_products(s, r, m, [](S& target, const S& entry, const S& x) { target -= entry * x; });
  }
  template <class F>
  void of_one_kind(int state, F&& visit) const;            // visit(i) of all numbers of one state, over the bodies
  void solve_system(S* b, int m);
  void selected_fronts();                                  // Z(k,k), Z(k,b), Z(b,k) of every front

  std::shared_ptr<const Realization> r_;
  const SkoStructure& tree_;
  std::vector<int> front_of_;                                // body -> front
  std::vector<Front> fronts_;                                // parents before children
  std::vector<std::vector<Place>> state_at_, equation_at_;   // of state j at body k; Euclidean: one entry
  int border_ = 0;
  size_t total_ = 0;
  std::vector<S> A_, original_;                      // all matrices, factored and as assembled; the largest that went into each entry of A(k,k)
  std::vector<S> border_matrix_, border_original_;
  std::vector<Soft<S>> sizes_, border_sizes_;
  std::vector<S> natural_;                                   // of a recorded one: what gives each state in its unit
  std::vector<int> unit_, row_scale_, shift_, over_size_;    // binary exponents of each state's unit and each equation's scale; work
  std::vector<SmallLU<S>> lu_;
  SmallLU<S> border_lu_;
  std::vector<S> rhs_, residual_, probe_, solution_, backward_, work_, block_, edge_, product_, left_, right_, output_, Z_, z_border_;
  std::vector<size_t> z_offset_;
  std::vector<char> merged_with_parent_;
  int failed_ = -1;
  bool dense_ = false;
  std::string note_;
};

}  // namespace pycraft

#include "algebra/engine/elimination/elimination_accuracy.h"
#include "algebra/engine/elimination/elimination_assembly.h"
#include "algebra/engine/elimination/elimination_factor.h"
#include "algebra/engine/elimination/elimination_layout.h"
#include "algebra/engine/elimination/elimination_selected.h"
#include "algebra/engine/elimination/elimination_solve.h"
