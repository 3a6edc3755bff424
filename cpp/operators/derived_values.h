// The numbers of derived operators, from the kinematics of the whole model.
#pragma once

#include <memory>
#include <vector>

#include "numerics/decisions.h"
#include "operators/derived_operators.h"
#include "operators/rigid_trees.h"
#include "recursions/kinematics.h"

namespace pycraft {

// Kinematics of the whole model, from which derived blocks are taken.
template <class S>
class DerivedValues : public TreeValues<RigidBlocks<S>> {
 public:
  DerivedValues(const SkoStructure& own, const SkoStructure& whole, const Multibody& model)
      : TreeValues<RigidBlocks<S>>(own), whole_(whole), all_(whole_), model_(model), q_(model.nq()) {}

 protected:
  void set_state(const double* q, const double*) override {
    compiled_ = model_.compiled<S>();
    for (size_t i = 0; i < q_.size(); ++i) q_[i] = of_state<S>(q[i], 0, static_cast<int>(i));
  }
  void fill() override {
    kinematics(*compiled_, q_.data(), all_);
    derive(all_);
  }
  virtual void derive(const RigidBlocks<S>& all) = 0;

  const SkoStructure whole_;
  RigidBlocks<S> all_;
  const Multibody& model_;
  std::shared_ptr<const CompiledModel<S>> compiled_;
  std::vector<S> q_;
};

template <class S>
class SubsetValues final : public DerivedValues<S> {
 public:
  SubsetValues(const SomeCoordinates& source, const SkoStructure& whole) : DerivedValues<S>(source.structure(), whole, source.model()), kept_(source.kept()) {}

 protected:
  void derive(const RigidBlocks<S>& all) override {
    RigidBlocks<S>& b = this->blocks_;
    b.pose = all.pose;
    b.inertia = all.inertia;
    b.inertia_factors = all.inertia_factors;
    size_t to = 0;
    for (size_t from = 0; from < kept_.size(); ++from) {
      if (!kept_[from]) continue;
      b.H[to] = all.H[from];
      b.J[to] = all.J[from];
      b.aligned[to++] = all.aligned[from];
    }
  }

 private:
  const std::vector<char>& kept_;
};

template <class S>
class CutValues final : public DerivedValues<S> {
 public:
  explicit CutValues(const CutTree& source) : DerivedValues<S>(source.structure(), source.base()->structure(), source.model()) {}

 protected:
  void derive(const RigidBlocks<S>& all) override {
    RigidBlocks<S>& b = this->blocks_;
    b.pose = all.pose;
    b.inertia = all.inertia;
    b.inertia_factors = all.inertia_factors;
    b.H = all.H, b.J = all.J, b.aligned = all.aligned;
  }
};

template <class S>
class WorldValues final : public DerivedValues<S> {
 public:
  explicit WorldValues(const WorldFrame& source) : DerivedValues<S>(source.structure(), source.structure(), source.model()) {}

 protected:
  void derive(const RigidBlocks<S>& all) override {
    RigidBlocks<S>& b = this->blocks_;
    std::vector<Pose<S>> world(this->tree_.bodies());
    factors_.resize(this->tree_.bodies());
    b.inertia_factors = &factors_;
    for (int k = 0; k < this->tree_.bodies(); ++k) {
      const int p = this->tree_.parent[k];
      world[k] = p < 0 ? all.pose[k] : world[p] * all.pose[k];
      b.pose[k] = Pose<S>::identity();
      b.inertia[k] = to_parent(world[k], all.inertia[k]);
      factors_[k] = to_parent(world[k], (*all.inertia_factors)[k]);
      for (int j = this->tree_.dof_offset[k]; j < this->tree_.dof_offset[k + 1]; ++j) {
        b.H[j] = motion_to_child(inverse(world[k]), all.H[j]);  // a row of HX⁻¹ is X⁻* h
        b.J[j] = all.J[j];
      }
    }
  }

 private:
  std::vector<InertiaFactors<S>> factors_;
};

}  // namespace pycraft
