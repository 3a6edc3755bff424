// Programs done on AVX-512: eight states a vector.
#define PYCRAFT_INSTRUCTION_SET avx512
#include "lanes/replay.h"

namespace pycraft::kernels {

extern const LaneFunctions avx512_lanes;
const LaneFunctions avx512_lanes = avx512::lane_functions<8, 2, 4>;

}  // namespace pycraft::kernels
