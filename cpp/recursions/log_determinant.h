// Gradients of ln det(ℳ + J), by what stays of ∂ ln det D summed over the hinges:
//
//   by inertias               tr(Υ ∂M)
//   by a twist x of a body    2 tr(P⁺ W crf(x)),  W = E*Υ(p)E
//   by row j of H             2 (I - P⁺W) G, column j
//
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapters on the articulated body and on sensitivities of its innovations
// factors. Cost O(N), three sweeps in all.
#pragma once

#include <vector>

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "algebra/trees/sweeps/upsilon.h"
#include "recursions/kinematics.h"

namespace pycraft {

// Along coordinates (nv); by mass, m c (3) and rotational inertia (6), 10 per body; by a twist of each hinge's placement (6 per body); by the
// rows of H as they stand in the body's axes, poses held (6 per coordinate). Each may be null.
template <class S>
struct LogDeterminant {
  S *coordinates, *inertias, *geometry, *axes;
};

// tr(Υ ∂M)
template <class S>
inline void log_determinant_by_inertia(const Symmetric6<S>& Y, S* g) {
  g[0] = Y(3, 3) + Y(4, 4) + Y(5, 5);
  for (int c = 0; c < 3; ++c) {  // ∂M = [[0, ẽ], [-ẽ, 0]], ẽ(b, a) = 1 = -ẽ(a, b)
    const int a = (c + 1) % 3, b = (c + 2) % 3;
    g[1 + c] = S(2) * (Y(b, 3 + a) - Y(a, 3 + b));
  }
  static const int row[] = {0, 0, 0, 1, 1, 2}, column[] = {0, 1, 2, 1, 2, 2};
  for (int e = 0; e < 6; ++e) g[4 + e] = (row[e] == column[e] ? S(1) : S(2)) * Y(row[e], column[e]);
}

// P⁺W of a body.
template <class S>
struct CarriedCompliance {
  S A[6][6];
  CarriedCompliance(const Symmetric6<S>& plus, const Symmetric6<S>& W) {
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        A[i][j] = S(0);
        for (int a = 0; a < 6; ++a) A[i][j] += plus(i, a) * W(a, j);
      }
  }
  // g·x = 2 tr(A crf(x)), Σ A(i,j) crf(x)(j,i)
  Vector6<S> by_twist() const {
    Vector6<S> g = Vector6<S>::zero();
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;  // (x̃)(b, a) = x_c, (x̃)(a, b) = -x_c
      g.angular[c] = S(2) * (A[a][b] - A[b][a] + A[3 + a][3 + b] - A[3 + b][3 + a]);
      g.linear[c] = S(2) * (A[3 + a][b] - A[3 + b][a]);
    }
    return g;
  }
  Vector6<S> by_row(const Vector6<S>& gain) const {
    Vector6<S> r = gain;
    for (int i = 0; i < 6; ++i)
      for (int a = 0; a < 6; ++a) r[i] -= A[i][a] * gain[a];
    return S(2) * r;
  }
};

// subhinge_of: of every coordinate; those inboard have smaller numbers.
template <class S>
void log_determinant_gradient(const CompiledModel<S>& m, const SkoStructure& tree, RigidBlocks<S>& blocks, const std::vector<int>& subhinge_of, const S* q,
                              const LogDeterminant<S>& out) {
  kinematics(m, q, blocks);
  articulated_inertia_tip_to_base(tree, blocks);
  upsilon_base_to_tip(tree, blocks);
  for (int k = 0; k < m.bodies; ++k) {
    check_interrupt_at(k);
    const int p = m.parent[k], first = m.v_offset[k], last = first + m.nv_of[k];
    if (out.inertias) log_determinant_by_inertia(blocks.Y[k], out.inertias + 10 * k);
    if (!out.coordinates && !out.geometry && !out.axes) continue;
    const CarriedCompliance<S> carried(blocks.Pplus[k], p < 0 ? Symmetric6<S>::zero() : compliance_to_child(blocks.pose[k], blocks.Y[p]));
    const Vector6<S> g = carried.by_twist();
    if (out.coordinates)
      for (int i = first; i < last; ++i) {
        S sum = dot(g, blocks.H[i]);
        for (int j = first; j < last; ++j)  // ∂H: rows of subhinges inboard of i's turn with it
          if (subhinge_of[j] < subhinge_of[i]) sum += dot(carried.by_row(blocks.G[j]), S(-1) * cross_motion(blocks.H[i], blocks.H[j]));
        out.coordinates[i] = sum;
      }
    if (out.axes)
      for (int j = first; j < last; ++j) {
        const Vector6<S> r = carried.by_row(blocks.G[j]);
        for (int i = 0; i < 6; ++i) out.axes[6 * j + i] = r[i];
      }
    if (out.geometry) {  // a twist at the placement, seen in the body's axes: the hinge's own motion carries it
      const Vector6<S> placed = force_to_parent(inverse(m.placement[k]) * blocks.pose[k], g);
      for (int i = 0; i < 6; ++i) out.geometry[6 * k + i] = placed[i];
    }
  }
}

}  // namespace pycraft
