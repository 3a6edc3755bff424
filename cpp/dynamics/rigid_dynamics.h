// Direct calls for those who want numbers and no algebra: one workspace per thread, batches state after state, no allocation after the
// first call. All arrays are row-major with an optional leading batch axis; SI units; spatial quantities angular first.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "algebra/trees/sweeps/residual_rounding.h"
#include "dynamics/workspace_pool.h"
#include "model/multibody.h"
#include "numerics/refinement.h"
#include "recursions/applied.h"
#include "recursions/inverse_mass_matrix.h"
#include "recursions/newton_euler.h"
#include "recursions/point_accelerations.h"
#include "recursions/prescribed_hinges.h"
#include "recursions/velocities.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

enum class OnSingular { raise, minimum_norm };
OnSingular on_singular_from_name(const std::string& name);  // EvaluationError that lists the names

// How accelerations are solved for.
struct Solving {
  Form form = Form::fast;
  Refinement refinement;
  OnSingular on_singular = OnSingular::raise;
  bool estimate = false;  // of a refined value: how far it is off
  // What is refined: the value that kernels gave (link_dynamics.h), accelerations or (ℳ + J)⁻¹; null: what the sweep itself gives.
  const double* start = nullptr;
};

// Numbers of one model at one scalar.
template <class S>
class RigidDynamics {
 public:
  // With terms, `forward_dynamics` is of the coordinates that are not prescribed, in their order, but for v, which is of all; it alone is meant.
  explicit RigidDynamics(const Multibody& model, const HingeTerms& terms = {});

  // Of the calls that follow, from numbers of all coordinates: accelerations of those that are prescribed, and what J has in addition.
  template <class T>
  void prescribe(const T* accelerations) {
    if (prescribed_) prescribed_->prescribe(accelerations);
  }
  template <class T>
  void add_to_hinges(const T* inertia) {
    if (prescribed_) return prescribed_->take_free(inertia, added_);
    added_.assign(inertia, inertia + model_->nv);
  }
  // After forward dynamics with these results: accelerations of the free coordinates and forces of the others, by coordinate of all.
  void give_all(const S* vdot, S* out);

  // Each takes one state; sizes are the caller's business (Multibody::check_q, check_v). States of forward dynamics are doubles, or S:
  // what a narrower scalar rounds away, a wider residual sees.
  // `applied` is gravity and what else acts from outside; null: the model's gravity alone.
  template <class T>
  void forward_dynamics(const T* q, const T* v, const T* tau, S* vdot, const Solving& how = {}, const Applied<T>* applied = nullptr);
  // The same but θ̈ + x, before x is taken off that hinges absorb (recursions/point_accelerations.h): of the size of accelerations, however
  // fast the whole travels. Returns the inertias that were added to singular hinges.
  using AddedInertias = std::vector<std::pair<int, S>>;
  template <class T>
  AddedInertias forward_dynamics_of_points(const T* q, const T* v, const T* tau, S* vdot, const Solving& how = {}, const Applied<T>* applied = nullptr);
  void inverse_dynamics(const S* q, const S* v, const S* vdot, S* tau, const Applied<S>* applied = nullptr);  // vdot null: bias forces
  void mass_matrix(const S* q, S* out);                                   // ℳ + J, full
  void mass_matrix_inverse(const double* q, S* out, const Solving& how = {});  // (ℳ + J)⁻¹, full; O(N) a column
  void mass_matrix_solve(const double* q, const S* right, int m, S* out, const Solving& how = {});  // (ℳ + J)⁻¹ of m columns
  void jacobian(const Node& node, const S* q, S* out);  // 6 x nv, node axes
  Pose<S> pose(const Node& node, const S* q);     // X_WN
  S kinetic_energy(const S* q, const S* v);       // with rotor inertia
  // -Σ m g·(c - datum), datum a point in the world; gravity null: the model's.
  S potential_energy(const S* q, const Vector3<S>& datum = Vector3<S>::zero(), const Vector3<S>* gravity = nullptr);

  // What forward dynamics in this form works in.
  size_t bytes(Form form) const;

  // |δ|/|x| of the corrections of the last refined call.
  const std::vector<double>& corrections() const { return refinement_.corrections; }
  // Of the last refined forward dynamics that was asked to estimate it: |x - exact|/|x|, 2-norms.
  double estimated_error() const { return estimated_error_; }

 private:
  template <class T>
  friend class RigidDynamics;

  template <class T>
  void set_state(const T* q, const T* v, const Applied<T>* applied);  // kinematics and what depends on velocities, for equations to be solved
  template <class T>
  void residual(const T* tau, const S* vdot, S* r);       // tau - inverse dynamics, at the state that was set; vdot with what hinges absorb
  void subtract_product(const S* x, S* r, int m);         // r -= (ℳ + J) x
  void solve(const S* r, S* x, int m);                    // with the kept factors
  template <class T>
  void follow(const RigidDynamics<T>& narrower) {         // in what is prescribed and added
    if (prescribed_) prescribed_->prescribe_as(*narrower.prescribed_);
    added_.assign(narrower.added_.begin(), narrower.added_.end());
  }
  void place(const double* q, Form form);                 // the configuration, and how its articulated inertias will be found
  template <class T>
  RigidDynamics<Wider<S>>& wider(const T* q, const T* v, const Applied<T>* applied);
  template <class T>
  void correct_faint(const T* q, const T* v, const T* tau, S* vdot, const Applied<T>* applied);
  template <class E, class T>
  void correct_faint_by(RigidDynamics<E>& up, const T* tau, S* vdot);
  template <class T>
  void size_residual(const RigidDynamics<T>& formed, const T* vdot, const Refinement& how);  // of the one that was formed last
  S length(const S* x) const;   // 2-norm of nv numbers
  S floor(const S* direction);  // the most that rounding of that residual can make of a correction
  template <class F>
  AddedInertias with_every_hinge_regular(F f);
  void project_off_null_space(const AddedInertias& added, S* x, int m);

  const Multibody& source_;
  const HingeTerms terms_;
  const SkoStructure tree_;
  std::unique_ptr<PrescribedHinges<S>> prescribed_;  // null: none
  std::shared_ptr<const CompiledModel<S>> model_;    // without what is prescribed
  std::vector<S> added_;                             // to J
  RigidBlocks<S> blocks_;
  Velocities<S> velocities_;      // of energies
  PointAccelerations<S> points_;  // of equations of motion
  Applied<S> applied_;            // to them
  std::vector<Vector6<S>> wrenches_;
  std::vector<Vector6<S>> alpha_, force_;
  std::vector<Pose<S>> world_;   // X_WB of every body
  std::vector<double> rest_;     // v = 0
  std::vector<S> q_, v_, tau_, columns_, scratch_, r_;
  InverseColumns<S> inverse_;
  std::unique_ptr<RigidDynamics<Wider<S>>> wider_;
  std::vector<Vector6<Wider<S>>> wide_force_;
  std::vector<Wider<S>> wide_x_, wide_r_;
  RefinementWork<S> refinement_;
  ResidualSizes<S> sizes_;
  S left_ = S(0);
  double estimated_error_ = 0;
};

template <class S>
void RigidDynamics<S>::give_all(const S* vdot, S* out) {
  r_.resize(model_->nv), columns_.resize(std::max(columns_.size(), size_t(model_->nv)));
  for (int i = 0; i < model_->nv; ++i) r_[i] = vdot[i] + points_.absorbed[i];
  newton_euler(*model_, blocks_, points_, applied_, r_.data(), columns_.data(), alpha_, force_);
  prescribed_->give(vdot, force_, out);
}

#define PYCRAFT_INSTANTIATE(S) extern template class RigidDynamics<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

template <class S>
using DynamicsPool = WorkspacePool<RigidDynamics<S>>;

}  // namespace pycraft
