#include "simulation/effects/implicit_spring.h"

namespace pycraft {

namespace {

template <class S>
class BoundImplicitSpring : public BoundEffect<S> {
 public:
  explicit BoundImplicitSpring(const ImplicitSpring& of) : coordinates_(of.coordinates), k_(of.stiffness.begin(), of.stiffness.end()), rest_(of.rest.begin(), of.rest.end()) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (size_t i = 0; i < k_.size(); ++i) {
      const auto [q, v] = coordinates_[i];
      out.generalized[v] -= k_[i] * (at.q[q] + at.step * at.v[v] - rest_[i]);
    }
  }
  S potential(const At<S>& at) override {
    S sum = S(0);
    for (size_t i = 0; i < k_.size(); ++i) {
      const S off = at.q[coordinates_[i].q] - rest_[i];
      sum += k_[i] * off * off / S(2);
    }
    return sum;
  }

 private:
  std::vector<SingleCoordinate> coordinates_;
  std::vector<S> k_, rest_;
};

}  // namespace

ImplicitSpring::ImplicitSpring(const Multibody& model, const Names& hinges, const std::vector<double>& k, const std::vector<double>& at)
    : coordinates(single_coordinates(model, hinges, "implicit_spring")), stiffness(not_negative(k, coordinates.size(), "implicit_spring: stiffness")),
      rest(for_each(at, coordinates.size(), "implicit_spring: rest")) {}

Declaration ImplicitSpring::declaration() const {
  Declaration d;
  d.potential = true;
  for (size_t i = 0; i < coordinates.size(); ++i) {
    d.coordinates.push_back(coordinates[i].v);
    if (stiffness[i] != 0) d.hinges.push_back({coordinates[i].v, 0, 0, stiffness[i]});
  }
  return d;
}

PYCRAFT_BIND_EFFECT(ImplicitSpring, BoundImplicitSpring)

}  // namespace pycraft
