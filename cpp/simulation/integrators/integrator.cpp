#include "simulation/integrators/integrator.h"

#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr const char* names[] = {"dopri5", "cash-karp54", "fehlberg78", "bulirsch-stoer", "rk4", "rkmk4", "semi-implicit-euler"};

}  // namespace

const char* integrator_name(Integrator integrator) { return names[static_cast<int>(integrator)]; }
bool fixed_step(Integrator integrator) { return integrator >= Integrator::rk4; }

Integrator integrator_from_name(const std::string& name) {
  std::string all;
  for (const Integrator i : scene_integrators) {
    if (name == integrator_name(i)) return i;
    all += (all.empty() ? "'" : ", '") + std::string(integrator_name(i)) + "'";
  }
  throw EvaluationError("no integrator is called '" + name + "'; there are " + all);
}

void check_integration(const std::vector<double>& times, const IntegratorOptions& o, double eps) {
  if (times.empty()) throw EvaluationError("times: give at least the time of the initial state");
  for (size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i])) throw EvaluationError("times: entry " + std::to_string(i) + " is " + short_number(times[i]));
    if (i > 0 && !((times[i] > times[i - 1]) == (times[1] > times[0]) && times[i] != times[i - 1]))
      throw EvaluationError("times: entry " + std::to_string(i) + " is " + short_number(times[i]) + " s after " + short_number(times[i - 1]) +
                            " s; times are strictly increasing, or strictly decreasing");
  }
  if (!(o.step >= 0) || !std::isfinite(o.step)) throw EvaluationError("step=" + short_number(o.step) + ": a step is a positive number of seconds");
  const std::string name = std::string("integrator '") + integrator_name(o.integrator) + "'";
  if (fixed_step(o.integrator)) {
    if (o.step == 0) throw EvaluationError(name + " takes steps of one size: give step= in seconds");
    return;
  }
  if (!(o.rtol >= 0) || !(o.atol > 0))
    throw EvaluationError(name + ": rtol=" + short_number(o.rtol) + ", atol=" + short_number(o.atol) + "; rtol is not negative, atol is positive");
  if (o.rtol < 4 * eps && o.atol < 4 * eps)
    throw EvaluationError(name + ": rtol=" + short_number(o.rtol) + " and atol=" + short_number(o.atol) + " are below what the precision holds (eps = " + short_number(eps) +
                          "); choose a wider precision= or larger tolerances");
}

}  // namespace pycraft
