// Kernels for any machine of this kind: two doubles or four floats at once (SSE2 on x86-64, NEON on arm64).
#define PYCRAFT_INSTRUCTION_SET baseline
#include "kernels/kernels.h"

namespace pycraft::kernels {

extern const Kernels<double> baseline_one, baseline_pack;
extern const Kernels<float> baseline_singles;
extern const ColumnKernels<double> baseline_columns;
const Kernels<double> baseline_one = baseline::KernelsOf<double, 1>::all, baseline_pack = baseline::KernelsOf<double, 2>::all;
const Kernels<float> baseline_singles = baseline::KernelsOf<float, 4>::all;
const ColumnKernels<double> baseline_columns = baseline::column_kernels<double, 2>;

}  // namespace pycraft::kernels
