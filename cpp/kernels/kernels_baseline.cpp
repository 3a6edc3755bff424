// Kernels for any machine of this kind: two doubles or four floats at once (SSE2 on x86-64, NEON on arm64).
#define PYCRAFT_INSTRUCTION_SET baseline
#include "kernels/kernels.h"

namespace pycraft::kernels {

namespace {

#if defined(PYCRAFT_X86_64)
// Only processors from before 2013 run this set. It has the six plain calls; the general recursions do the other calls, whose kernels would take
// most of the time that this source compiles.
template <class T, int W>
constexpr Kernels<T> calls_here() {
  using K = baseline::KernelsOf<T, W>;
  using S = typename K::S;
  Kernels<T> kernels{W, {}, {K::pieces().first, K::pieces().second}};
  const auto put = [&](Call call, Kernel<T> kernel) { kernels.calls[static_cast<int>(call)] = kernel; };
  put(Call::forward_dynamics, {K::template run<baseline::forward_dynamics<S>>, K::forward});
  put(Call::inverse_dynamics, {K::template run<baseline::inverse_dynamics<S>>, K::inverse});
  put(Call::mass_matrix, {K::template run<baseline::mass_matrix<S>>, K::matrix});
  put(Call::mass_matrix_inverse, {K::template run<baseline::mass_matrix_inverse<S>>, K::matrix_inverse});
  put(Call::jacobian, {K::template run<baseline::node_jacobian<S>>, K::nothing});
  put(Call::pose, {K::template run<baseline::node_pose<S>>, K::nothing});
  return kernels;
}
#else
template <class T, int W>
constexpr Kernels<T> calls_here() {
  return baseline::KernelsOf<T, W>::all;
}
#endif

}  // namespace

extern const Kernels<double> baseline_one, baseline_pack;
extern const Kernels<float> baseline_singles;
extern const ColumnKernels<double> baseline_columns;
const Kernels<double> baseline_one = calls_here<double, 1>(), baseline_pack = calls_here<double, 2>();
const Kernels<float> baseline_singles = calls_here<float, 4>();
const ColumnKernels<double> baseline_columns = baseline::column_kernels<double, 2>;

}  // namespace pycraft::kernels
