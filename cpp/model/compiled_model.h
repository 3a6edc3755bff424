// A model's numbers in flat arrays of one scalar, hinge types resolved once: what kernels read.
#pragma once

#include <cstdint>
#include <vector>

#include "model/hinge.h"
#include "spatial/rigid_inertia.h"

namespace pycraft {

// A subhinge as a kernel wants it.
template <class S>
struct CompiledSubhinge {
  SubhingeKind kind;
  Vector6<S> twist;   // pin, slider, screw
  Vector3<S> axis, point;
  S pitch;
};

template <class S>
struct CompiledModel {
  std::uint64_t parameters = 0;
  int bodies = 0, nq = 0, nv = 0;
  std::vector<int> parent, q_offset, v_offset, nv_of;
  std::vector<int> first_subhinge;            // body k's subhinges are [first_subhinge[k], first_subhinge[k+1])
  std::vector<CompiledSubhinge<S>> subhinges;
  std::vector<Pose<S>> placement;
  std::vector<RigidInertia<S>> inertia;
  std::vector<S> rotor_inertia;               // per coordinate
  bool has_rotor_inertia = false;
  std::vector<int> aligned;                   // per coordinate: i where its row of H is exactly e_i at every q, else -1
  Vector3<S> gravity;
};

}  // namespace pycraft
