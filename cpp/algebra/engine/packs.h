// Batches in packs: when a plan is recorded (taped_plan.h), and the programs that are kept.
//
// Recording a plan takes as long as some dozens of its states. It is recorded once what was, or will be, spent on states one after the other
// comes to that, as a program gives the same bits; a plan that decides something once for all states, so that bits may differ, where the batch
// alone is long enough, whatever was evaluated before.
#pragma once

#include <memory>
#include <vector>

#include "algebra/engine/taped_plan.h"
#include "lanes/replayed.h"
#include "runtime/mutex.h"

namespace pycraft {

// Programs of plans that differ by the states that they are bound to alone.
class Packs {
 public:
  // What a batch is to do: with a program, or first so many states by themselves, then to ask again.
  struct Way {
    std::shared_ptr<const TapedPlan> taped;
    int tried = 0;
  };
  Way way(const std::shared_ptr<const Plan>& plan, const Inputs& inputs, int states);
  // After `tried` states have taken so many seconds.
  Way way_after(const std::shared_ptr<const Plan>& plan, const Inputs& inputs, int states, int tried, double seconds);

  // States from, ..., states - 1 of a batch, in so many threads, to `out`. Those whose results mean nothing are to be run by themselves.
  std::vector<int> run(const TapedPlan& taped, const Plan& plan, const Inputs& inputs, int from, int states, int threads, double* out);

  // That this thread has computed: what else runs on the machine decides nothing.
  static double seconds_of_thread();

  // From how many states on a batch is recorded, whatever it would take, and how it was before; 0: as is best.
  static int record_from(int states);

 private:
  // What programs are made for: the models' numbers, and states that are none of the batch's.
  struct Version {
    std::uint64_t parameters;
    std::shared_ptr<const StateData> state;
    bool operator==(const Version&) const = default;
  };
  struct Kept {
    std::vector<Version> versions;
    int columns;
    bool with_x, tried = false;
    double spent = 0;          // seconds on states one after the other
    double alone = 0;          // seconds that one takes; 0: not known
    int slower = 0;            // batches in packs, one after the other, that took longer
    std::shared_ptr<const TapedPlan> taped;
  };
  static constexpr size_t most_kept = 4;
  Kept& kept(const Plan& plan, const Inputs& inputs);
  Way recorded(const std::shared_ptr<const Plan>& plan, const Inputs& inputs, size_t most);
  void compare(const TapedPlan& taped, const Plan& plan, const Inputs& inputs, double seconds_a_state);

  Mutex mutex_;
  std::vector<Kept> all_;  // the last used first
  kernels::Rooms rooms_;
};

}  // namespace pycraft
