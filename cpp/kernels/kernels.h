// The kernels of one instruction set: what kernels_*.cpp give their names to.
#pragma once

#include <utility>

#include "kernels/body_columns.h"
#include "kernels/coriolis_matrix.h"
#include "kernels/factored_dynamics.h"
#include "kernels/forward_dynamics.h"
#include "kernels/forward_dynamics_derivatives.h"
#include "kernels/in_parts.h"
#include "kernels/inverse_dynamics.h"
#include "kernels/inverse_dynamics_derivatives.h"
#include "kernels/link_columns.h"
#include "kernels/mass_matrix_of_columns.h"
#include "kernels/mass_matrix_of_links.h"
#include "kernels/mass_matrix_inverse.h"
#include "kernels/node_kinematics.h"
#include "kernels/operational_space.h"
#include "kernels/refined_dynamics.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class T, int W>
constexpr ColumnKernels<T> column_kernels{of_columns<MassMatrixInverse, T, W>,
                                          {of_columns<MassMatrix<false>, T, W>, of_columns<MassMatrix<true>, T, W>},
                                          {kept_of_links<T>, eliminate_at_q<T>, of_columns<InverseOfLinks, T, 1>, of_columns<InverseOfLinks, T, W>}};

template <class T, int W>
struct KernelsOf {
  using S = Lanes<T, W>;
  static size_t numbers(const Links<T>& links, size_t bytes) { return (W == 1 ? turns_size(links) : 0) + (bytes + sizeof(T) - 1) / sizeof(T); }
  static size_t forward(const Links<T>& links, int) { return numbers(links, ForwardWork<S>::size(links)); }
  static size_t inverse(const Links<T>& links, int) { return numbers(links, links.count * sizeof(InverseLink<S>)); }
  static size_t matrix(const Links<T>& links, int) { return numbers(links, MatrixWork<S>::size(links)); }
  static size_t matrix_inverse(const Links<T>& links, int) { return numbers(links, ForwardWork<S>::size(links) + InverseWork<S>::size(links)); }

  static size_t inverse_derivatives(const Links<T>& links, int) { return numbers(links, InverseDerivativeWork<S>::size(links)); }
  static size_t forward_derivatives(const Links<T>& links, int) { return numbers(links, ForwardDerivativeWork<S>::size(links)); }
  static size_t coriolis(const Links<T>& links, int) { return numbers(links, CoriolisWork<S>::size(links)); }
  static size_t operational(const Links<T>& links, int nodes) { return numbers(links, ForwardWork<S>::size(links) + NodeWork<S>::size(links, nodes)); }
  static size_t factored(const Links<T>& links, int) { return numbers(links, FactoredWork<S>::size(links)); }
  template <class V>
  static size_t refined(const Links<T>& links, int) { return numbers(links, RefinedWork<S, V>::size(links)); }
  template <class V>
  static size_t refined_factors(const Links<T>& links, int) { return numbers(links, RefinedWork<S, V>::size(links) + FactoredWork<S>::own_size(links)); }
  static size_t nothing(const Links<T>& links, int) { return numbers(links, 0); }

  template <auto kernel>
  static unsigned run(const Links<T>& links, const States<T>& at, double* out, size_t stride, T* work) {
    if constexpr (W > 1) return kernel(links, at, out, stride, work);
    const States<T> turned = with_turns(links, at, work);
    return kernel(links, turned, out, stride, work + turns_size(links));
  }
  // Of one state, with all in it that is not apart by itself: a compiler would leave pieces of it to be called.
  template <auto kernel>
  [[gnu::flatten]] static unsigned run_whole(const Links<T>& links, const States<T>& at, double* out, size_t stride, T* work) {
    return run<kernel>(links, at, out, stride, work);
  }
  // Derivatives and what is made like them in double alone, in packs where registers hold four: they are most of what there is to compile.
  static constexpr bool differentiates = sizeof(T) == sizeof(double) && (W == 1 || neighbours<T> >= 4);
  static constexpr Kernel<T> derivatives_of_forces() {
    if constexpr (differentiates) return {W == 1 ? run_whole<inverse_dynamics_derivatives<S>> : run<inverse_dynamics_derivatives<S>>, inverse_derivatives};
    return {};
  }
  static constexpr Kernel<T> derivatives_of_accelerations() {
    if constexpr (differentiates) return {W == 1 ? run_whole<forward_dynamics_derivatives<S>> : run<forward_dynamics_derivatives<S>>, forward_derivatives};
    return {};
  }
  static constexpr std::pair<PartKernel<T>, PartKernel<T>> pieces() {
    if constexpr (W == 1) return {InParts<T>::forward_dynamics, InParts<T>::inverse_dynamics};
    return {};
  }
  template <bool skew>
  static constexpr Kernel<T> coriolis_matrices() {
    if constexpr (differentiates) return {run<coriolis_matrix<S, skew>>, coriolis};
    return {};
  }
  template <bool inverse>
  static constexpr Kernel<T> of_operational_space() {
    if constexpr (differentiates) return {run<operational_space<S, inverse>>, operational};
    return {};
  }
  // Refined in double alone, too. V: what forces are gathered in.
  template <class V>
  static constexpr Kernel<T> refinement() {
    if constexpr (differentiates) return {W == 1 ? run_whole<refined_dynamics<S, V>> : run<refined_dynamics<S, V>>, refined<V>};
    return {};
  }
  template <class V, bool roots>
  static constexpr Kernel<T> refinement_of_factors() {
    if constexpr (differentiates) return {run<refined_dynamics_by_factors<S, V, roots>>, refined_factors<V>};
    return {};
  }
  static constexpr Kernels<T> all{W,
                                  {{W == 1 ? run_whole<forward_dynamics<S>> : run<forward_dynamics<S>>, forward},
                                   {run<inverse_dynamics<S>>, inverse},
                                   {W == 1 ? run_whole<mass_matrix<S>> : run<mass_matrix<S>>, matrix},
                                   {W == 1 ? run_whole<mass_matrix_inverse<S>> : run<mass_matrix_inverse<S>>, matrix_inverse},
                                   derivatives_of_forces(),
                                   derivatives_of_accelerations(),
                                   {run<node_jacobian<S>>, nothing},
                                   {run<node_pose<S>>, nothing},
                                   coriolis_matrices<false>(),
                                   coriolis_matrices<true>(),
                                   of_operational_space<false>(),
                                   of_operational_space<true>(),
                                   refinement<S>(),
                                   refinement<Wide<S>>(),
                                   {run<forward_dynamics_by_factors<S, false>>, factored},
                                   refinement_of_factors<S, false>(),
                                   refinement_of_factors<Wide<S>, false>(),
                                   {run<forward_dynamics_by_factors<S, true>>, factored},
                                   refinement_of_factors<S, true>(),
                                   refinement_of_factors<Wide<S>, true>()},
                                  {pieces().first, pieces().second}};
};

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
