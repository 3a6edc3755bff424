// Coordinates whose motion is prescribed taken out of the equations of motion (hybrid dynamics). With H_f the rows of H that are free and H_p
// the others, and accelerations θ̈_p given,
//
//   α = φ*(H_f* θ̈_f + a'),  a' = a + H_p* θ̈_p,     T_f = H_f f,     T_p = H_p f + J_p θ̈_p + c_p
//
// so that every sweep runs unchanged on the tree whose hinges have the free coordinates alone, with a' in place of a: E_ψ, D, G, K and ψ are
// those of H_f. A hinge all of whose coordinates are prescribed has no row left and is passed as a weld that moves: P⁺ = P.
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapter on hybrid (prescribed motion) dynamics.
#pragma once

#include <memory>
#include <vector>

#include "algebra/language/structure.h"
#include "model/compiled_model.h"
#include "recursions/kinematics.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

// The tree whose hinges have the coordinates alone that are not prescribed, with their names.
inline SkoStructure free_tree(SkoStructure tree, const HingeTerms& terms) {
  if (!terms.prescribes()) return tree;
  std::vector<std::string> names;
  for (int k = 0; k < tree.bodies(); ++k) {
    int left = 0;
    for (int j = tree.dof_offset[k]; j < tree.dof_offset[k + 1]; ++j)
      if (!terms.is_prescribed(j)) names.push_back(tree.coordinate_names[j]), ++left;
    tree.dof[k] = left;
  }
  tree.coordinate_names = std::move(names);
  tree.finish();
  return tree;
}

template <class S>
class PrescribedHinges {
 public:
  PrescribedHinges(std::shared_ptr<const CompiledModel<S>> whole, const HingeTerms& terms) : whole_(std::move(whole)) {
    auto left = std::make_shared<CompiledModel<S>>(*whole_);
    left->v_offset.clear(), left->nv_of.clear(), left->rotor_inertia.clear(), left->aligned.clear();
    for (int k = 0; k < whole_->bodies; ++k) {
      left->v_offset.push_back(static_cast<int>(free_.size()));
      for (int j = whole_->v_offset[k]; j < whole_->v_offset[k] + whole_->nv_of[k]; ++j) {
        if (terms.is_prescribed(j)) {
          prescribed_.push_back({j, k});
          continue;
        }
        free_.push_back(j);
        left->rotor_inertia.push_back(whole_->rotor_inertia[j]);
        left->aligned.push_back(whole_->aligned[j]);
      }
      left->nv_of.push_back(static_cast<int>(free_.size()) - left->v_offset.back());
    }
    left->nv = static_cast<int>(free_.size());
    left_ = left;
    rows_.resize(whole_->nv);
    rates_.assign(whole_->nv, S(0));
  }

  // The model as the equations of the free coordinates have it. Its translations are numbered as all coordinates.
  const std::shared_ptr<const CompiledModel<S>>& left() const { return left_; }
  int coordinates() const { return whole_->nv; }

  // θ̈ of the prescribed coordinates, from numbers of all.
  template <class T>
  void prescribe(const T* accelerations) {
    for (const auto& [j, _] : prescribed_) rates_[j] = S(accelerations[j]);
  }
  // Of another scalar's.
  template <class T>
  void prescribe_as(const PrescribedHinges<T>& other) {
    for (const auto& [j, _] : prescribed_) rates_[j] = S(other.rate(j));
  }
  const S& rate(int j) const { return rates_[j]; }

  // Where bodies are and how they move, v of all coordinates: H_f to the blocks, a' to the points, x of the free coordinates.
  void set_state(const S* q, const S* v, OwnTerms own, RigidBlocks<S>& blocks, PointAccelerations<S>& points) {
    for (int k = 0; k < whole_->bodies; ++k) blocks.pose[k] = hinge_kinematics(*whole_, k, q, rows_.data() + whole_->v_offset[k]);
    for (size_t i = 0; i < free_.size(); ++i) blocks.H[i] = rows_[free_[i]];
    set_constants(*left_, blocks);
    point_accelerations_base_to_tip(*whole_, blocks.pose.data(), rows_.data(), v, own, points);
    for (const auto& [j, k] : prescribed_) points.a[k] = points.a[k] + rates_[j] * rows_[j];
    keep_free(points.absorbed);
    rotors_ = points.rotors;
    if (!rotors_.empty()) keep_free(points.rotors);
  }
  // Numbers of all coordinates: of the free ones, in place.
  void keep_free(std::vector<S>& of_all) const {
    for (size_t i = 0; i < free_.size(); ++i) of_all[i] = of_all[free_[i]];
  }
  template <class T>
  void take_free(const T* of_all, std::vector<T>& out) const {
    out.resize(free_.size());
    for (size_t i = 0; i < free_.size(); ++i) out[i] = of_all[free_[i]];
  }
  // θ̈_f and T_p by coordinate, f the forces of the hinges on their bodies.
  void give(const S* accelerations, const std::vector<Vector6<S>>& f, S* out) const {
    for (size_t i = 0; i < free_.size(); ++i) out[free_[i]] = accelerations[i];
    for (const auto& [j, k] : prescribed_) out[j] = dot(rows_[j], f[k]) + whole_->rotor_inertia[j] * rates_[j] + (rotors_.empty() ? S(0) : rotors_[j]);
  }

 private:
  struct OnBody {
    int coordinate, body;
  };
  std::shared_ptr<const CompiledModel<S>> whole_, left_;
  std::vector<int> free_;
  std::vector<OnBody> prescribed_;
  std::vector<Vector6<S>> rows_;  // of all coordinates
  std::vector<S> rates_, rotors_;  // rotors: c of all coordinates
};

}  // namespace pycraft
