// The numbers of an SKO model at one state, as the engine sees them: apply a symbol, sweep a resolvent, hand out a block.
// One virtual call per sweep, none inside. Vectors of several columns are row-major: entry (i, c) at x[i * columns + c].
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>

#include "algebra/language/residual_sizes.h"
#include "algebra/language/source.h"
#include "algebra/language/symbol.h"
#include "runtime/errors.h"
#include "runtime/mutex.h"

namespace pycraft {

template <class S>
class SkoValues;

// y = ∂(ℳ + J)⁻¹ x along the direction of a letter (SymbolDefinition::tangent_of_inverse), by the derivative of the Riccati sweep at these
// values. False where the sweep has no derivative there. Its memory is kept from run to run.
template <class S>
class InverseTangent {
 public:
  virtual ~InverseTangent() = default;
  virtual bool apply(const SkoValues<S>& values, const Symbol& direction, const S* x, S* y, int columns) = 0;
};

template <class S>
class SkoValues {
 public:
  using Scalar = S;
  virtual ~SkoValues() = default;

  // The form of the articulated-inertia sweep; set before the first state.
  virtual void use(Form form) = 0;

  // Moves to a state (null pointers where the source has none): nothing is computed yet.
  void move_to(const double* q, const double* v) {
    set_state(q, v);
    ready_ = 0;
    generation_ = next_generation();
  }
  // Tells one filling from another, also of another object: factors made from these numbers are good as long as it stays.
  std::uint64_t generation() const { return generation_; }
  // Computes the groups that are missing. Safe from several threads; afterwards reading is.
  void require(unsigned groups) {
    if ((ready_.load(std::memory_order_acquire) & groups) == groups) return;
    std::lock_guard<Mutex> lock(mutex_);
    const Computing now(*this);
    unsigned ready = ready_.load();
    for (unsigned group : {unsigned(Group::inverse), unsigned(Group::kinematics), unsigned(Group::articulated), unsigned(Group::composite), unsigned(Group::compliance), unsigned(Group::velocities)}) {
      const unsigned wanted = groups & group & ~ready;
      if (!wanted) continue;
      groups |= compute(wanted);
      ready |= wanted;
    }
    ready_.store(ready, std::memory_order_release);
  }

  // Whether nobody reads them any more, so that they may move to another state.
  bool unused() const { return users_.load(std::memory_order_acquire) == 0; }
  // Whether this thread may ask for groups: not where it is in the midst of computing some (a signal's handler came between), nor where
  // a fork left behind the thread that was.
  bool askable() const { return computing_.load(std::memory_order_relaxed) != std::this_thread::get_id() && !mutex_.left_behind(); }

  // y = A x or A* x for a block-diagonal or edge symbol; inverse: y = A⁻¹ x (D only).
  virtual void apply(const Symbol& symbol, bool transposed, bool inverse, const S* x, S* y, int columns) const = 0;
  // y = φ x, φ* x, ψ x, ψ* x.
  virtual void sweep(SymbolId resolvent, bool transposed, const S* x, S* y, int columns) const = 0;
  // Block (k, k) of a block-diagonal symbol, row-major; for an edge symbol the block (parent of k, k).
  virtual void block(const Symbol& symbol, int k, S* out) const = 0;
  // A block function of a vector's part at body k.
  virtual void function_block(const Symbol& function, int k, const S* x, S* out) const = 0;
  // A vector symbol.
  virtual void vector(const Symbol& symbol, S* out) const = 0;
  // The fused kernels: y = HφMφ*H* x + J x if asked; y = [I-HψK]* D⁻¹ [I-HψK] x; HφMφ*H* as a dense matrix.
  virtual void mass_matrix(bool with_hinge_diagonal, const S* x, S* y, int columns, S* scratch) const = 0;
  virtual void mass_matrix_inverse(const S* x, S* y, int columns, S* scratch) const = 0;
  // The latter by what Group::inverse holds.
  virtual void inverse_by_itself(const S* x, S* y, int columns, S* scratch) const { mass_matrix_inverse(x, y, columns, scratch); }
  // r = b - (HφMφ*H* + J) x with forces gathered one scalar up, of those that know their masses to it.
  virtual bool gathers_wider() const { return false; }
  virtual void gathered_residual(const S*, const S*, S*, int, S*, std::vector<Wider<S>>&) const { throw EvaluationError("forces are not gathered in wider numbers here"); }
  // The most that rounding of a residual b - (HφMφ*H* + J) x, in these units, makes of a correction along w, column by column: sweeps/residual_rounding.h.
  virtual void mass_matrix_rounding(const S* x, const S* b, const S* w, const RoundingUnits<S>& units, S* out, int columns, ResidualSizes<S>& sizes) const = 0;
  virtual void mass_matrix_dense(bool with_hinge_diagonal, S* out) const = 0;
  // ln det D(k) summed over the hinges.
  virtual S log_determinant_of_D() const = 0;
  // Null where the sweep is not differentiated: in the widest scalars.
  virtual std::unique_ptr<InverseTangent<S>> inverse_tangent() const { return nullptr; }

 protected:
  virtual void set_state(const double* q, const double* v) = 0;
  // Which groups later in their order it takes besides.
  virtual unsigned compute(unsigned group) = 0;

 private:
  static std::uint64_t next_generation() {
    static std::atomic<std::uint64_t> counter{0};
    return ++counter;
  }
  struct Computing {
    SkoValues& values;
    explicit Computing(SkoValues& v) : values(v) { values.computing_ = std::this_thread::get_id(); }
    ~Computing() { values.computing_ = std::thread::id(); }
  };
  template <class T>
  friend class ValuesInUse;
  Mutex mutex_;
  std::atomic<std::thread::id> computing_{};
  std::atomic<int> users_{0};
  std::atomic<unsigned> ready_{0};
  std::uint64_t generation_ = 0;
};

// Values that a run reads. As long as it holds them they stay at their state.
template <class S>
class ValuesInUse {
 public:
  ValuesInUse() = default;
  explicit ValuesInUse(std::shared_ptr<SkoValues<S>> values) : values_(std::move(values)) { values_->users_.fetch_add(1, std::memory_order_relaxed); }
  ValuesInUse(ValuesInUse&&) = default;
  ValuesInUse& operator=(ValuesInUse&& other) {
    std::swap(values_, other.values_);
    return *this;
  }
  ~ValuesInUse() {
    if (values_) values_->users_.fetch_sub(1, std::memory_order_release);
  }
  SkoValues<S>* get() const { return values_.get(); }
  SkoValues<S>* operator->() const { return values_.get(); }
  explicit operator bool() const { return values_ != nullptr; }

 private:
  std::shared_ptr<SkoValues<S>> values_;
};

}  // namespace pycraft
