#include "operators/many_columns.h"

#include "kernels/instruction_set.h"
#include "kernels/recorded_columns.h"
#include "runtime/interrupt.h"

namespace pycraft {

using kernels::Way;

namespace {

template <class S>
const kernels::ColumnKernels<S>& column_kernels() {
  if constexpr (is_recorded<S>)
    return kernels::recorded_columns;
  else
    return kernels::instruction_set().columns;
}

// R mixes no other axis with coordinate axis K.
template <class S>
bool about(int K, const Matrix3<S>& R) {
  const int i = (K + 1) % 3, j = (K + 2) % 3;
  return R(i, K) == S(0) && R(j, K) == S(0) && R(K, i) == S(0) && R(K, j) == S(0);
}

}  // namespace

template <class S>
ManyColumns<S>::ManyColumns(const SkoStructure& tree)
    : tree_(tree), branches_(tree.bodies()), way_(tree.bodies(), Way::any) {
  for (int k = 0; k < tree.bodies(); ++k)
    if (const int p = tree.parent[k]; p >= 0 && p != k - 1) branches_[p] = true;
}

template <class S>
void ManyColumns<S>::see(const RigidBlocks<S>& blocks) {
  for (int k = 0; k < tree_.bodies(); ++k) {
    const int axis = tree_.dof[k] == 1 ? blocks.aligned[tree_.dof_offset[k]] : -1;
    const bool pin = axis >= 0 && axis < 3;
    way_[k] = pin ? static_cast<Way>(static_cast<int>(about(axis, blocks.pose[k].R) ? Way::level_x : Way::pin_x) + axis) : Way::any;
  }
}

template <class S>
kernels::Bodies<S> ManyColumns<S>::bodies(const RigidBlocks<S>& blocks) const {
  static_assert(sizeof(Pose<S>) == 12 * sizeof(S) && sizeof(Vector6<S>) == 6 * sizeof(S) && sizeof(RigidInertia<S>) == 10 * sizeof(S));
  return {tree_.bodies(),
          tree_.parent.data(),
          tree_.dof_offset.data(),
          way_.data(),
          branches_.data(),
          reinterpret_cast<const S*>(blocks.pose.data()),
          reinterpret_cast<const S*>(blocks.inertia.data()),
          reinterpret_cast<const S*>(blocks.H.data()),
          reinterpret_cast<const S*>(blocks.G.data()),
          blocks.J.data(),
          blocks.D.data(),
          blocks.L.data(),
          blocks.d_offsets().data(),
          blocks.pivots(0),
          check_interrupt};
}

template <class S>
void ManyColumns<S>::mass_matrix(const RigidBlocks<S>& blocks, bool with_hinge_diagonal, const S* x, S* y, int m, S* scratch) const {
  column_kernels<S>().mass_matrix[with_hinge_diagonal](bodies(blocks), x, y, m, scratch);
}

template <class S>
void ManyColumns<S>::mass_matrix_inverse(const RigidBlocks<S>& blocks, const S* x, S* y, int m, S* scratch) const {
  column_kernels<S>().mass_matrix_inverse(bodies(blocks), x, y, m, scratch);
}

template class ManyColumns<double>;
template class ManyColumns<Recorded>;

}  // namespace pycraft
