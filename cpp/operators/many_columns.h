// The operators of a robot on many columns by the kernels of kernels/body_columns.h: which of a body's numbers are exactly
// zero is found once for a state.
#pragma once

#include <vector>

#include "kernels/bodies.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

// In double, and recorded as it is done in double.
template <class S>
inline constexpr bool by_columns = std::is_same_v<S, double> || is_recorded<S>;

template <class S>
class ManyColumns {
 public:
  explicit ManyColumns(const SkoStructure& tree);
  // After kinematics.
  void see(const RigidBlocks<S>& blocks);
  void mass_matrix_inverse(const RigidBlocks<S>& blocks, const S* x, S* y, int m, S* scratch) const;
  void mass_matrix(const RigidBlocks<S>& blocks, bool with_hinge_diagonal, const S* x, S* y, int m, S* scratch) const;

 private:
  kernels::Bodies<S> bodies(const RigidBlocks<S>& blocks) const;
  const SkoStructure& tree_;
  std::vector<unsigned char> branches_;
  std::vector<kernels::Way> way_;
};

// Other scalars go by the sweeps.
template <class S>
  requires(!by_columns<S>)
class ManyColumns<S> {
 public:
  explicit ManyColumns(const SkoStructure&) {}
};

}  // namespace pycraft
