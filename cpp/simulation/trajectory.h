// Trajectories of a model with anybody's accelerations: q̇ = N(q) v (model/configuration.h), v̇ from a callable, under constant generalized forces
// and viscous damping, T = tau - d ∘ v. The integrators are the explicit ones of scenes (simulation/integrators/integrate.h).
#pragma once

#include <functional>
#include <vector>

#include "model/compiled_model.h"
#include "simulation/integrators/integrator.h"

namespace pycraft {

// v̇ from q, v and the generalized forces.
template <class S>
using Accelerations = std::function<void(const S* q, const S* v, const S* tau, S* vdot)>;

using TrajectoryOptions = IntegratorOptions;
using TrajectoryCost = IntegrationCost;

// From q (nq), v (nv) at times[0] to the other times, strictly increasing or strictly decreasing. tau (nv); damping (nv) or null.
// out(i, q, v) is called at every time in order. Throws EvaluationError that names the time where the state stops being finite or the step
// size falls to rounding; errors of the accelerations come through with the time added.
template <class S>
TrajectoryCost integrate_trajectory(const CompiledModel<S>& model, const Accelerations<S>& accelerations, const S* q, const S* v,
                                    const std::vector<double>& times, const S* tau, const S* damping, const TrajectoryOptions& options,
                                    const std::function<void(int, const S*, const S*)>& out);

#define PYCRAFT_TRAJECTORY(S)                                                                                                                    \
  TrajectoryCost integrate_trajectory(const CompiledModel<S>&, const Accelerations<S>&, const S*, const S*, const std::vector<double>&, const S*, \
                                      const S*, const TrajectoryOptions&, const std::function<void(int, const S*, const S*)>&);
extern template PYCRAFT_TRAJECTORY(double)
extern template PYCRAFT_TRAJECTORY(Extended)
extern template PYCRAFT_TRAJECTORY(Quad)

}  // namespace pycraft
