// The kernels of one instruction set: what kernels_*.cpp give their names to.
#pragma once

#include "kernels/forward_dynamics.h"
#include "kernels/inverse_dynamics.h"
#include "kernels/mass_matrix_of_links.h"
#include "kernels/mass_matrix_inverse.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

// On W states at once; of one state `neighbours` numbers go side by side where that is the same for all.
template <class T, int W, int neighbours = W>
struct KernelsOf {
  using S = Lanes<T, W>;
  static size_t numbers(const Links<T>& links, size_t bytes) { return (W == 1 ? turns_size<neighbours>(links) : 0) + (bytes + sizeof(T) - 1) / sizeof(T); }
  static size_t forward(const Links<T>& links) { return numbers(links, ForwardWork<S>::size(links)); }
  static size_t inverse(const Links<T>& links) { return numbers(links, links.count * sizeof(InverseLink<S>)); }
  static size_t matrix(const Links<T>& links) { return numbers(links, MatrixWork<S>::size(links)); }
  static size_t matrix_inverse(const Links<T>& links) { return numbers(links, ForwardWork<S>::size(links) + InverseWork<S>::size(links)); }

  template <auto kernel>
  static unsigned run(const Links<T>& links, const States<T>& at, double* out, size_t stride, T* work) {
    if constexpr (W > 1)
      return kernel(links, at, out, stride, work);
    else
      return kernel(links, with_turns<neighbours>(links, at, work), out, stride, work + turns_size<neighbours>(links));
  }
  static constexpr Kernels<T> all{W,
                                  {{run<forward_dynamics<S>>, forward},
                                   {run<inverse_dynamics<S>>, inverse},
                                   {run<mass_matrix<S>>, matrix},
                                   {run<mass_matrix_inverse<S>>, matrix_inverse}}};
};

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
