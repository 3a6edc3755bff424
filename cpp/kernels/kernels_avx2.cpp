// Kernels for AVX2: four doubles or eight floats at once.
#define PYCRAFT_INSTRUCTION_SET avx2
#include "kernels/kernels.h"

namespace pycraft::kernels {

extern const Kernels<double> avx2_one, avx2_pack;
extern const Kernels<float> avx2_singles;
extern const ColumnKernels<double> avx2_columns;
const Kernels<double> avx2_one = avx2::KernelsOf<double, 1>::all, avx2_pack = avx2::KernelsOf<double, 4>::all;
const Kernels<float> avx2_singles = avx2::KernelsOf<float, 8>::all;
const ColumnKernels<double> avx2_columns = avx2::column_kernels<double, 4>;

}  // namespace pycraft::kernels
