#include "simulation/effects/gravity.h"

#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
struct BoundGravity : BoundEffect<S> {
  explicit BoundGravity(const Gravity&) {}
};

}  // namespace

Gravity::Gravity(const Vector3<double>& field) : g(field) {
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(g[i])) throw ModelError("gravity: g has an entry that is " + short_number(g[i]));
}

PYCRAFT_BIND_EFFECT(Gravity, BoundGravity)

}  // namespace pycraft
