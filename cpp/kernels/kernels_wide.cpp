// Forward dynamics of one state in numbers wider than doubles, whose arithmetic is a library's or the old coprocessor's.
#define PYCRAFT_INSTRUCTION_SET wide
#include "numerics/scalar.h"
#include "lanes/sine_cosine.h"

#if defined(PYCRAFT_FLOAT128)
namespace pycraft::kernels::wide {

// Together they cost little more than one.
inline SineCosine<Lanes<Quad, 1>> sine_cosine(const Lanes<Quad, 1>& x) {
  Quad sine, cosine;
  sincosq(x.v.backend().value(), &sine.backend().value(), &cosine.backend().value());
  return {sine, cosine};
}

}  // namespace pycraft::kernels::wide
#endif

#include "kernels/forward_dynamics.h"

namespace pycraft::kernels {

namespace wide {

template <class T>
struct WideKernels {
  using S = Lanes<T, 1>;
  static unsigned run(const Links<T>& links, const States<T>& at, double* out, size_t stride, T* work) {
    return forward_dynamics<S>(links, with_turns(links, at, work), out, stride, work + turns_size(links));
  }
  static size_t size(const Links<T>& links, int) { return turns_size(links) + (ForwardWork<S>::size(links) + sizeof(T) - 1) / sizeof(T); }
  static constexpr Kernels<T> all{1, {{run, size}}, {}};
};

}  // namespace wide

extern const Kernels<Extended> extended_one;
extern const Kernels<Quad> quad_one;
const Kernels<Extended> extended_one = wide::WideKernels<Extended>::all;
#if defined(PYCRAFT_FLOAT128)
const Kernels<Quad> quad_one = wide::WideKernels<Quad>::all;
#else
const Kernels<Quad> quad_one{1, {}, {}};  // Boost's own, whose arithmetic would be written out at every sign of a sweep: the recursions do it
#endif

}  // namespace pycraft::kernels
