// Programs done on AVX2: four states a vector.
#define PYCRAFT_INSTRUCTION_SET avx2
#include "lanes/replay.h"

namespace pycraft::kernels {

extern const LaneFunctions avx2_lanes;
const LaneFunctions avx2_lanes = avx2::lane_functions<4, 4, 8>;

}  // namespace pycraft::kernels
