// Kernels for AVX2: four doubles or eight floats at once.
#define PYCRAFT_INSTRUCTION_SET avx2
#include "kernels/kernels.h"

namespace pycraft::kernels {

extern const Kernels<double> avx2_one, avx2_pack;
extern const Kernels<float> avx2_singles;
const Kernels<double> avx2_one = avx2::kernels_of<double, 1>, avx2_pack = avx2::kernels_of<double, 4>;
const Kernels<float> avx2_singles = avx2::kernels_of<float, 8>;

}  // namespace pycraft::kernels
