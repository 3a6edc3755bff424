#include "dynamics/rigid_dynamics.h"

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "algebra/trees/sweeps/mass_matrix.h"
#include "dynamics/singular_hinges.h"
#include "model/unit_data.h"
#include "numerics/small_matrix.h"
#include "recursions/articulated_body.h"
#include "recursions/composite_mass_matrix.h"
#include "recursions/kinematics.h"
#include "recursions/newton_euler.h"
#include "recursions/newton_euler_sizes.h"

namespace pycraft {

OnSingular on_singular_from_name(const std::string& name) {
  if (name == "raise") return OnSingular::raise;
  if (name == "minimum-norm") return OnSingular::minimum_norm;
  throw EvaluationError("on_singular '" + name + "' is not there; there are 'raise' and 'minimum-norm'");
}

template <class S>
RigidDynamics<S>::RigidDynamics(const Multibody& model, const HingeTerms& terms)
    : source_(model), terms_(terms), tree_(free_tree(model.structure(), terms)),
      prescribed_(terms.prescribes() ? std::make_unique<PrescribedHinges<S>>(compile_model<S>(model, terms), terms) : nullptr),
      model_(prescribed_ ? prescribed_->left() : terms.empty() ? model.compiled<S>() : compile_model<S>(model, terms)), blocks_(tree_), alpha_(tree_.bodies()),
      force_(tree_.bodies()) {}

template <class S>
template <class T>
void RigidDynamics<S>::set_state(const T* q, const T* v, const Applied<T>* applied) {
  convert(q, model_->nq, q_);
  convert(v, prescribed_ ? prescribed_->coordinates() : model_->nv, v_);
  if (prescribed_) {
    prescribed_->set_state(q_.data(), v_.data(), OwnTerms::absorbed, blocks_, points_);
    prescribed_->keep_free(v_);
  } else {
    kinematics(*model_, q_.data(), blocks_);
    point_accelerations_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v_.data(), OwnTerms::absorbed, points_);
  }
  for (size_t j = 0; j < added_.size(); ++j) blocks_.J[j] += added_[j];
  applied_ = applied ? converted(*applied, model_->bodies, wrenches_) : own_gravity(*model_);
}

template <class S>
template <class T>
void RigidDynamics<S>::forward_dynamics(const T* q, const T* v, const T* tau, S* vdot, const Solving& how, const Applied<T>* applied) {
  const auto added = forward_dynamics_of_points(q, v, tau, vdot, how, applied);
  for (int i = 0; i < model_->nv; ++i) vdot[i] -= points_.absorbed[i];
  project_off_null_space(added, vdot, 1);
  if (!how.estimate || how.refinement.steps == 0) return;
  left_ += S(4) * epsilon<S>() * length(points_.absorbed.data());  // x is a product of velocities, rounded
  estimated_error_ = left_ == S(0) ? 0.0 : to_double(S(left_ / length(vdot)));
}

template <class S>
template <class T>
typename RigidDynamics<S>::AddedInertias RigidDynamics<S>::forward_dynamics_of_points(const T* q, const T* v, const T* tau, S* vdot, const Solving& how,
                                                                                     const Applied<T>* applied) {
  const int n = model_->nv;
  set_state(q, v, applied);
  convert(tau, n, tau_);
  blocks_.form = how.form;
  S largest = S(0);
  AddedInertias added;
  const auto sweep = [&] { largest = articulated_body(tree_, *model_, blocks_, points_, applied_, tau_.data(), vdot, force_, alpha_); };
  if (how.on_singular == OnSingular::minimum_norm)
    added = with_every_hinge_regular(sweep);
  else
    sweep();
  const auto solve_regular = [&](const S* r, S* x) {
    solve(r, x, 1);
    project_off_null_space(added, x, 1);
  };
  const auto residual_at = [&](const S* x, S* r) {
    if (how.refinement.gathers_wider()) {
      newton_euler_residual_gathered(*model_, blocks_, points_, applied_, x, tau, r, alpha_, force_, wide_force_);
    } else if (how.refinement.wider()) {
      convert(x, n, wide_x_), wide_r_.resize(n);
      wider_->residual(tau, wide_x_.data(), wide_r_.data());
      for (int i = 0; i < n; ++i) r[i] = static_cast<S>(wide_r_[i]);
    } else {
      residual(tau, x, r);
    }
    if (!how.refinement.wider())
      for (const auto& [j, inertia] : added) r[j] += inertia * x[j];
    project_off_null_space(added, r, 1);
  };
  refinement_.corrections.clear();
  if (how.refinement.steps != 0 && how.refinement.wider()) wider(q, v, applied);
  if (!added.empty()) {
    articulated_inertia_tip_to_base(tree_, blocks_);
    std::fill_n(vdot, n, S(0));
    r_.resize(n);
    newton_euler(*model_, blocks_, points_, applied_, vdot, r_.data(), alpha_, force_);
    for (int i = 0; i < n; ++i) r_[i] = tau_[i] - r_[i];
    project_off_null_space(added, r_.data(), 1);
    solve_regular(r_.data(), vdot);
  }
  left_ = S(0);
  if (how.on_singular != OnSingular::minimum_norm && blocks_.faint().body >= 0) correct_faint(q, v, tau, vdot, applied);
  if (how.refinement.steps == 0) return added;
  for (int i = 0; i < n && how.start; ++i) vdot[i] = S(how.start[i]) + points_.absorbed[i];
  const auto size_at = [&](const S* x) {
    if (how.refinement.wider())
      size_residual(*wider_, wide_x_.data(), how.refinement);
    else
      size_residual(*this, x, how.refinement);
  };
  refine(vdot, n, 1, how.refinement, how.form, largest, [&] { return "the forward dynamics of '" + source_.name() + "'"; }, residual_at, solve_regular,
         [&](const S* direction, S* out) {
           size_at(vdot);
           rounding_along(tree_, blocks_, direction, 1, sizes_, out);
         },
         refinement_);
  if (!how.estimate) return added;
  size_at(vdot);
  left_ = maximum(maximum(length(refinement_.delta.data()), floor(refinement_.delta.data())), S(epsilon<S>() / S(2) * length(vdot)));
  return added;
}

// Where a coordinate feels hardly any inertia: accelerations are corrected by residuals two scalars up (one up inertias about a body's origin
// round to more than the faintest inertia that a form can carry), or three where the rounding of those, which corrections do not show, may be
// too much, as long as corrections shrink. Refused is what comes no closer than `faint_limit` of the accelerations.
template <class S>
template <class T>
void RigidDynamics<S>::correct_faint(const T* q, const T* v, const T* tau, S* vdot, const Applied<T>* applied) {
  auto& two_up = wider(q, v, applied).wider(q, v, applied);
  const auto left = [&]<class E>(RigidDynamics<E>&) { return S(64 * blocks_.faint().ratio) * static_cast<S>(epsilon<E>()); };  // so many roundings, as of columns
  if (faint_limit<S>() > left(two_up)) return correct_faint_by(two_up, tau, vdot);
  auto& three_up = two_up.wider(q, v, applied);
  if (!(faint_limit<S>() > left(three_up))) throw_faint_hinge(tree_, blocks_.faint());
  correct_faint_by(three_up, tau, vdot);
}

template <class S>
template <class E, class T>
void RigidDynamics<S>::correct_faint_by(RigidDynamics<E>& up, const T* tau, S* vdot) {
  const int n = model_->nv;
  std::vector<E> x, exact(n);
  std::vector<S>& r = r_;
  r.resize(n);
  columns_.resize(std::max(columns_.size(), size_t(n)));
  // What coasts has no acceleration to compare with: the motion's own, ω² and gravity over the length of the body.
  const RigidInertia<S>& own = model_->inertia[blocks_.faint().body];
  S scale = length(vdot) + ratio_or_zero(own.mass * norm(applied_.gravity), norm(own.moment));
  for (const Vector3<S>& omega : points_.angular_velocity) scale = maximum(scale, dot(omega, omega));
  S last = S(0.3) / S(0.9) * scale;
  for (int step = 0; step < 5; ++step) {
    convert(vdot, n, x);
    up.residual(tau, x.data(), exact.data());
    for (int i = 0; i < n; ++i) r[i] = static_cast<S>(exact[i]);
    solve(r.data(), columns_.data(), 1);
    const S size = length(columns_.data());
    const bool closer = S(0.9) * last >= size;  // else too far, not a number, or noise, which the one before met by luck
    last = size;
    if (!closer) break;
    for (int i = 0; i < n; ++i) vdot[i] += columns_[i];
    if (size <= S(4) * epsilon<S>() * length(vdot)) break;
  }
  // What the last residual lost as it was rounded tells what such rounding makes of θ̈.
  for (int i = 0; i < n; ++i) r[i] = static_cast<S>(exact[i] - E(static_cast<S>(exact[i])));
  solve(r.data(), columns_.data(), 1);
  last = maximum(last, length(columns_.data()));
  if (!(faint_limit<S>() * length(vdot) >= last || S(4) * epsilon<S>() * scale >= last)) throw_faint_hinge(tree_, blocks_.faint());
}

template <class S>
S RigidDynamics<S>::length(const S* x) const {
  using std::sqrt;
  S square = S(0);
  for (int i = 0; i < model_->nv; ++i) square += x[i] * x[i];
  return sqrt(square);
}

template <class S>
template <class T>
void RigidDynamics<S>::size_residual(const RigidDynamics<T>& formed, const T* vdot, const Refinement& how) {
  newton_euler_sizes(tree_, *formed.model_, formed.blocks_, formed.points_, formed.applied_, formed.v_.data(), vdot, tau_.data(), formed.alpha_, formed.force_, units_of<S>(how), sizes_);
}

template <class S>
S RigidDynamics<S>::floor(const S* direction) {
  r_.assign(direction, direction + model_->nv);
  const auto along = [&](const S* w) {
    S bound;
    rounding_along(tree_, blocks_, w, 1, sizes_, &bound);
    return bound;
  };
  return most_rounding(r_, along, [&](S* w) {
    worst_residual(tree_, blocks_, sizes_, w);
    mass_matrix_inverse_apply(tree_, blocks_, sizes_.y.data(), w, 1, sizes_.g.data());
  });
}

template <class S>
size_t RigidDynamics<S>::bytes(Form form) const {
  const size_t n = tree_.bodies(), N = tree_.coordinates();
  size_t scalars = n * (12 + 10 + 4 * 6 + 2 * 6 + 3) + N * (4 * 6 + 6);  // poses, inertias, velocities, forces and accelerations; H, G, Ḣ, ...
  for (size_t k = 0; k < n; ++k) scalars += 2 * size_t(tree_.dof[k]) * tree_.dof[k];
  scalars += form == Form::fast ? n * 2 * 21 : FactoredInertia<S>(tree_).scalars();
  return scalars * sizeof(S);
}

template <class S>
template <class T>
void RigidDynamics<S>::residual(const T* tau, const S* vdot, S* r) {
  newton_euler(*model_, blocks_, points_, applied_, vdot, r, alpha_, force_);
  for (int i = 0; i < model_->nv; ++i) r[i] = S(tau[i]) - r[i];
}

template <class S>
void RigidDynamics<S>::subtract_product(const S* x, S* r, int m) {
  const size_t size = size_t(model_->nv) * m;
  scratch_.resize(std::max(scratch_.size(), size_t(6) * model_->bodies * m));
  tau_.resize(std::max(tau_.size(), size));
  mass_matrix_apply(tree_, blocks_, true, x, tau_.data(), m, scratch_.data());
  for (size_t i = 0; i < size; ++i) r[i] -= tau_[i];
}

template <class S>
void RigidDynamics<S>::solve(const S* r, S* x, int m) {
  scratch_.resize(std::max(scratch_.size(), size_t(6) * model_->bodies * m));
  mass_matrix_inverse_apply(tree_, blocks_, r, x, m, scratch_.data());
}

template <class S>
template <class T>
RigidDynamics<Wider<S>>& RigidDynamics<S>::wider(const T* q, const T* v, const Applied<T>* applied) {
  if (!wider_) wider_ = std::make_unique<RigidDynamics<Wider<S>>>(source_, terms_);
  wider_->follow(*this);
  wider_->set_state(q, v, applied);
  return *wider_;
}

template <class S>
void RigidDynamics<S>::inverse_dynamics(const S* q, const S* v, const S* vdot, S* tau, const Applied<S>* applied) {
  kinematics(*model_, q, blocks_);
  point_accelerations_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v, OwnTerms::kept, points_);
  newton_euler(*model_, blocks_, points_, applied ? *applied : own_gravity(*model_), vdot, tau, alpha_, force_);
}

template <class S>
void RigidDynamics<S>::mass_matrix(const S* q, S* out) {
  kinematics(*model_, q, blocks_);
  composite_mass_matrix(tree_, *model_, blocks_, out);
}

template <class S>
void RigidDynamics<S>::place(const double* q, Form form) {
  convert(q, model_->nq, q_);
  kinematics(*model_, q_.data(), blocks_);
  blocks_.form = form;
}

template <class S>
void RigidDynamics<S>::mass_matrix_inverse(const double* q, S* out, const Solving& how) {
  const int N = model_->nv;
  if (how.refinement.steps == 0 && how.on_singular == OnSingular::raise) {
    place(q, how.form);
    articulated_inertia_tip_to_base(tree_, blocks_);
    inverse_mass_matrix(tree_, *model_, blocks_, inverse_, out);
    return;
  }
  std::vector<S>& identity = r_;
  identity.assign(size_t(N) * N, S(0));
  for (int i = 0; i < N; ++i) identity[size_t(i) * N + i] = S(1);
  mass_matrix_solve(q, identity.data(), N, out, how);
  // Symmetric by meaning; the two triangles differ by rounding and the mean is the better of them.
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < i; ++j) out[size_t(i) * N + j] = out[size_t(j) * N + i] = S(0.5) * (out[size_t(i) * N + j] + out[size_t(j) * N + i]);
}

template <class S>
void RigidDynamics<S>::mass_matrix_solve(const double* q, const S* right, int m, S* out, const Solving& how) {
  const int N = model_->nv;
  const size_t size = size_t(N) * m;
  place(q, how.form);
  columns_.assign(right, right + size);
  AddedInertias added;
  if (how.on_singular == OnSingular::minimum_norm)
    added = with_every_hinge_regular([&] { articulated_inertia_tip_to_base(tree_, blocks_); });
  else
    articulated_inertia_tip_to_base(tree_, blocks_);
  project_off_null_space(added, columns_.data(), m);
  solve(columns_.data(), out, m);
  project_off_null_space(added, out, m);
  for (size_t i = 0; i < size && how.start; ++i) out[i] = S(how.start[i]);
  refinement_.corrections.clear();
  if (how.refinement.steps != 0) {
    if (how.refinement.wider()) {
      rest_.assign(N, 0.0);
      wider<double>(q, rest_.data(), nullptr);
    }
    refine(out, N, m, how.refinement, how.form, S(0), [&] { return "the mass matrix inverse of '" + source_.name() + "'"; },
           [&](const S* x, S* r) {
             if (how.refinement.gathers_wider()) {
               mass_matrix_residual_gathered(tree_, blocks_, model_->mass_properties, x, columns_.data(), r, m, scratch_.data(), wide_r_);
             } else if (how.refinement.wider()) {
               convert(x, size, wide_x_), convert(columns_.data(), size, wide_r_);
               wider_->subtract_product(wide_x_.data(), wide_r_.data(), m);
               for (size_t i = 0; i < size; ++i) r[i] = static_cast<S>(wide_r_[i]);
             } else {
               std::copy_n(columns_.data(), size, r);
               subtract_product(x, r, m);
             }
             for (const auto& [j, inertia] : added)
               for (int c = 0; c < m && !how.refinement.wider(); ++c) r[size_t(j) * m + c] += inertia * x[size_t(j) * m + c];
             project_off_null_space(added, r, m);
           },
           [&](const S* r, S* d) {
             solve(r, d, m);
             project_off_null_space(added, d, m);
           },
           [&](const S* direction, S* rounding) {
             residual_sizes(tree_, blocks_, out, columns_.data(), m, units_of<S>(how.refinement), sizes_);
             rounding_along(tree_, blocks_, direction, m, sizes_, rounding);
           },
           refinement_);
  }
}

template <class S>
void RigidDynamics<S>::jacobian(const Node& node, const S* q, S* out) {
  const int N = model_->nv;
  kinematics(*model_, q, blocks_);
  std::fill_n(out, size_t(6) * N, S(0));
  Pose<S> X = renormalised<S>(node.pose);  // X_aN for the ancestor a
  for (int a = node.body; a >= 0; a = model_->parent[a]) {
    for (int j = model_->v_offset[a]; j < model_->v_offset[a] + model_->nv_of[a]; ++j) {
      const Vector6<S> column = motion_to_child(X, blocks_.H[j]);
      for (int i = 0; i < 6; ++i) out[size_t(i) * N + j] = column[i];
    }
    X = blocks_.pose[a] * X;
  }
}

template <class S>
Pose<S> RigidDynamics<S>::pose(const Node& node, const S* q) {
  kinematics(*model_, q, blocks_);
  Pose<S> X = renormalised<S>(node.pose);
  for (int a = node.body; a >= 0; a = model_->parent[a]) X = blocks_.pose[a] * X;
  return X;
}

template <class S>
S RigidDynamics<S>::kinetic_energy(const S* q, const S* v) {
  kinematics(*model_, q, blocks_);
  velocities_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v, velocities_);
  S twice = S(0);
  for (int k = 0; k < model_->bodies; ++k) twice += dot(velocities_.V[k], model_->inertia[k] * velocities_.V[k]);
  for (int j = 0; j < model_->nv; ++j) twice += model_->rotor_inertia[j] * v[j] * v[j];
  return twice / S(2);
}

template <class S>
S RigidDynamics<S>::potential_energy(const S* q, const Vector3<S>& datum, const Vector3<S>* gravity) {
  const Vector3<S>& g = gravity ? *gravity : model_->gravity;
  kinematics(*model_, q, blocks_);
  // Masses and their first moments about the origins of the bodies that carry them; only a root's own height is large far from the datum, and
  // it is added last, in wider numbers, so that the sum is rounded once.
  using W = Wider<S>;
  std::vector<RigidInertia<S>>& carried = blocks_.inertia;
  W energy = W(0);
  for (int k = model_->bodies - 1; k >= 0; --k) {
    const Pose<S>& X = blocks_.pose[k];
    const Vector3<S> moment = X.R * carried[k].moment;
    if (const int p = model_->parent[k]; p >= 0) {
      carried[p].mass += carried[k].mass;
      carried[p].moment = carried[p].moment + moment + carried[k].mass * X.p;
      continue;
    }
    for (int i = 0; i < 3; ++i) energy -= W(g[i]) * (W(moment[i]) + W(carried[k].mass) * (W(X.p[i]) - W(datum[i])));
  }
  return static_cast<S>(energy);
}

#define PYCRAFT_INSTANTIATE(S)     \
  template class RigidDynamics<S>; \
  template void RigidDynamics<S>::forward_dynamics(const double*, const double*, const double*, S*, const Solving&, const Applied<double>*); \
  template std::vector<std::pair<int, S>> RigidDynamics<S>::forward_dynamics_of_points(const double*, const double*, const double*, S*, const Solving&, const Applied<double>*);
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE
template void RigidDynamics<Single>::forward_dynamics(const Single*, const Single*, const Single*, Single*, const Solving&, const Applied<Single>*);
template void RigidDynamics<Extended>::forward_dynamics(const Extended*, const Extended*, const Extended*, Extended*, const Solving&, const Applied<Extended>*);
template void RigidDynamics<Quad>::forward_dynamics(const Quad*, const Quad*, const Quad*, Quad*, const Solving&, const Applied<Quad>*);
template void RigidDynamics<Digits50>::forward_dynamics(const Digits50*, const Digits50*, const Digits50*, Digits50*, const Solving&, const Applied<Digits50>*);
template void RigidDynamics<Digits100>::forward_dynamics(const Digits100*, const Digits100*, const Digits100*, Digits100*, const Solving&, const Applied<Digits100>*);

}  // namespace pycraft
