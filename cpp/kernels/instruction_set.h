// The kernels of the instruction set that this machine runs (lanes/lane_sets.h).
#pragma once

#include <string>
#include <vector>

#include "kernels/bodies.h"
#include "kernels/links.h"

namespace pycraft::kernels {

struct InstructionSet {
  std::string name;
  Kernels<double> one, pack;  // one state; as many as there are lanes
  Kernels<float> singles;
  ColumnKernels<double> columns;
};

// EvaluationError where PYCRAFT_ISA names a set that is not there or that this machine has not.
const InstructionSet& instruction_set();
// Those that were built and that this machine has, from narrow to wide.
const std::vector<InstructionSet>& instruction_sets();

}  // namespace pycraft::kernels
