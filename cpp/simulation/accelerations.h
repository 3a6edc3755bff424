// Forward dynamics as trajectories ask for it, one state after another: by kernels in double precision, where they are sure;
// else by the general recursions.
#pragma once

#include <memory>

#include "dynamics/link_dynamics.h"
#include "dynamics/rigid_dynamics.h"
#include "simulation/trajectory.h"

namespace pycraft {

template <class S>
Accelerations<S> accelerations_of(const Multibody& model, const Solving& how) {
  const auto general = std::make_shared<RigidDynamics<S>>(model);
  if constexpr (std::is_same_v<S, double>) {
    const auto links = std::make_shared<LinkDynamics<double>>(model);
    const kernels::Call call = forward_dynamics_call(how.form);
    if (links->there(call) && how.refinement.steps == 0)
      return [general, links, how, call, nq = model.nq(), nv = model.nv()](const double* q, const double* v, const double* tau, double* vdot) {
        const Given configuration{"q", q, nq}, velocity{"v", v, nv}, force{"tau", tau, nv};
        links->run({call, configuration, &velocity, &force}, 1, nv, vdot, [&](int, int) { general->forward_dynamics(q, v, tau, vdot, how); });
      };
  }
  return [general, how](const S* q, const S* v, const S* tau, S* vdot) { general->forward_dynamics(q, v, tau, vdot, how); };
}

}  // namespace pycraft
