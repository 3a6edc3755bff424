#include "simulation/effects/coulomb_friction.h"

#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundCoulombFriction : public BoundEffect<S> {
 public:
  explicit BoundCoulombFriction(const CoulombFriction& of) : coordinates_(of.coordinates), level_(of.level.begin(), of.level.end()), smoothing_(of.smoothing) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    using std::tanh;
    for (size_t i = 0; i < level_.size(); ++i) {
      const int j = coordinates_[i];
      out.generalized[j] -= level_[i] * S(tanh(S(at.v[j] / smoothing_)));
    }
  }

 private:
  std::vector<int> coordinates_;
  std::vector<S> level_;
  S smoothing_;
};

}  // namespace

CoulombFriction::CoulombFriction(const Multibody& model, const Names& hinges, const std::vector<double>& given, double speed)
    : coordinates(coordinates_named(model, hinges, "coulomb_friction")), level(not_negative(given, coordinates.size(), "coulomb_friction: level")), smoothing(speed) {
  if (!(speed > 0) || !std::isfinite(speed)) throw ModelError("coulomb_friction: smoothing is " + short_number(speed) + "; it is a positive speed");
}

Declaration CoulombFriction::declaration() const {
  Declaration d;
  d.velocities = d.only_in_motion = d.work = true;
  d.coordinates = coordinates;
  return d;
}

PYCRAFT_BIND_EFFECT(CoulombFriction, BoundCoulombFriction)

}  // namespace pycraft
