#include "dynamics/impulsive_locking.h"

#include "dynamics/hybrid_dynamics.h"
#include "runtime/errors.h"

namespace pycraft {

std::pair<std::vector<double>, std::vector<double>> stop_at_once(const Multibody& model, const std::vector<double>& q, const std::vector<double>& v,
                                                                 const std::vector<char>& stops) {
  const int n = model.nv();
  std::vector<double> given(n, 0.0), found(n), after = v, impulses(n, 0.0);
  for (int j = 0; j < n; ++j)
    if (stops[j]) given[j] = -v[j];
  HingeTerms terms;
  terms.prescribed = stops;
  HybridDynamics<double> dynamics(model, terms, Solving{}, Vector3<double>{0, 0, 0});
  if (!dynamics.run(q.data(), nullptr, given.data(), nullptr, found.data()))
    throw EvaluationError("'" + model.name() + "': velocities after the locking are beyond the range of doubles");
  for (int j = 0; j < n; ++j) {
    after[j] = stops[j] ? 0.0 : v[j] + found[j];
    if (stops[j]) impulses[j] = found[j];
  }
  return {after, impulses};
}

}  // namespace pycraft
