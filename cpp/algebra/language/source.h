// Where the blocks of the SKO symbols come from: a multibody model, or a bare tree of matrices. The algebra asks and never knows which.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "algebra/language/space.h"
#include "algebra/language/state.h"
#include "algebra/language/symbol.h"
#include "numerics/arithmetic.h"
#include "numerics/scalar.h"
#include "runtime/mutex.h"

namespace pycraft {

template <class S>
class SkoValues;
template <class S>
class ValuesInUse;

// The numerical blocks at one state, shared by all expressions that are evaluated there.
template <class S>
struct ValueCache {
  Mutex mutex;
  std::shared_ptr<SkoValues<S>> values;
  std::shared_ptr<const StateData> state;
  std::uint64_t parameters = 0;
};

// What theorems ask about a model before they apply.
struct Traits {
  bool chain;           // no branch, one root
  bool single_dof;      // no hinge of more than one coordinate
  bool constant_hinges; // H constant in the body's frame: no hinge of several subhinges
  bool hinge_diagonal;  // J != 0
  bool free_root;       // one root, its hinge free: H square there
  bool equal_blocks;    // every body has as many rows as its parent: E square
};

// What the block policy of a body makes of its work: operations and numbers.
struct BlockCosts {
  double shift;                          // E(p,k) x, of a body with a parent
  double inertia;                        // M(k) x
  double congruence;                     // E A E* to the parent
  double kinematics, kinematic_numbers;  // E, M at a state, without the rows of H
  double kinematics_of_coordinate;       // a row of H
  double square_numbers;                 // a symmetric block of the body
};

// The source a space belongs to, while it lives; null for R^n.
std::shared_ptr<SkoSource> source_owning(const Space& space);

class SkoSource : public std::enable_shared_from_this<SkoSource> {
 public:
  SkoSource(SkoStructure structure, std::string name);
  virtual ~SkoSource();

  const SkoStructure& structure() const { return structure_; }
  const std::string& name() const { return name_; }
  Space theta() const { return Space(SpaceKind::Theta, theta_layout_); }
  Space motions() const { return Space(SpaceKind::V, body_layout_); }
  Space forces() const { return Space(SpaceKind::F, body_layout_); }
  // The space of this kind; NodesV and NodesF are those of the nodes that a letter is of.
  virtual Space space(SpaceKind kind, const SymbolArguments& arguments) const;

  // An edit of the model's structure makes everything built on this source stale.
  void invalidate(const std::string& reason);
  virtual void check_current() const;

  virtual Traits traits() const = 0;
  virtual BlockCosts costs(int body) const = 0;
  // Whether values in double, in the form fast, have numbers of their own for ℳ⁻¹ (Group::inverse), which take less than the articulated group.
  virtual bool inverse_by_itself() const { return false; }
  virtual int nq() const = 0;
  virtual int nv() const = 0;
  // Throws ModelError that names what is wrong with a state.
  virtual void check_state(const double* q, size_t nq, const double* v, size_t nv) const = 0;
  virtual std::shared_ptr<const StateData> state() const = 0;
  virtual std::uint64_t parameters() const = 0;  // grows with every change of a mass, a placement, ...
  // Where tangent = ∂X of a direction that moves this model's bodies, X = HφMφ*H* (+ J): a letter for ∂(X⁻¹), which values apply by the
  // derivative of the Riccati sweep, and ∂D. Letters are bound as those of X are.
  virtual bool tangent_of_inverse(const Expression& X, const Expression& tangent, Expression& letter, Expression& of_D) {
    return static_cast<void>(X), static_cast<void>(tangent), static_cast<void>(letter), static_cast<void>(of_D), false;
  }
#define PYCRAFT_MAKE_VALUES(S) virtual std::unique_ptr<SkoValues<S>> make_values(S) const = 0;
  PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES
  // Null where batches of states are not recorded: then they run state after state.
  virtual std::unique_ptr<SkoValues<Recorded>> make_values(Recorded) const;
  // A state like any other, at which batches are recorded: no coordinate of it is special.
  virtual StateData generic_state() const { return {}; }

  // The values at the model's present state with these groups computed.
  template <class S>
  ValuesInUse<S> current_values(unsigned groups);

  // Between these the model is not edited (an edit raises); enter tells leave on which side of a fork it was.
  virtual unsigned enter_use() const { return 0; }
  virtual void leave_use(unsigned) const noexcept {}

 protected:
  // Derived models whose bodies, or coordinates, are those of another: their operators combine with its.
  void share_bodies_with(const SkoSource& other);
  void share_coordinates_with(const SkoSource& other) { theta_layout_ = other.theta_layout_; }
  // The coordinates of another whose bodies, in groups, are this one's.
  void share_coordinates_in_groups(const SkoSource& other, const std::vector<std::vector<int>>& groups);

 private:
  SkoStructure structure_;
  std::string name_;
  std::shared_ptr<const SpaceLayout> theta_layout_, body_layout_;
  std::atomic<bool> stale_{false};
  std::string stale_reason_;
  PerScalar<ValueCache> caches_;
};

// What a source declares: make_values at every scalar.
#define PYCRAFT_OVERRIDE_MAKE_VALUES(S) std::unique_ptr<SkoValues<S>> make_values(S) const override;

// A state, or a batch of states, that an expression was bound to by .at(...), and the way to compute there.
struct Binding {
  int batch = -1;            // -1: one state
  int nq = 0, nv = 0;
  std::vector<double> q, v;  // (batch, nq) and (batch, nv), row after row
  Arithmetic arithmetic;
  int threads = 1;           // that share the states of a batch

  // For one state: the cached values of this source.
  template <class S>
  ValuesInUse<S> values(const std::shared_ptr<SkoSource>& source, unsigned groups) const;

  template <class S>
  struct Entry {
    std::weak_ptr<SkoSource> source;
    std::uint64_t parameters;
    std::shared_ptr<SkoValues<S>> values;
  };
  mutable Mutex mutex;
  template <class S>
  using Entries = std::vector<Entry<S>>;
  mutable PerScalar<Entries> entries;
};

// The binding there is already with this state and way to compute; this one where there is none. Two expressions bound alike are bound
// to the same: they are equal, and share the numbers of the model there.
std::shared_ptr<const Binding> the_one_like(std::shared_ptr<const Binding> made);

}  // namespace pycraft
