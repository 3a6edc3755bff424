// Programs done on any machine of this kind: two states a vector (SSE2 on x86-64, NEON on arm64).
#define PYCRAFT_INSTRUCTION_SET baseline
#include "lanes/replay.h"

namespace pycraft::kernels {

extern const LaneFunctions baseline_lanes;
const LaneFunctions baseline_lanes = baseline::lane_functions<2, 4, 8>;

}  // namespace pycraft::kernels
