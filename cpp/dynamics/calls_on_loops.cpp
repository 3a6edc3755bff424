#include "dynamics/calls_on_loops.h"

#include <cmath>

#include "model/checks.h"

namespace pycraft {

namespace {

template <class S>
void solve(ConstrainedWorkspace<S>& w, const std::shared_ptr<const ResolvedLoops>& loops, const AskedOnLoops& how, typename ConstrainedWorkspace<S>::Asked asked) {
  if (how.velocities) return w.project(loops, asked.q, asked.v, asked.tau, how.form);
  const std::vector<Baumgarte> gains(loops->rows, {how.alpha, how.beta});
  if (how.alpha != 0 || how.beta != 0) asked.gains = &gains;
  w.accelerate(loops, asked);
}

template <class S>
void solve(EmbeddedWorkspace<S>& w, const std::shared_ptr<const ResolvedLoops>& loops, const AskedOnLoops& how, const typename ConstrainedWorkspace<S>::Asked& asked) {
  w.choose(loops, asked.q, how.independent);  // of this state alone, whatever the workspace was at before
  w.accelerate(loops, asked);
}

}  // namespace

template <template <class> class Workspace>
void CallsOnLoops<Workspace>::run(const AskedOnLoops& asked, const ResultsOnLoops& out) {
  const Multibody& model = this->model();
  const ModelInUse use(model);
  check_given(model, {asked.q, asked.v, asked.input});
  check_wrenches(asked.pushed, asked.wrenches);
  if (!std::isfinite(asked.alpha) || !std::isfinite(asked.beta) || asked.alpha < 0 || asked.beta < 0)
    throw ModelError("Baumgarte's alpha and beta are finite numbers, zero or more (1/s), not " + short_number(asked.alpha) + " and " + short_number(asked.beta));
  const auto loops = loops_->resolved();
  const int common = common_batch({asked.q, asked.v, asked.input, asked.wrenches}), states = common < 0 ? 1 : common;
  const int nv = model.nv(), rows = loops->rows, count = static_cast<int>(loops->loops.size());
  at_precision(asked.precision, [&]<class S>(S) {
    if constexpr (!available_at<Workspace, S>) {
      throw EvaluationError(to_quad);
    } else {
      std::vector<S> q, v, input, wrenches;
      this->template each<S>(0, states, states, [&](Workspace<S>& w, int b) {
        const auto read = [b](const Given& given, std::vector<S>& to) { to.assign(given.at(b), given.at(b) + given.width); };
        read(asked.q, q), read(asked.v, v), read(asked.input, input), read(asked.wrenches, wrenches);
        solve(w, loops, asked, {q.data(), v.data(), input.data(), wrenches.empty() ? nullptr : wrenches.data(), asked.pushed, nullptr, asked.form, asked.refinement});
        for (int i = 0; i < nv; ++i) out.x[size_t(b) * nv + i] = to_double(w.result()[i]);
        for (int r = 0; r < rows; ++r) out.multipliers[size_t(b) * rows + r] = to_double(w.multipliers()[r]);
        for (int l = 0; l < count; ++l)
          for (int side = 0; side < 2; ++side) write(w.force(l, side == 1), out.forces + ((size_t(b) * count + l) * 2 + side) * 6);
        out.rank[b] = w.rank();
        require_finite(out.x + size_t(b) * nv, nv, model);
        require_finite(out.multipliers + size_t(b) * rows, rows, model);
      });
    }
  });
}

template class CallsOnLoops<ConstrainedWorkspace>;
template class CallsOnLoops<EmbeddedWorkspace>;

}  // namespace pycraft
