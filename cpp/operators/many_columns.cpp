#include "operators/many_columns.h"

#include <cmath>

#include "runtime/interrupt.h"

namespace pycraft {

using kernels::Way;

ManyColumns::ManyColumns(const SkoStructure& tree)
    : tree_(tree), kernels_(kernels::instruction_set().columns), branches_(tree.bodies()), way_(tree.bodies(), Way::any) {
  for (int k = 0; k < tree.bodies(); ++k)
    if (const int p = tree.parent[k]; p >= 0 && p != k - 1) branches_[p] = true;
}

// R mixes no other axis with coordinate axis K.
static bool about(int K, const Matrix3<double>& R) {
  const int i = (K + 1) % 3, j = (K + 2) % 3;
  return R(i, K) == 0 && R(j, K) == 0 && R(K, i) == 0 && R(K, j) == 0;
}

void ManyColumns::see(const RigidBlocks<double>& blocks) {
  for (int k = 0; k < tree_.bodies(); ++k) {
    const int axis = tree_.dof[k] == 1 ? blocks.aligned[tree_.dof_offset[k]] : -1;
    const bool pin = axis >= 0 && axis < 3;
    way_[k] = pin ? static_cast<Way>(static_cast<int>(about(axis, blocks.pose[k].R) ? Way::level_x : Way::pin_x) + axis) : Way::any;
  }
}

kernels::Bodies<double> ManyColumns::bodies(const RigidBlocks<double>& blocks) const {
  static_assert(sizeof(Pose<double>) == 12 * sizeof(double) && sizeof(Vector6<double>) == 6 * sizeof(double) && sizeof(RigidInertia<double>) == 10 * sizeof(double));
  return {tree_.bodies(),
          tree_.parent.data(),
          tree_.dof_offset.data(),
          way_.data(),
          branches_.data(),
          reinterpret_cast<const double*>(blocks.pose.data()),
          reinterpret_cast<const double*>(blocks.inertia.data()),
          reinterpret_cast<const double*>(blocks.H.data()),
          reinterpret_cast<const double*>(blocks.G.data()),
          blocks.J.data(),
          blocks.D.data(),
          blocks.L.data(),
          blocks.d_offsets().data(),
          blocks.pivots(0),
          check_interrupt};
}

void ManyColumns::mass_matrix(const RigidBlocks<double>& blocks, bool with_hinge_diagonal, const double* x, double* y, int m, double* scratch) const {
  kernels_.mass_matrix[with_hinge_diagonal](bodies(blocks), x, y, m, scratch);
}

void ManyColumns::mass_matrix_inverse(const RigidBlocks<double>& blocks, const double* x, double* y, int m, double* scratch) const {
  kernels_.mass_matrix_inverse(bodies(blocks), x, y, m, scratch);
}

}  // namespace pycraft
