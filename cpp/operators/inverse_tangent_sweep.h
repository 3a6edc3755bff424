// inverse_tangent.h: how the sweep is seeded, and its derivative.
#pragma once

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "algebra/trees/sweeps/mass_matrix.h"
#include "numerics/decisions.h"
#include "operators/inverse_tangent.h"
#include "operators/rigid_values.h"

namespace pycraft {

template <class S>
void RigidInverseTangent<S>::move(const RigidValues<S>& values, const S& amount, const TwistPlace& place) {
  int k;
  const Vector6<S> h = amount * values.twist(place, k);
  const auto add = [&](int body, const Matrix3<S>& turned, const Vector3<S>& shifted) {
    for (int i = 0; i < 9; ++i) blocks_.pose[body].R.m[i].d[0] += turned.m[i];
    for (int i = 0; i < 3; ++i) blocks_.pose[body].p[i].d[0] += shifted[i];
  };
  const int first = tree_.dof_offset[k], last = first + coordinates_before(values.source(), place);
  if (first < last && last == tree_.dof_offset[k + 1]) {
    for (Vector6<T>& u : factors_[k].column) {
      Vector6<S> at;
      for (int i = 0; i < 6; ++i) at[i] = u[i].x;
      const Vector6<S> moved = cross_force(h, at);
      for (int i = 0; i < 6; ++i) u[i].d[0] += moved[i];
    }
    for (int c = k + 1; c < tree_.bodies(); ++c) {
      if (tree_.parent[c] != k) continue;
      const Pose<S>& X = values.blocks().pose[c];
      add(c, skew(h.angular) * X.R, cross(h.angular, X.p) + h.linear);
    }
    return;
  }
  const Pose<S>& X = values.blocks().pose[k];
  add(k, X.R * skew(h.angular), X.R * h.linear);
  for (int j = first; j < last; ++j) {
    const Vector6<S> moved = cross_motion(h, values.blocks().H[j]);
    for (int i = 0; i < 6; ++i) blocks_.H[j][i].d[0] -= moved[i];
    blocks_.aligned[j] = -1;
  }
}

template <class S>
void RigidInverseTangent<S>::seed(const RigidValues<S>& values) {
  if (compiled_ != values.compiled_model()) compiled_ = values.compiled_model(), model_ = broadcast<T>(*compiled_);
  const RigidBlocks<S>& at = values.blocks();
  for (int k = 0; k < tree_.bodies(); ++k) blocks_.pose[k] = cast<T>(at.pose[k]);
  for (int j = 0; j < tree_.coordinates(); ++j) blocks_.H[j] = cast<T>(at.H[j]);
  std::copy(model_.inertia.begin(), model_.inertia.end(), blocks_.inertia.begin());
  std::copy(model_.rotor_inertia.begin(), model_.rotor_inertia.end(), blocks_.J.begin());
  std::copy(at.aligned.begin(), at.aligned.end(), blocks_.aligned.begin());
  factors_ = model_.inertia_factors;
  blocks_.inertia_factors = &factors_;
  blocks_.form = Form::ud;  // reflections would pass over a row that is zero here and not beside it
  for (const auto& [amount, place] : direction_->twists) move(values, S(amount), place);
  for (int i = 0; direction_->time && i < tree_.coordinates(); ++i) move(values, values.v()[i], OfCoordinate{i});
}

template <class S>
bool RigidInverseTangent<S>::apply(const SkoValues<S>& values, const Symbol& letter, const S* x, S* y, int columns) {
  const size_t size = size_t(tree_.coordinates()) * columns;
  x_.assign(x, x + size);
  y_.resize(size), scratch_.resize(size_t(tree_.dimension()) * columns);
  if (!direction_) direction_ = std::get<OfDirection>(letter.arguments);
  seed(static_cast<const RigidValues<S>&>(values));
  articulated_inertia_tip_to_base(tree_, blocks_);
  mass_matrix_inverse_apply(tree_, blocks_, x_.data(), y_.data(), columns, scratch_.data());
  for (size_t i = 0; i < size; ++i) {
    y[i] = y_[i].d[0];
    if (!is_finite(y[i])) return false;
  }
  return true;
}

}  // namespace pycraft
