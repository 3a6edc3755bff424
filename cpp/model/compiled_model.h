// A model's numbers in flat arrays of one scalar, hinge types resolved once: what kernels read.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "model/hinge.h"
#include "model/hinge_terms.h"
#include "model/inertia_factors.h"
#include "spatial/rigid_inertia.h"

namespace pycraft {

template <class S>
struct CompiledModel {
  std::uint64_t parameters = 0;
  int bodies = 0, nq = 0, nv = 0;
  std::vector<int> parent, q_offset, v_offset, nv_of;
  std::vector<int> first_subhinge;            // body k's subhinges are [first_subhinge[k], first_subhinge[k+1])
  std::vector<CompiledSubhinge<S>> subhinges;
  std::vector<Pose<S>> placement;
  std::vector<RigidInertia<S>> inertia;
  std::vector<InertiaFactors<S>> inertia_factors;
  std::vector<MassProperties> mass_properties;
  std::vector<S> rotor_inertia;               // per coordinate
  bool has_rotor_inertia = false;
  std::vector<std::array<int, 3>> translations;  // per body: coordinates that move it along any line, free and without rotor inertia; -1: none
  std::vector<int> aligned;                   // per coordinate: i where its row of H is exactly e_i at every q, else -1
  Vector3<S> gravity;
};

class Multibody;

// Unit axes and orthogonal rotations are so to the rounding of S, not of the doubles they were given in. rotor_inertia has the terms' own.
template <class S>
std::shared_ptr<const CompiledModel<S>> compile_model(const Multibody& model, const HingeTerms& terms = {});

template <class S, class T>
inline InertiaFactors<S> cast(const InertiaFactors<T>& f) {
  InertiaFactors<S> g;
  for (int i = 0; i < 6; ++i) g.column[i] = cast<S>(f.column[i]), g.weight[i] = S(f.weight[i]);
  g.com = cast<S>(f.com);
  g.uncertain = S(f.uncertain);
  std::copy_n(f.pivot, 3, g.pivot);
  return g;
}

// The same model, every number in all lanes of a pack.
template <class S, class T>
CompiledModel<S> broadcast(const CompiledModel<T>& from) {
  CompiledModel<S> to;
  to.parameters = from.parameters, to.bodies = from.bodies, to.nq = from.nq, to.nv = from.nv;
  to.parent = from.parent, to.q_offset = from.q_offset, to.v_offset = from.v_offset, to.nv_of = from.nv_of;
  to.first_subhinge = from.first_subhinge, to.aligned = from.aligned, to.translations = from.translations, to.has_rotor_inertia = from.has_rotor_inertia;
  for (const auto& h : from.subhinges) to.subhinges.push_back({h.kind, cast<S>(h.twist), cast<S>(h.axis), cast<S>(h.point), S(h.pitch)});
  for (const auto& X : from.placement) to.placement.push_back(cast<S>(X));
  for (const auto& M : from.inertia) to.inertia.push_back(cast<S>(M));
  for (const auto& f : from.inertia_factors) to.inertia_factors.push_back(cast<S>(f));
  to.rotor_inertia.assign(from.rotor_inertia.begin(), from.rotor_inertia.end());
  to.gravity = cast<S>(from.gravity);
  return to;
}

}  // namespace pycraft
