// A robot with a hinge of every sort, and numbers to move it with.
#pragma once

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "model/multibody.h"

namespace pycraft::testing {

inline std::shared_ptr<Multibody> robot() {
  auto mb = std::make_shared<Multibody>("robot");
  const HingeKind kinds[] = {HingeKind::free, HingeKind::pin, HingeKind::ball, HingeKind::slider, HingeKind::screw, HingeKind::universal};
  for (int k = 0; k < 6; ++k) {
    Body b;
    b.name = "body" + std::to_string(k);
    b.mass = 1 + k;
    b.com = {0.1, 0.2, 0.05};
    b.inertia = {1, 0.1, 0, 1.2, 0, 0.9};
    b.hinge.kind = kinds[k];
    b.hinge.name = "hinge" + std::to_string(k);
    b.hinge.placement.p = {0.3, 0, 0.1};
    std::vector<Vector3<double>> axes;
    if (kinds[k] == HingeKind::pin || kinds[k] == HingeKind::slider || kinds[k] == HingeKind::screw) axes = {{0.6, 0, 0.8}};
    if (kinds[k] == HingeKind::universal) axes = {{1, 0, 0}, {0, 1, 0}};
    const bool free = kinds[k] == HingeKind::free, screw = kinds[k] == HingeKind::screw;
    b.hinge.subhinges = subhinges_of(kinds[k], axes, free ? Vector3<double>{0, 0, 0} : Vector3<double>{0.1, 0, 0.2}, screw ? 0.3 : 0, b.hinge.name);
    mb->add_body(b, k == 0 ? "" : k == 4 ? "body1" : "body" + std::to_string(k - 1));
  }
  mb->set_gravity({0, 0, -9.81});
  return mb;
}

inline std::vector<double> random_numbers(int n, int seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<double> x(n);
  for (double& value : x) value = uniform(generator);
  return x;
}

}  // namespace pycraft::testing
