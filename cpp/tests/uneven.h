// Models over many orders of magnitude.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "tests/robot.h"

namespace pycraft::testing {

// Bodies of masses and sizes over twenty orders, or by `much` as many, with hinges of every sort.
inline std::shared_ptr<Multibody> uneven(int seed, double much = 1) {
  auto mb = std::make_shared<Multibody>("uneven");
  const HingeKind kinds[] = {HingeKind::pin, HingeKind::slider, HingeKind::ball, HingeKind::screw, HingeKind::free, HingeKind::universal};
  const std::vector<double> x = random_numbers(1000, seed);
  size_t at = 0;
  for (int k = 0; k < 6; ++k) {
    Body b;
    b.name = "body" + std::to_string(k);
    b.mass = std::pow(10, 5 * much * x[at++]);
    const double size = std::pow(10, much * (2.5 * x[at++] - 2));
    b.com = {x[at] * size, x[at + 1] * size, x[at + 2] * size}, at += 3;
    const double about = b.mass * std::pow(10, much * (8 * x[at++] - 8));
    b.inertia = {about, 0, 0, 1.2 * about, 0, 0.9 * about};
    b.hinge.kind = kinds[static_cast<int>(3 + 3 * x[at++]) % 6];
    b.hinge.name = "hinge" + std::to_string(k);
    b.hinge.placement.p = {x[at], x[at + 1], x[at + 2]}, at += 3;
    std::vector<Vector3<double>> axes;
    const bool oblique = x[at++] > 0;
    if (b.hinge.kind == HingeKind::universal)
      axes = {{1, 0, 0}, {0, 1, 0}};
    else if (b.hinge.kind != HingeKind::ball && b.hinge.kind != HingeKind::free)
      axes = {oblique ? Vector3<double>{0.6, 0, 0.8} : Vector3<double>{0, 1, 0}};
    b.hinge.subhinges = subhinges_of(b.hinge.kind, axes, {0, 0, 0}, b.hinge.kind == HingeKind::screw ? 0.3 : 0, b.hinge.name);
    const int parent = k - 1 - (x[at++] > 0.5 && k > 1);
    mb->add_body(b, k == 0 ? "" : "body" + std::to_string(parent));
  }
  mb->set_gravity({0, 0, -9.81});
  return mb;
}

}  // namespace pycraft::testing
