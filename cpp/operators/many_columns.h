// The operators of a robot on many columns by the kernels of kernels/body_columns.h: which of a body's numbers are exactly
// zero is found once for a state.
#pragma once

#include <vector>

#include "kernels/instruction_set.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

class ManyColumns {
 public:
  explicit ManyColumns(const SkoStructure& tree);
  // After kinematics.
  void see(const RigidBlocks<double>& blocks);
  void mass_matrix_inverse(const RigidBlocks<double>& blocks, const double* x, double* y, int m, double* scratch) const;
  void mass_matrix(const RigidBlocks<double>& blocks, bool with_hinge_diagonal, const double* x, double* y, int m, double* scratch) const;

 private:
  kernels::Bodies<double> bodies(const RigidBlocks<double>& blocks) const;
  const SkoStructure& tree_;
  const kernels::ColumnKernels<double>& kernels_;
  std::vector<unsigned char> branches_;
  std::vector<kernels::Way> way_;
};

}  // namespace pycraft
