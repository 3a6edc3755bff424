#include "simulation/effects/loop.h"

#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"
#include "simulation/taken_loops.h"

namespace pycraft {

namespace {

// What it does is done by the accelerations.
template <class S>
class BoundLoops : public BoundEffect<S> {
 public:
  explicit BoundLoops(const KeepLoops&) {}
};

}  // namespace

KeepLoops::KeepLoops(std::shared_ptr<const LoopSet> set, std::vector<std::string> names, double alpha, double beta, bool embedded) {
  check_names(*set, names);
  if (!std::isfinite(alpha) || !std::isfinite(beta) || alpha < 0 || beta < 0)
    throw ModelError("loop: Baumgarte's alpha and beta are finite numbers, zero or more (1/s), not " + short_number(alpha) + " and " + short_number(beta));
  if (embedded && (alpha != 0 || beta != 0)) throw ModelError("loop: Baumgarte's alpha and beta draw states to loops that are kept by method 'augment'; embedded ones are not left");
  kept_ = std::make_shared<KeptLoops>(KeptLoops{std::move(set), std::move(names), alpha, beta, embedded});
}

Declaration KeepLoops::declaration() const {
  Declaration d;
  d.velocities = true;
  d.loops = kept_;
  return d;
}

PYCRAFT_BIND_EFFECT(KeepLoops, BoundLoops)

}  // namespace pycraft
