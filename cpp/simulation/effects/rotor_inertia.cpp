#include "simulation/effects/rotor_inertia.h"

namespace pycraft {

namespace {

template <class S>
struct BoundRotorInertia : BoundEffect<S> {
  explicit BoundRotorInertia(const RotorInertia&) {}
};

}  // namespace

RotorInertia::RotorInertia(const Multibody& model, const Names& hinges, const std::vector<double>& given, const std::vector<double>& ratio)
    : coordinates(coordinates_named(model, hinges, "rotor_inertia")), inertia(not_negative(given, coordinates.size(), "rotor_inertia: inertia")),
      gear_ratio(for_each(ratio, coordinates.size(), "rotor_inertia: gear_ratio")) {}

Declaration RotorInertia::declaration() const {
  Declaration d;
  for (size_t i = 0; i < coordinates.size(); ++i)
    if (inertia[i] != 0) d.hinges.push_back({coordinates[i], gear_ratio[i] * gear_ratio[i] * inertia[i]});
  return d;
}

PYCRAFT_BIND_EFFECT(RotorInertia, BoundRotorInertia)

}  // namespace pycraft
