// Poses and twists of some bodies of a model, base to tip, along their ways to the base alone; and forces on them as generalized ones.
//
//   X(k) = X(p) X_pk(q),   V(k) = E(p,k)* V(p) + H(k)* θ̇(k);     f(p) += E f(k),   T(k) += H(k) f(k)
//
// Cost O(bodies on those ways).
#pragma once

#include <vector>

#include "model/compiled_model.h"
#include "model/hinge_kinematics.h"

namespace pycraft {

// Bodies that are placed, in their order, and those of them whose twists are found.
struct Reach {
  std::vector<int> placed, moved;
  bool gathered = false;  // whether forces go from them to the base
  // Whether where bodies are is all: neither twists nor forces go along their hinges.
  bool poses_alone() const { return moved.empty() && !gathered; }
};

// All bodies on the ways from these to the base, in their order; -1 among them is the base itself.
inline std::vector<int> ways_to_base(const std::vector<int>& parents, const std::vector<int>& bodies) {
  std::vector<char> there(parents.size());
  for (int k : bodies)
    for (int a = k; a >= 0 && !there[a]; a = parents[a]) there[a] = 1;
  std::vector<int> found;
  for (size_t k = 0; k < parents.size(); ++k)
    if (there[k]) found.push_back(static_cast<int>(k));
  return found;
}

template <class S>
class SceneKinematics {
 public:
  explicit SceneKinematics(const CompiledModel<S>& model) : model_(model) {}

  void make_room() { pose_.resize(model_.bodies), joint_.resize(model_.bodies), rows_.resize(model_.nv), twist_.assign(model_.bodies, Vector6<S>::zero()), force_.resize(model_.bodies); }
  const Pose<S>* poses() const { return pose_.data(); }
  const Vector6<S>* twists() const { return twist_.data(); }

  void place(const std::vector<int>& bodies, const S* q) {
    for (int k : bodies) {
      joint_[k] = hinge_kinematics(model_, k, q, rows_.data() + model_.v_offset[k]);
      const int p = model_.parent[k];
      pose_[k] = p < 0 ? joint_[k] : pose_[p] * joint_[k];
    }
  }
  // The same bits of the poses, and nothing for `move` or `gather`.
  void place_alone(const std::vector<int>& bodies, const S* q) {
    for (int k : bodies) {
      Pose<S> X = model_.placement[k];
      const S* qk = q + model_.q_offset[k];
      for (int i = model_.first_subhinge[k]; i < model_.first_subhinge[k + 1]; ++i) {
        const CompiledSubhinge<S>& h = model_.subhinges[i];
        with_subhinge(h.kind, [&](auto row) { X = X * row.step(h, qk), qk += row.nq; });
      }
      const int p = model_.parent[k];
      pose_[k] = p < 0 ? X : pose_[p] * X;
    }
  }
  // Of bodies that are placed.
  void move(const std::vector<int>& bodies, const S* v) {
    for (int k : bodies) {
      const int p = model_.parent[k];
      Vector6<S> V = p < 0 ? Vector6<S>::zero() : motion_to_child(joint_[k], twist_[p]);
      for (int j = model_.v_offset[k]; j < model_.v_offset[k] + model_.nv_of[k]; ++j) V = V + v[j] * rows_[j];
      twist_[k] = V;
    }
  }
  // T += what forces (n; f) on bodies, in their axes about their origins, are as generalized forces; ways: from them to the base, placed.
  void gather(const std::vector<int>& ways, const std::vector<int>& on, const Vector6<S>* wrench, S* T) {
    for (int k : ways) force_[k] = Vector6<S>::zero();
    for (size_t i = 0; i < on.size(); ++i) force_[on[i]] = force_[on[i]] + wrench[i];
    for (size_t i = ways.size(); i-- > 0;) {
      const int k = ways[i], p = model_.parent[k];
      for (int j = model_.v_offset[k]; j < model_.v_offset[k] + model_.nv_of[k]; ++j) T[j] += dot(rows_[j], force_[k]);
      if (p >= 0) force_[p] = force_[p] + force_to_parent(joint_[k], force_[k]);
    }
  }

 private:
  const CompiledModel<S>& model_;
  std::vector<Pose<S>> pose_, joint_;
  std::vector<Vector6<S>> rows_, twist_, force_;
};

}  // namespace pycraft
