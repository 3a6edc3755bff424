// What integrators integrate: ẋ = f(x, t) on x = (q, v, rest), q on the group of a model's configurations, and what else a motion has between
// its steps. SceneEquations are those of a scene; trajectory.h has those of any accelerations.
#pragma once

#include <limits>
#include <vector>

#include "model/configuration.h"

namespace pycraft {

template <class S>
class Equations {
 public:
  using State = std::vector<S>;
  Equations(const CompiledModel<S>& model, int rest) : model_(model), rest_(rest) {}
  virtual ~Equations() = default;

  const CompiledModel<S>& model() const { return model_; }
  int nq() const { return model_.nq; }
  int nv() const { return model_.nv; }
  int rest() const { return rest_; }  // numbers of x after q and v

  void operator()(const State& x, State& rate, const S& t) {
    const S *q = x.data(), *v = q + nq();
    S* const to = rate.data();
    evaluate(t, q, v, v + nv(), to + nq(), to + nq() + nv());
    configuration_rate(model_, at_q_, at_v_, to);
  }
  // v̇ and the rates of what follows it, by parts: for methods that move q on its group.
  virtual void evaluate(const S& t, const S* q, const S* v, const S* rest, S* vdot, S* rest_rate) = 0;
  // The velocities at which that was done.
  const S* velocities() const { return at_v_; }

  // After a step to t: what is known by other means than the step.
  virtual void settle(const S&, State&) {}
  // Accelerations of implicit steps of size h from now on, 0: plain ones.
  virtual void set_step(const S&) {}
  // Where a step must end after t, infinite: nowhere; and what happens to x there.
  virtual bool stops() const { return false; }
  virtual double next_stop(double) const { return std::numeric_limits<double>::infinity(); }
  virtual void stop(const S&, State&) {}
  // Functions of t and x at whose zeros the equations are others.
  virtual int count_events() const { return 0; }
  virtual void events(const S&, const State&, S*) {}

  long evaluations = 0;

 protected:
  const S *at_q_ = nullptr, *at_v_ = nullptr;  // set by evaluate

 private:
  const CompiledModel<S>& model_;
  int rest_;
};

}  // namespace pycraft
