#include "dynamics/methods.h"
#include "runtime/interrupt.h"

#include <cstdio>

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "algebra/trees/sweeps/mass_matrix.h"
#include "dynamics/divided_dynamics.h"
#include "dynamics/tree_factors.h"
#include "recursions/composite_mass_matrix.h"
#include "recursions/kinematics.h"
#include "recursions/newton_euler.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr const char* names[] = {"cholesky", "ldl", "conjugate-gradients", "inverse", "divide-and-conquer"};
constexpr const char* remedy = "method=\"articulated\" with form=\"ud\", with refine=1, or in a wider precision is more accurate";

}  // namespace

const char* method_name(Method method) { return names[static_cast<int>(method)]; }

Method method_from_name(const std::string& name) {
  for (const Method m : methods)
    if (name == method_name(m)) return m;
  throw EvaluationError("no method of forward dynamics is called '" + name +
                        "'; there are 'articulated', 'cholesky', 'ldl', 'conjugate-gradients', 'inverse', 'divide-and-conquer' and 'realization'");
}

template <class S>
DynamicsMethods<S>::DynamicsMethods(const Multibody& model)
    : source_(model), tree_(model.structure()), model_(model.compiled<S>()), blocks_(tree_), order_(tree_), alpha_(tree_.bodies()), force_(tree_.bodies()),
      right_side_(tree_.coordinates()), work_(2 * size_t(tree_.coordinates())) {}

template <class S>
DynamicsMethods<S>::~DynamicsMethods() = default;

template <class S>
DividedDynamics<S>& DynamicsMethods<S>::divided() {
  if (!divided_) divided_ = std::make_unique<DividedDynamics<S>>(source_);
  return *divided_;
}

template <class S>
void DynamicsMethods<S>::forward_dynamics(Method method, const S* q, const S* v, const S* tau, S* vdot, const Applied<S>* applied, int threads) {
  const Applied<S> acting = applied ? *applied : own_gravity(*model_);
  if (method == Method::divide_and_conquer) return divided().forward_dynamics(q, v, tau, vdot, acting, threads);
  kinematics(*model_, q, blocks_);
  point_accelerations_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v, OwnTerms::absorbed, points_);
  newton_euler(*model_, blocks_, points_, acting, static_cast<const S*>(nullptr), right_side_.data(), alpha_, force_);  // 𝒞
  for (int i = 0; i < model_->nv; ++i) right_side_[i] = tau[i] - right_side_[i];
  switch (method) {
    case Method::cholesky:
    case Method::ldl:
      std::copy(right_side_.begin(), right_side_.end(), vdot);
      factor_and_solve(method, vdot);
      break;
    case Method::conjugate_gradients: solve_by_gradients(right_side_.data(), vdot); break;
    case Method::inverse: multiply_by_inverse(right_side_.data(), vdot); break;
    case Method::divide_and_conquer: break;
  }
  for (int i = 0; i < model_->nv; ++i) vdot[i] -= points_.absorbed[i];
}

template <class S>
void DynamicsMethods<S>::factor_and_solve(Method method, S* x) {
  const int n = model_->nv;
  matrix_.resize(size_t(n) * n);
  composite_mass_matrix(tree_, *model_, blocks_, matrix_.data());
  const bool dense = method == Method::cholesky;
  const PivotFailure<S> failure =
      dense ? cholesky_upper(matrix_.data(), n, work_.data()) : ldl_tip_to_base(order_, matrix_.data(), n, work_.data());
  if (failure.coordinate >= 0) refuse(method, failure);
  if (dense)
    cholesky_solve(matrix_.data(), n, x);
  else
    ldl_solve(order_, matrix_.data(), n, x);
}

template <class S>
void DynamicsMethods<S>::refuse(Method method, const PivotFailure<S>& failure) const {
  char numbers[96];
  std::snprintf(numbers, sizeof numbers, "pivot %.3g, rounding bound %.3g", to_double(failure.pivot), to_double(failure.bound));
  throw SingularOperatorError(std::string("method '") + method_name(method) +
                              "': the mass matrix is not positive definite to rounding at coordinate '" + tree_.coordinate_names[failure.coordinate] + "' (" +
                              numbers + "): give the bodies it moves a mass, or the hinge a rotor inertia; where they have one, " + remedy);
}

template <class S>
void DynamicsMethods<S>::solve_by_gradients(const S* b, S* x) {
  using std::sqrt;
  const int n = model_->nv;
  S* diagonal = work_.data();
  scratch_.resize(size_t(tree_.dimension()));
  composite_inertia_tip_to_base(tree_, blocks_);
  for (int k = 0; k < model_->bodies; ++k)
    for (int j = model_->v_offset[k]; j < model_->v_offset[k] + model_->nv_of[k]; ++j) {
      diagonal[j] = dot(blocks_.H[j], blocks_.R[k] * blocks_.H[j]) + blocks_.J[j];
      if (!(diagonal[j] > S(0))) refuse(Method::conjugate_gradients, {j, diagonal[j], S(0)});
    }
  gradients_.solve(n, diagonal, b, x,
                   [&](const S* p, S* y) { mass_matrix_apply(tree_, blocks_, true, p, y, 1, scratch_.data()); });
  const S widest = S(0.1) / epsilon<S>();
  if (gradients_.residual < sqrt(epsilon<S>()) && gradients_.condition < widest) return;
  char numbers[240];
  std::snprintf(numbers, sizeof numbers,
                "relative residual %.3g after %d iterations, of %d at most, condition %.3g or more; they must fall below sqrt(eps) = %.3g and 0.1/eps = %.3g",
                to_double(gradients_.residual), gradients_.iterations, gradients_.most(n), to_double(gradients_.condition),
                to_double(S(sqrt(epsilon<S>()))), to_double(widest));
  throw SingularOperatorError(std::string("method 'conjugate-gradients' does not converge on the mass matrix of ") + std::to_string(n) +
                              " coordinates (" + numbers + "): it is too ill-conditioned; " + remedy);
}

template <class S>
void DynamicsMethods<S>::multiply_by_inverse(const S* b, S* x) {
  const int n = model_->nv;
  const size_t square = size_t(n) * n;
  matrix_.resize(square);
  scratch_.resize(size_t(tree_.dimension()) * n);
  identity_.assign(square, S(0));
  for (int i = 0; i < n; ++i) identity_[size_t(i) * n + i] = S(1);
  articulated_inertia_tip_to_base(tree_, blocks_);
  mass_matrix_inverse_apply(tree_, blocks_, identity_.data(), matrix_.data(), n, scratch_.data());
  for (int i = 0; i < n; ++i) {
    check_interrupt_at(i, n);
    S sum = S(0);
    for (int j = 0; j < n; ++j) sum += matrix_[size_t(i) * n + j] * b[j];
    x[i] = sum;
  }
}

template <class S>
size_t DynamicsMethods<S>::memory(Method method) {
  const size_t n = model_->nv, bodies = model_->bodies, six = sizeof(Vector6<S>);
  size_t d = 0;  // D(k) and its factor
  for (int count : tree_.dof) d += 2 * size_t(count) * count;
  const size_t common = bodies * (sizeof(Pose<S>) + sizeof(RigidInertia<S>) + 6 * six) + n * (2 * six + 2 * sizeof(S));
  const size_t composite = bodies * sizeof(Symmetric6<S>), square = n * n * sizeof(S);
  switch (method) {
    case Method::cholesky: return common + composite + square + 2 * n * sizeof(S);
    case Method::ldl: return common + composite + square + 2 * n * (sizeof(S) + sizeof(int));
    case Method::conjugate_gradients: return common + composite + (gradients_.numbers(int(n)) + n) * sizeof(S) + bodies * six;
    case Method::inverse: return common + 2 * composite + n * six + d * sizeof(S) + 2 * square + bodies * n * six;
    case Method::divide_and_conquer: return bytes_of_blocks(*model_) + bodies * (5 * six + 3 * sizeof(S)) + n * 4 * sizeof(S) + divided().memory();
  }
  return 0;
}

#define PYCRAFT_INSTANTIATE(S) template class DynamicsMethods<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
