#include "kernels/instruction_set.h"

#include <algorithm>

#include "lanes/lane_sets.h"

namespace pycraft::kernels {

extern const Kernels<double> baseline_one, baseline_pack;
extern const Kernels<float> baseline_singles;
extern const ColumnKernels<double> baseline_columns;
#if defined(PYCRAFT_X86_64)
extern const Kernels<double> avx2_one, avx2_pack, avx512_pack;
extern const Kernels<float> avx2_singles, avx512_singles;
extern const ColumnKernels<double> avx2_columns, avx512_columns;
#endif

#if defined(PYCRAFT_X86_64)
namespace {

// One state, and one column at it, have nothing to fill wider registers with.
ColumnKernels<double> with_one_of(const ColumnKernels<double>& narrower, ColumnKernels<double> columns) {
  columns.links.eliminate = narrower.links.eliminate, columns.links.one = narrower.links.one;
  return columns;
}

}  // namespace
#endif

const std::vector<InstructionSet>& instruction_sets() {
  static const std::vector<InstructionSet> sets = [] {
    std::vector<InstructionSet> there{{everywhere, baseline_one, baseline_pack, baseline_singles, baseline_singles, baseline_columns}};
#if defined(PYCRAFT_X86_64)
    there.push_back({"avx2", avx2_one, avx2_pack, avx2_singles, avx2_singles, avx2_columns});
    there.push_back({"avx512", avx2_one, avx512_pack, avx512_singles, avx2_singles, with_one_of(avx2_columns, avx512_columns)});
#endif
    std::erase_if(there, [](const InstructionSet& built) {
      return std::none_of(lane_sets().begin(), lane_sets().end(), [&](const LaneSet& set) { return set.name == built.name; });
    });
    return there;
  }();
  return sets;
}

const InstructionSet& instruction_set() {
  static const InstructionSet& chosen =
      *std::find_if(instruction_sets().begin(), instruction_sets().end(), [](const InstructionSet& set) { return set.name == lane_set().name; });
  return chosen;
}

}  // namespace pycraft::kernels
