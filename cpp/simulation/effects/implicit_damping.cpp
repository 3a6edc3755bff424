#include "simulation/effects/implicit_damping.h"

namespace pycraft {

namespace {

template <class S>
class BoundImplicitDamping : public BoundEffect<S> {
 public:
  explicit BoundImplicitDamping(const ImplicitDamping& of) : coordinates_(of.coordinates), c_(of.coefficient.begin(), of.coefficient.end()) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (size_t i = 0; i < c_.size(); ++i) out.generalized[coordinates_[i]] -= c_[i] * at.v[coordinates_[i]];
  }

 private:
  std::vector<int> coordinates_;
  std::vector<S> c_;
};

}  // namespace

ImplicitDamping::ImplicitDamping(const Multibody& model, const Names& hinges, const std::vector<double>& given)
    : coordinates(coordinates_named(model, hinges, "implicit_damping")), coefficient(not_negative(given, coordinates.size(), "implicit_damping: coefficient")) {}

Declaration ImplicitDamping::declaration() const {
  Declaration d;
  d.velocities = d.only_in_motion = d.work = true;
  d.coordinates = coordinates;
  for (size_t i = 0; i < coordinates.size(); ++i)
    if (coefficient[i] != 0) d.hinges.push_back({coordinates[i], 0, coefficient[i], 0});
  return d;
}

PYCRAFT_BIND_EFFECT(ImplicitDamping, BoundImplicitDamping)

}  // namespace pycraft
