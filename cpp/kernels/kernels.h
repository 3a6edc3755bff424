// The kernels of one instruction set: what kernels_*.cpp give their names to.
#pragma once

#include "kernels/forward_dynamics.h"
#include "kernels/forward_dynamics_derivatives.h"
#include "kernels/inverse_dynamics.h"
#include "kernels/inverse_dynamics_derivatives.h"
#include "kernels/mass_matrix_of_links.h"
#include "kernels/mass_matrix_inverse.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class T, int W>
struct KernelsOf {
  using S = Lanes<T, W>;
  static size_t numbers(size_t bytes) { return (bytes + sizeof(T) - 1) / sizeof(T); }
  static size_t forward(const Links<T>& links) { return numbers(ForwardWork<S>::size(links)); }
  static size_t inverse(const Links<T>& links) { return numbers(links.count * sizeof(InverseLink<S>)); }
  static size_t matrix(const Links<T>& links) { return numbers(MatrixWork<S>::size(links)); }
  static size_t matrix_inverse(const Links<T>& links) { return numbers(ForwardWork<S>::size(links) + InverseWork<S>::size(links)); }
  static size_t inverse_derivatives(const Links<T>& links) { return numbers(InverseDerivativeWork<S>::size(links)); }
  static size_t forward_derivatives(const Links<T>& links) { return numbers(ForwardDerivativeWork<S>::size(links)); }
  static constexpr Kernels<T> all{W,
                                  {{forward_dynamics<S>, forward},
                                   {inverse_dynamics<S>, inverse},
                                   {mass_matrix<S>, matrix},
                                   {mass_matrix_inverse<S>, matrix_inverse},
                                   {inverse_dynamics_derivatives<S>, inverse_derivatives},
                                   {forward_dynamics_derivatives<S>, forward_derivatives}}};
};

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
