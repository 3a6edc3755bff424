// Dynamics of one state from each of several runs at once. Each run is in a fiber (runtime/fiber.h) and waits with what it asks; when all of them
// wait, what fits together goes through the kernels side by side, in packs of as many states as a register holds, with the bits that each would
// have by itself. What differs from lane to lane: the state, forces and wrenches, gravity. What must not: the model, and terms at its hinges.
#pragma once

#include <exception>
#include <memory>
#include <new>
#include <vector>

#include "dynamics/hybrid_dynamics.h"

namespace pycraft {

// States that follow from each other, as in the stages of a step: a run that gives them all at once is left and resumed once for all.
class StatesInTurn {
 public:
  virtual ~StatesInTurn() = default;
  virtual PreparedLinks* ask() = 0;        // what was asked (PreparedLinks::ask) of the next state; null: that was the last
  virtual void answer(bool sound) = 0;     // as PreparedLinks::answer says
};

class StatesTogether {
 public:
  // In a fiber: waits for answer(), then as links.run.
  bool run(PreparedLinks& links, const double* q, const double* v, const double* u, const Vector6<double>* wrenches, double* out);
  // The same of several, one after the other. What they throw comes through.
  void run(StatesInTurn& states);
  // Outside of fibers: what all of them wait for.
  void answer();

  static int width() { return kernels::instruction_set().pack.lanes; }

 private:
  struct Asked {
    PreparedLinks* links;
    bool sound = false;
  };
  struct Turns {
    StatesInTurn* states;
    Asked asked{nullptr};
    std::exception_ptr error;
  };
  void answer_waiting();
  void answer_pack();
  double* work(size_t numbers);
  struct Free {
    void operator()(double* x) const { ::operator delete(x, std::align_val_t(64)); }
  };
  std::vector<Asked*> waiting_, pack_, left_;
  std::vector<Turns*> turns_;
  std::vector<double> q_, v_, u_, wrenches_, gravity_, out_;
  std::unique_ptr<double, Free> work_;
  size_t size_ = 0;
};

}  // namespace pycraft
