#include "simulation/effects/quadratic_damping.h"

#include <cmath>

namespace pycraft {

namespace {

template <class S>
class BoundQuadraticDamping : public BoundEffect<S> {
 public:
  explicit BoundQuadraticDamping(const QuadraticDamping& of) : coordinates_(of.coordinates), c_(of.coefficient.begin(), of.coefficient.end()) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    using std::abs;
    for (size_t i = 0; i < c_.size(); ++i) {
      const S& v = at.v[coordinates_[i]];
      out.generalized[coordinates_[i]] -= c_[i] * S(abs(v)) * v;
    }
  }
  std::optional<Edge> edge(const At<S>& at) override {
    for (size_t i = 0; i < c_.size(); ++i)
      if (at.v[coordinates_[i]] == S(0) && !(c_[i] == S(0))) return Edge{"is at rest, where |v| v bends", coordinates_[i]};
    return {};
  }

 private:
  std::vector<int> coordinates_;
  std::vector<S> c_;
};

}  // namespace

QuadraticDamping::QuadraticDamping(const Multibody& model, const Names& hinges, const std::vector<double>& given)
    : coordinates(coordinates_named(model, hinges, "quadratic_damping")), coefficient(for_each(given, coordinates.size(), "quadratic_damping: coefficient")) {}

Declaration QuadraticDamping::declaration() const {
  Declaration d;
  d.velocities = d.only_in_motion = d.work = true;
  d.coordinates = coordinates;
  return d;
}

PYCRAFT_BIND_EFFECT(QuadraticDamping, BoundQuadraticDamping)

}  // namespace pycraft
