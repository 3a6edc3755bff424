#include "simulation/trajectory.h"

#include "runtime/interrupt.h"
#include "simulation/integrators/integrate.h"

namespace pycraft {

namespace {

template <class S>
class EquationsOfMotion : public ExplicitEquations<S> {
 public:
  EquationsOfMotion(const CompiledModel<S>& model, const Accelerations<S>& accelerations, const S* tau, const S* damping)
      : ExplicitEquations<S>(model, 0), accelerations_(accelerations), tau_(tau), damping_(damping), force_(tau, tau + model.nv) {}

  void evaluate(const S&, const S* q, const S* v, const S*, S* vdot, S*) override {
    if ((++this->evaluations & 63) == 0) check_interrupt();
    this->at_q_ = q, this->at_v_ = v;
    for (size_t i = 0; damping_ && i < force_.size(); ++i) force_[i] = tau_[i] - damping_[i] * v[i];
    accelerations_(q, v, force_.data(), vdot);
  }

 private:
  const Accelerations<S>& accelerations_;
  const S *tau_, *damping_;
  std::vector<S> force_;
};

}  // namespace

template <class S>
TrajectoryCost integrate_trajectory(const CompiledModel<S>& model, const Accelerations<S>& accelerations, const S* q, const S* v,
                                    const std::vector<double>& times, const S* tau, const S* damping, const TrajectoryOptions& options,
                                    const std::function<void(int, const S*, const S*)>& out) {
  std::vector<S> x(q, q + model.nq);
  x.insert(x.end(), v, v + model.nv);
  EquationsOfMotion<S> equations(model, accelerations, tau, damping);
  int i = 0;
  return integrate<S>(equations, std::move(x), times, options, [&](const S&, const std::vector<S>& at) { out(i++, at.data(), at.data() + model.nq); });
}

template PYCRAFT_TRAJECTORY(double)
template PYCRAFT_TRAJECTORY(Extended)
template PYCRAFT_TRAJECTORY(Quad)

}  // namespace pycraft
