// Bodies with a mass in a field that depends on where they are: what fields of gravity share.
#pragma once

#include <vector>

#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

struct BodyInField {
  int body;
  double mass;
  Vector3<double> com;            // in the body's axes
  Symmetric3<double> inertia;     // about it
};
// Those of these names that have a mass, each with its numbers.
std::vector<BodyInField> bodies_in_field(const Multibody& model, const Names& bodies, const std::string& effect);

// From the point that attracts to a body's centre of mass, in the body's axes.
template <class S>
inline Vector3<S> seen_from(const Vector3<S>& point, const Pose<S>& pose, const Vector3<S>& com) {
  return transpose_times(pose.R, pose.p - point) + com;
}

}  // namespace pycraft
