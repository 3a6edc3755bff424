// Direct calls on one state or on a batch of states, at any precision: numbers in rows of doubles in, rows of doubles out. What is given is
// checked here, once, for C++ and Python alike; workspaces are kept, one per thread, so that nothing is allocated per state.
#pragma once

#include <array>
#include <initializer_list>
#include <memory>
#include <span>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "dynamics/workspace_pool.h"
#include "numerics/arithmetic.h"
#include "numerics/finite.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

// Numbers of one state, or of every state of a batch, one after the other. "q" is a configuration; by any other name they are velocities,
// accelerations or forces, nv a state.
struct Given {
  const char* name;          // as errors call it
  const double* data;
  int width;                 // a state
  int batch = -1;            // -1: one state, which serves for all of a batch
  const double* at(int b) const { return data + (batch < 0 ? 0 : size_t(b) * width); }
  bool is_configuration() const { return name[0] == 'q' && name[1] == 0; }
};

// Several of them, for the time of a call.
struct Givens : std::span<const Given> {
  using std::span<const Given>::span;
  Givens(std::initializer_list<Given> list) : std::span<const Given>(list.begin(), list.size()) {}
};

// The states that these are of, -1: one state. ModelError for two batches.
int common_batch(Givens given);
// ModelError that names what is wrong: another width than the model's, entries that are not finite, a quaternion without direction.
void check_given(const Multibody& model, Givens given);
void check_widths(const Multibody& model, Givens given);
[[noreturn]] void throw_width(const Multibody& model, const std::string& name, int width);
// EvaluationError where a result left the range of its numbers.
void require_finite(const double* x, size_t n, const Multibody& model);

// Whether Workspace<S> is there; else a call at that precision says where it stops.
template <template <class> class Workspace, class S>
inline constexpr bool available_at = true;
inline constexpr const char* to_quad = "this call computes in precision 'single' to 'quad'; operators, and forward dynamics, go to 100 digits";

// Direct calls of one kind on one model: Workspace<S> does the work.
template <template <class> class Workspace>
class Batches {
 public:
  explicit Batches(std::shared_ptr<Multibody> model) : model_(std::move(model)) {}
  const Multibody& model() const { return *model_; }
  const std::shared_ptr<Multibody>& shared_model() const { return model_; }

  // f(workspace, b) for the states from, ..., to - 1 of `states`.
  template <class S, class F>
  void each(int from, int to, int states, F f) {
    std::get<WorkspacePool<Workspace<S>>>(pools_).with(*model_, [&](Workspace<S>& w) {
      for (int b = from; b < to; ++b) {
        naming_state(b, states, [&] { f(w, b); });
        if (b % 16 == 15) check_interrupt();
      }
    });
  }

  // f(workspace, numbers, y) state after state: numbers[i] of given[i] in the scalar S of the precision, y the size numbers of the result,
  // which come to out + b size as doubles.
  template <class F>
  void run(Precision precision, Givens given, int size, double* out, F f) {
    const ModelInUse use(*model_);
    check_given(*model_, given);
    const int batch = common_batch(given), states = batch < 0 ? 1 : batch;
    at_precision(precision, [&]<class S>(S) {
      if constexpr (!available_at<Workspace, S>)
        throw EvaluationError(to_quad);
      else
        run_at<S>(given, states, size, out, f);
    });
  }

 private:
  template <class S, class F>
  void run_at(Givens given, int states, int size, double* out, F& f) {
    constexpr bool as_given = std::is_same_v<S, double>;
    std::vector<std::vector<S>> own(as_given ? 0 : given.size());
    std::array<const S*, 4> numbers{};  // no call is given more
    std::vector<S> result(as_given ? 0 : size);
    each<S>(0, states, states, [&](Workspace<S>& w, int b) {
      double* to = out + size_t(b) * size;
      for (size_t i = 0; i < given.size(); ++i) {
        const double* from = given[i].at(b);
        if constexpr (as_given) {
          numbers[i] = from;
        } else {
          own[i].assign(from, from + given[i].width);
          numbers[i] = own[i].data();
        }
      }
      if constexpr (as_given) {
        f(w, numbers.data(), to);
      } else {
        f(w, numbers.data(), result.data());
        for (int i = 0; i < size; ++i) to[i] = to_double(result[i]);
      }
      require_finite(to, size, *model_);
    });
  }

  template <class S>
  using Pool = WorkspacePool<Workspace<S>>;
  std::shared_ptr<Multibody> model_;
  PerScalar<Pool> pools_;
};

}  // namespace pycraft
