// What numbers of several states do on this machine: by the widest instruction set that it has and that was built, or by the one that the
// environment variable PYCRAFT_ISA names ("baseline", "avx2", "avx512"; on arm64 "neon").
#pragma once

#include <string>
#include <vector>

#include "lanes/program.h"
#include "lanes/turn_sines.h"

namespace pycraft::kernels {

struct LaneFunctions {
  int width;             // doubles in a vector
  Replay replays[3];     // by registers, few to many
  bool fuses;            // a product with the sum that it goes into
  void (*turn_sines)(double angle, double* out);
  int few;               // doubles in a narrow vector: of a state or two, for which wide ones are moved about in vain
  Replay of_few;         // of programs for those, the same bits
};

struct LaneSet {
  std::string name;
  LaneFunctions functions;
};

// What every machine of this kind has.
#if defined(__aarch64__)
inline constexpr const char* everywhere = "neon";  // part of every such processor
#else
inline constexpr const char* everywhere = "baseline";
#endif

// EvaluationError where PYCRAFT_ISA names a set that is not there or that this machine has not.
const LaneSet& lane_set();
// Those that were built and that this machine has, from narrow to wide.
const std::vector<LaneSet>& lane_sets();

}  // namespace pycraft::kernels
