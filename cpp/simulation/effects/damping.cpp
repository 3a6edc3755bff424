#include "simulation/effects/damping.h"

namespace pycraft {

namespace {

template <class S>
class BoundDamping : public BoundEffect<S> {
 public:
  explicit BoundDamping(const Damping& of) : coordinates_(of.coordinates), c_(of.coefficient.begin(), of.coefficient.end()) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (size_t i = 0; i < c_.size(); ++i) out.generalized[coordinates_[i]] -= c_[i] * at.v[coordinates_[i]];
  }

 private:
  std::vector<int> coordinates_;
  std::vector<S> c_;
};

}  // namespace

Damping::Damping(const Multibody& model, const Names& hinges, const std::vector<double>& given)
    : coordinates(coordinates_named(model, hinges, "damping")), coefficient(for_each(given, coordinates.size(), "damping: coefficient")) {}

Declaration Damping::declaration() const {
  Declaration d;
  d.velocities = d.only_in_motion = d.work = true;
  d.coordinates = coordinates;
  return d;
}

PYCRAFT_BIND_EFFECT(Damping, BoundDamping)

}  // namespace pycraft
