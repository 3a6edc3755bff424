#include "simulation/integrators/integrator.h"

#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

std::vector<Integrator> integrators_by(Way way) {
  std::vector<Integrator> found;
  for (size_t i = 0; i < std::size(integrator_records); ++i)
    if (integrator_records[i].way == way) found.push_back(static_cast<Integrator>(i));
  return found;
}

std::string retired_integrator(const std::string& name) {
  if (name != "fehlberg78") return "";
  return "integrator 'fehlberg78' was removed: its error estimate is blind to forces that are functions of time; take 'dop853', of the same order";
}

Integrator integrator_from_name(const std::string& name) {
  if (const std::string instead = retired_integrator(name); !instead.empty()) throw EvaluationError(instead);
  std::string all;
  for (size_t i = 0; i < std::size(integrator_records); ++i) {
    if (name == integrator_records[i].name) return static_cast<Integrator>(i);
    all += (all.empty() ? "'" : ", '") + std::string(integrator_records[i].name) + "'";
  }
  throw EvaluationError("no integrator is called '" + name + "'; there are " + all);
}

void refuse(Integrator integrator, const std::string& what) { throw EvaluationError(std::string("integrator '") + integrator_name(integrator) + "': " + what); }

void check_integration(const std::vector<double>& times, const IntegratorOptions& o, double eps) {
  if (times.empty()) throw EvaluationError("times: give at least the time of the initial state");
  for (size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i])) throw EvaluationError("times: entry " + std::to_string(i) + " is " + short_number(times[i]));
    if (i > 0 && !((times[i] > times[i - 1]) == (times[1] > times[0]) && times[i] != times[i - 1]))
      throw EvaluationError("times: entry " + std::to_string(i) + " is " + short_number(times[i]) + " s after " + short_number(times[i - 1]) +
                            " s; times are strictly increasing, or strictly decreasing");
  }
  if (!(o.step >= 0) || !std::isfinite(o.step)) throw EvaluationError("step=" + short_number(o.step) + ": a step is a positive number of seconds");
  if (!(o.longest >= 0)) throw EvaluationError("max_step=" + short_number(o.longest) + ": the longest step is a positive number of seconds");
  const std::string name = std::string("integrator '") + integrator_name(o.integrator) + "'";
  if (!record_of(o.integrator).controlled) {
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
