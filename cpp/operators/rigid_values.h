// The numbers of a multibody model's operators at one state: E, H, M, J from the hinges' kinematics, velocities when asked for.
#pragma once

#include <memory>

#include "numerics/decisions.h"
#include "operators/many_columns.h"
#include "operators/multibody_operators.h"
#include "operators/rigid_trees.h"
#include "recursions/kinematics.h"
#include "recursions/velocities.h"

namespace pycraft {

template <class S>
class RigidValues final : public TreeValues<RigidBlocks<S>> {
 public:
  explicit RigidValues(const MultibodyOperators& source)
      : TreeValues<RigidBlocks<S>>(source.structure()), source_(source), model_(*source.model()), q_(model_.nq()), v_(model_.nv()), columns_(source.structure()) {}

  void block(const Symbol& symbol, int k, S* out) const override;
  void vector(const Symbol& symbol, S* out) const override;
  void function_block(const Symbol& function, int k, const S* x, S* out) const override;
  bool gathers_wider() const override { return true; }
  void gathered_residual(const S* x, const S* b, S* r, int m, S* scratch, std::vector<Wider<S>>& forces) const override {
    mass_matrix_residual_gathered(this->tree_, this->blocks_, compiled_->mass_properties, x, b, r, m, scratch, forces);
  }

  void mass_matrix(bool with_hinge_diagonal, const S* x, S* y, int m, S* scratch) const override {
    if constexpr (by_columns<S>)
      columns_.mass_matrix(this->blocks_, with_hinge_diagonal, x, y, m, scratch);
    else
      mass_matrix_apply(this->tree_, this->blocks_, with_hinge_diagonal, x, y, m, scratch);
  }
  void mass_matrix_inverse(const S* x, S* y, int m, S* scratch) const override {
    if constexpr (by_columns<S>)
      columns_.mass_matrix_inverse(this->blocks_, x, y, m, scratch);
    else
      mass_matrix_inverse_apply(this->tree_, this->blocks_, x, y, m, scratch);
  }

  // By links, unless they left a pivot in doubt.
  void inverse_by_itself(const S* x, S* y, int m, S* scratch) const override {
    if constexpr (by_columns<S>)
      if (links_.there()) return links_.apply(x, y, m, scratch);
    mass_matrix_inverse(x, y, m, scratch);
  }
  bool inverts_by_links() const {
    if constexpr (by_columns<S>) return links_.there();
    return false;
  }

  std::unique_ptr<InverseTangent<S>> inverse_tangent() const override;

  const MultibodyOperators& source() const { return source_; }
  const std::shared_ptr<const CompiledModel<S>>& compiled_model() const { return compiled_; }
  const CompiledModel<S>& compiled() const { return *compiled_; }
  const std::vector<S>& q() const { return q_; }
  const std::vector<S>& v() const { return v_; }
  const Velocities<S>& velocities() const { return velocities_; }
  // The twist of a place in the axes of its body, and the body.
  Vector6<S> twist(const TwistPlace& place, int& body) const;

 protected:
  void set_state(const double* q, const double* v) override {
    const std::shared_ptr<const CompiledModel<S>> now = model_.compiled<S>();
    if constexpr (by_columns<S>) {
      links_.leave();
      if (now != compiled_) links_.forget();
    }
    compiled_ = now;
    for (size_t i = 0; i < q_.size(); ++i) q_[i] = of_state<S>(q[i], 0, static_cast<int>(i));
    for (size_t i = 0; i < v_.size(); ++i) v_[i] = of_state<S>(v[i], 1, static_cast<int>(i));
  }
  unsigned compute(unsigned group) override {
    if constexpr (by_columns<S>) {
      if (group == Group::inverse) {
        if (!links_.taken()) links_.take(source_.links());
        if (this->blocks_.form == Form::fast && links_.eliminate(q_.data())) return 0;
      }
    }
    return TreeValues<RigidBlocks<S>>::compute(group);
  }
  void fill() override {
    kinematics(*compiled_, q_.data(), this->blocks_);
    if constexpr (by_columns<S>) columns_.see(this->blocks_);
  }
  void compute_velocities() override {
    velocities_base_to_tip(*compiled_, this->blocks_.pose.data(), this->blocks_.H.data(), v_.data(), velocities_);
    world_.resize(this->tree_.bodies());
    for (int k = 0; k < this->tree_.bodies(); ++k) {
      const int p = this->tree_.parent[k];
      world_[k] = p < 0 ? this->blocks_.pose[k] : world_[p] * this->blocks_.pose[k];
    }
  }

 private:
  void inertia_derivative_block(const OfInertia& of, S* out) const;
  void selection_block(const SymbolArguments& which, int k, S* out) const;

  const MultibodyOperators& source_;
  const Multibody& model_;
  std::shared_ptr<const CompiledModel<S>> compiled_;
  std::vector<S> q_, v_;
  Velocities<S> velocities_;
  std::vector<Pose<S>> world_;  // X_0k
  ManyColumns<S> columns_;
  [[no_unique_address]] LinkInverse<S> links_;
};

#define PYCRAFT_EXTERN(S) extern template class RigidValues<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
