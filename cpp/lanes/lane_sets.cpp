#include "lanes/lane_sets.h"

#include <cstdlib>

#include "runtime/errors.h"

namespace pycraft::kernels {

extern const LaneFunctions baseline_lanes;
#if defined(PYCRAFT_X86_64)
extern const LaneFunctions avx2_lanes, avx512_lanes;
#endif

const std::vector<LaneSet>& lane_sets() {
  static const std::vector<LaneSet> sets = [] {
    std::vector<LaneSet> there{{everywhere, baseline_lanes}};
#if defined(PYCRAFT_X86_64)
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) {
      there.push_back({"avx2", avx2_lanes});
      if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw"))
        there.push_back({"avx512", avx512_lanes});
    }
#endif
    return there;
  }();
  return sets;
}

const LaneSet& lane_set() {
  static const LaneSet& chosen = []() -> const LaneSet& {
    const auto& there = lane_sets();
    const char* const wanted = std::getenv("PYCRAFT_ISA");
    if (!wanted || !*wanted) return there.back();
    std::string known;
    for (const LaneSet& set : there) {
      if (set.name == wanted) return set;
      known += (known.empty() ? "'" : ", '") + set.name + "'";
    }
    throw EvaluationError("PYCRAFT_ISA is '" + std::string(wanted) + "'; this machine and build have " + known);
  }();
  return chosen;
}

void turn_sines(double angle, double* out) { lane_set().functions.turn_sines(angle, out); }

}  // namespace pycraft::kernels
