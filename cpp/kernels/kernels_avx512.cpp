// Kernels for AVX-512: eight doubles or sixteen floats at once. One state is left to AVX2.
#define PYCRAFT_INSTRUCTION_SET avx512
#include "kernels/kernels.h"

namespace pycraft::kernels {

extern const Kernels<double> avx512_pack;
extern const Kernels<float> avx512_singles;
extern const ColumnKernels<double> avx512_columns;
const Kernels<double> avx512_pack = avx512::KernelsOf<double, 8>::all;
const Kernels<float> avx512_singles = avx512::KernelsOf<float, 16>::all;
const ColumnKernels<double> avx512_columns = avx512::column_kernels<double, 8>;

}  // namespace pycraft::kernels
