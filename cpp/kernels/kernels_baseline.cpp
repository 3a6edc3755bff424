// Kernels for any machine of this kind: two doubles or four floats at once (SSE2 on x86-64, NEON on arm64).
#define PYCRAFT_INSTRUCTION_SET baseline
#include "kernels/kernels.h"

namespace pycraft::kernels {

extern const Kernels<double> baseline_one, baseline_pack;
extern const Kernels<float> baseline_singles;
const Kernels<double> baseline_one = baseline::kernels_of<double, 1>, baseline_pack = baseline::kernels_of<double, 2>;
const Kernels<float> baseline_singles = baseline::kernels_of<float, 4>;

}  // namespace pycraft::kernels
