// Sensitivities to the numbers of a model: the inertial regressor, gradients of ln det(ℳ + J) (sensitivities.h).
#pragma once

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "algebra/trees/sweeps/upsilon.h"
#include "dynamics/sensitivities.h"
#include "recursions/kinematics.h"
#include "recursions/newton_euler.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class S>
void Sensitivities<S>::inertial_regressor(const S* q, const S* v, const S* vdot, S* out, const Vector3<S>* gravity) {
  const CompiledModel<S>& m = *model_;
  const int columns = 10 * m.bodies;
  kinematics(m, q, blocks_);
  point_accelerations_base_to_tip(m, blocks_.pose.data(), blocks_.H.data(), v, OwnTerms::kept, points_);
  rates_.resize(m.nv);
  newton_euler(m, blocks_, points_, gravity ? Applied<S>{*gravity} : own_gravity(m), vdot, rates_.data(), alpha_, force_);
  std::fill_n(out, size_t(m.nv) * columns, S(0));
  for (int k = 0; k < m.bodies; ++k) {
    check_interrupt_at(k, k);
    const Vector3<S>& omega = points_.angular_velocity[k];
    for (int p = 0; p < 10; ++p) {
      RigidInertia<S> unit = RigidInertia<S>::zero();
      if (p == 0)
        unit.mass = S(1);
      else if (p < 4)
        unit.moment[p - 1] = S(1);
      else
        unit.rotational.s[p - 4] = S(1);
      Vector6<S> f = unit * alpha_[k] + gyroscopic_part(unit, omega);
      for (int a = k; a >= 0; a = m.parent[a]) {
        for (int i = m.v_offset[a]; i < m.v_offset[a] + m.nv_of[a]; ++i) out[size_t(i) * columns + 10 * k + p] = dot(blocks_.H[i], f);
        f = force_to_parent(blocks_.pose[a], f);
      }
    }
  }
}

template <class S>
void Sensitivities<S>::log_determinant(const S* q, S* coordinates, S* inertias, S* geometry, S* axes) {
  const CompiledModel<S>& m = *model_;
  kinematics(m, q, blocks_);
  articulated_inertia_tip_to_base(tree_, blocks_);
  upsilon_base_to_tip(tree_, blocks_);
  for (int k = 0; k < m.bodies; ++k) {
    check_interrupt_at(k);
    const int p = m.parent[k], first = m.v_offset[k], last = first + m.nv_of[k];
    const Symmetric6<S>& Y = blocks_.Y[k];
    if (inertias) {  // tr(Υ ∂M)
      S* g = inertias + 10 * k;
      g[0] = Y(3, 3) + Y(4, 4) + Y(5, 5);
      // ∂M = [[0, ẽ], [-ẽ, 0]], ẽ(b, a) = 1 = -ẽ(a, b)
      for (int c = 0; c < 3; ++c) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        g[1 + c] = S(2) * (Y(b, 3 + a) - Y(a, 3 + b));
      }
      static const int row[] = {0, 0, 0, 1, 1, 2}, column[] = {0, 1, 2, 1, 2, 2};
      for (int e = 0; e < 6; ++e) g[4 + e] = (row[e] == column[e] ? S(1) : S(2)) * Y(row[e], column[e]);
    }
    if (!coordinates && !geometry && !axes) continue;
    const Symmetric6<S> W = p < 0 ? Symmetric6<S>::zero() : compliance_to_child(blocks_.pose[k], blocks_.Y[p]);  // E*ΥE
    const Symmetric6<S>& plus = blocks_.Pplus[k];
    // g: 2 tr(P⁺ W crf(x)) = g·x; with A = P⁺W: tr(A crf(x)) = Σ A(i,j) crf(x)(j,i)
    S A[6][6];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        A[i][j] = S(0);
        for (int a = 0; a < 6; ++a) A[i][j] += plus(i, a) * W(a, j);
      }
    Vector6<S> g = Vector6<S>::zero();
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;  // (x̃)(b, a) = x_c, (x̃)(a, b) = -x_c
      g.angular[c] = S(2) * (A[a][b] - A[b][a] + A[3 + a][3 + b] - A[3 + b][3 + a]);
      g.linear[c] = S(2) * (A[3 + a][b] - A[3 + b][a]);
    }
    // 2 (I - P⁺W) G, column j: what a change of row j of H is worth
    const auto by_row = [&](int j) {
      Vector6<S> r = blocks_.G[j];
      const Vector6<S> gain = blocks_.G[j];
      for (int i = 0; i < 6; ++i)
        for (int a = 0; a < 6; ++a) r[i] -= A[i][a] * gain[a];
      return S(2) * r;
    };
    if (coordinates)
      for (int i = first; i < last; ++i) {
        S sum = dot(g, blocks_.H[i]);
        for (int j = first; j < last; ++j)  // ∂H: rows of subhinges inboard of i's turn with it
          if (frame_.inboard(j, i)) sum += dot(by_row(j), S(-1) * cross_motion(blocks_.H[i], blocks_.H[j]));
        coordinates[i] = sum;
      }
    if (axes)
      for (int j = first; j < last; ++j) {
        const Vector6<S> r = by_row(j);
        for (int i = 0; i < 6; ++i) axes[6 * j + i] = r[i];
      }
    if (geometry) {  // a twist at the placement, seen in the body's axes: the hinge's own motion carries it
      const Vector6<S> placed = force_to_parent(inverse(m.placement[k]) * blocks_.pose[k], g);
      for (int i = 0; i < 6; ++i) geometry[6 * k + i] = placed[i];
    }
  }
}

}  // namespace pycraft
