// A part of a model: a connected set of its bodies with coordinates of its own, the rest ignored. It is a model like any other
// (Multibody::part_of), whose parameters follow the whole's and whose state is the whole's.
//
// The part's base is the frame of the body that carries it: the body outside on which its root hangs. A fixed base is the world's frame. A moving
// one is a body of its own, massless and on a free hinge, first in the part: its coordinates are the carrier's pose, velocity and acceleration.
// Bodies that hang on the base of the whole hang together by it, as those of a whole model do.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace pycraft {

class Multibody;
struct StateData;

struct PartOf {
  std::shared_ptr<Multibody> whole;
  std::vector<int> bodies;       // numbers in the whole, ascending
  bool moving_base = false;
  int carrier = -1;              // number in the whole; -1: the base
  std::vector<std::pair<int, int>> q_runs, v_runs;  // where the coordinates stand in the whole's: first, how many
  // The number in the part of a body of the whole; -1: it is not in it.
  int number(int body_of_whole) const;
  // Whether a body of the whole is in it; of the whole's base (-1), whether the part has that, too: not where the carrier is its base.
  bool has(int body_of_whole) const;
};

// A body and all outboard of it, without these and all outboard of them; root -1: all bodies. ModelError where nothing is left, or where a
// body to be left out is none of them.
std::vector<int> outboard_of(const Multibody& model, int root, const std::vector<int>& without);
// The bodies between a and b, these and the closest common ancestor included, in the model's order; -1 is the base, which is no body.
std::vector<int> path_between(const Multibody& model, int a, int b);

// Pose of a body (4 quaternion, 3 position) and its velocity (6, in its axes, angular first) at a state, as coordinates of a free hinge. O(depth).
void motion_of_body(const Multibody& model, int body, const StateData& at, double* pose, double* velocity);

}  // namespace pycraft
