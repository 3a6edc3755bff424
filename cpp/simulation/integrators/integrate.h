// One run of an integrator: the one code that all trajectories come from. Between the ends of its steps it samples, looks for events, and stops
// where the equations say, as when a controller is sampled.
#pragma once

#include <functional>
#include <vector>

#include "simulation/events.h"
#include "simulation/integrators/stepper.h"

namespace pycraft {

// All that a run goes on from: bit for bit where the method keeps nothing else from step to step (all but bulirsch-stoer, which remembers what
// order was best).
template <class S>
struct Checkpoint {
  S t = S(0);
  std::vector<S> x;
  Pace<S> pace;
  std::vector<int> signs;   // of events
  std::vector<S> lengths;  // of quaternions at first, by methods on the group
};

// What is told of a run while it goes.
template <class S>
class Watcher {
 public:
  using State = std::vector<S>;
  virtual ~Watcher() = default;
  virtual void step(const S&, const State&) {}         // the start, and the end of every step
  virtual void sample(const S&, const State&) {}       // the times asked for, in order
  virtual void event(int, const S&, const State&) {}
  virtual void progress(double) {}                     // some ten times a second
  // Steps of this size seem to be held by stability, at this state, in a run that ends at `last`; or are all of one size, at the start, beyond stops that
  // were met, and now and then. Whether they are held, or unstable: then it is not asked again.
  virtual bool stiff(const S& /* t */, const State& /* x */, const S& /* step */, const S& /* last */) { return false; }
};

template <class S>
struct RunPlan {
  std::vector<double> times;    // from the first to the last, strictly increasing or decreasing
  bool end_at_times = false;    // steps end at all of them; else they are interpolated where that has the method's order
  EventFunctions<S> events;     // those of the equations are added
  const Checkpoint<S>* resumed = nullptr;
};

// How far a run came: kept up where an error or an interrupt ends it.
template <class S>
struct RunEnd {
  IntegrationCost cost;
  Checkpoint<S> checkpoint;
  int event = -1;  // the one that ended it
  std::vector<std::pair<double, int>> switches;  // from when on which of several methods took the steps; of the first, where it is not number 0
};

// Throws EvaluationError that names the time where the state stops being finite or the step size falls to rounding; errors of the accelerations
// come through with the time added. Asks for Ctrl-C every 64 evaluations.
template <class S>
void integrate(Equations<S>& equations, Stepper<S>& stepper, std::vector<S> x, const RunPlan<S>& plan, const IntegratorOptions& options, Watcher<S>& watcher, RunEnd<S>& end);

// By an explicit method, from x at times[0] to the others; a step ends at each. out(t, x) is called at all of them.
template <class S>
IntegrationCost integrate(ExplicitEquations<S>& equations, std::vector<S> x, const std::vector<double>& times, const IntegratorOptions& options,
                          const std::function<void(const S& t, const std::vector<S>& x)>& out);

#define PYCRAFT_INTEGRATE(S) void integrate(Equations<S>&, Stepper<S>&, std::vector<S>, const RunPlan<S>&, const IntegratorOptions&, Watcher<S>&, RunEnd<S>&);
#define PYCRAFT_INTEGRATE_EXPLICITLY(S)                                                                                      \
  IntegrationCost integrate(ExplicitEquations<S>&, std::vector<S>, const std::vector<double>&, const IntegratorOptions&, \
                            const std::function<void(const S&, const std::vector<S>&)>&);
extern template PYCRAFT_INTEGRATE(double)
extern template PYCRAFT_INTEGRATE(Extended)
extern template PYCRAFT_INTEGRATE(Quad)
extern template PYCRAFT_INTEGRATE_EXPLICITLY(double)
extern template PYCRAFT_INTEGRATE_EXPLICITLY(Extended)
extern template PYCRAFT_INTEGRATE_EXPLICITLY(Quad)

}  // namespace pycraft
