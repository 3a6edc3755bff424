#include "kernels/instruction_set.h"

#include <cstdlib>

#include "runtime/errors.h"

namespace pycraft::kernels {

extern const Kernels<double> baseline_one, baseline_pack;
extern const Kernels<float> baseline_singles;
extern const ColumnKernels<double> baseline_columns;
#if defined(PYCRAFT_X86_64)
extern const Kernels<double> avx2_one, avx2_pack, avx512_pack;
extern const Kernels<float> avx2_singles, avx512_singles;
extern const ColumnKernels<double> avx2_columns, avx512_columns;
#endif

#if defined(__aarch64__)
constexpr const char* everywhere = "neon";  // part of every such processor
#else
constexpr const char* everywhere = "baseline";
#endif

const std::vector<InstructionSet>& instruction_sets() {
  static const std::vector<InstructionSet> sets = [] {
    std::vector<InstructionSet> there{{everywhere, baseline_one, baseline_pack, baseline_singles, baseline_singles, baseline_columns}};
#if defined(PYCRAFT_X86_64)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
      there.push_back({"avx2", avx2_one, avx2_pack, avx2_singles, avx2_singles, avx2_columns});
      if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
        there.push_back({"avx512", avx2_one, avx512_pack, avx512_singles, avx2_singles, avx512_columns});  // one state has nothing to fill wider registers with
    }
#endif
    return there;
  }();
  return sets;
}

const InstructionSet& instruction_set() {
  static const InstructionSet& chosen = []() -> const InstructionSet& {
    const auto& there = instruction_sets();
    const char* const wanted = std::getenv("PYCRAFT_ISA");
    if (!wanted || !*wanted) return there.back();
    std::string known;
    for (const InstructionSet& set : there) {
      if (set.name == wanted) return set;
      known += (known.empty() ? "'" : ", '") + set.name + "'";
    }
    throw EvaluationError("PYCRAFT_ISA is '" + std::string(wanted) + "'; this machine and build have " + known);
  }();
  return chosen;
}

}  // namespace pycraft::kernels
