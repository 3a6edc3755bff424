// One run of an integrator: the one code that all trajectories come from. A step ends at every time asked for, and where the equations stop, as
// when a controller is sampled; nothing is interpolated.
#pragma once

#include <functional>
#include <vector>

#include "simulation/integrators/integrator.h"
#include "simulation/equations.h"

namespace pycraft {

// From x at times[0] to the other times, strictly increasing or strictly decreasing. out(t, x) is called at every time
// in order, or after every step. Throws EvaluationError that names the time where the state stops being finite or the step size falls to rounding;
// errors of the accelerations come through with the time added. Asks for Ctrl-C every 64 evaluations.
template <class S>
IntegrationCost integrate(Equations<S>& equations, std::vector<S> x, const std::vector<double>& times, const IntegratorOptions& options,
                          const std::function<void(const S& t, const std::vector<S>& x)>& out);

#define PYCRAFT_INTEGRATE(S)                                                                                                      \
  IntegrationCost integrate(Equations<S>&, std::vector<S>, const std::vector<double>&, const IntegratorOptions&, \
                            const std::function<void(const S&, const std::vector<S>&)>&);
extern template PYCRAFT_INTEGRATE(double)
extern template PYCRAFT_INTEGRATE(Extended)
extern template PYCRAFT_INTEGRATE(Quad)

}  // namespace pycraft
