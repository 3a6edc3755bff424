// The factorization A = L* D L of a tree's mass matrix (n x n, row-major), in place and without allocation, for any scalar: L unit lower
// triangular, last coordinate first. Eliminating outboard coordinates before inboard ones makes no fill-in: L(i,j) is nonzero only where
// j is on i's way to the base, and only there is A read. Cost Σ depth(i)²: O(N depth²). Noise is refused as by numerics/dense_factors.h,
// with w = L⁻¹e_k.
//
// Source: R. Featherstone, Rigid Body Dynamics Algorithms, Springer 2008, the chapter on forward dynamics by inertia matrix
// methods, branch-induced sparsity.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "algebra/language/structure.h"
#include "numerics/dense_factors.h"

namespace pycraft {

// The way of each coordinate to the base, in runs of consecutive ones: i, i-1, ..., start[i], then next[i], its run, and so on.
struct TreeOrder {
  std::vector<int> start, next;  // next: -1 at the base
  explicit TreeOrder(const SkoStructure& tree) : start(tree.coordinates()), next(tree.coordinates()) {
    std::vector<int> last(tree.bodies());  // the last coordinate at or inboard of a body
    for (int k = 0; k < tree.bodies(); ++k) {
      int before = tree.parent[k] < 0 ? -1 : last[tree.parent[k]];
      for (int i = tree.dof_offset[k]; i < tree.dof_offset[k + 1]; ++i) {
        const bool joins = before >= 0 && before == i - 1;
        start[i] = joins ? start[before] : i;
        next[i] = joins ? next[before] : before;
        before = i;
      }
      last[k] = before;
    }
  }
  int inboard(int i) const { return start[i] < i ? i - 1 : next[i]; }
  // f(first, last): coordinates first..last, run by run, from i itself inwards.
  template <class F>
  void way(int i, F f) const {
    for (; i >= 0; i = next[i]) f(start[i], i);
  }
};

// The lower triangle of A becomes L below the diagonal and D on it. work: 2n numbers.
template <class S>
PivotFailure<S> ldl_tip_to_base(const TreeOrder& order, S* A, int n, S* work) {
  using std::abs, std::sqrt;
  S *diagonal = work, *w = work + n;
  for (int i = 0; i < n; ++i) diagonal[i] = A[size_t(i) * n + i];
  for (int k = n - 1; k >= 0; --k) {
    S* row = A + size_t(k) * n;
    const S pivot = row[k], least = pivot_rounding<S>() * diagonal[k];
    if (!(pivot > least)) return {k, pivot, least};
    order.way(order.inboard(k), [&](int first, int last) {
      for (int i = last; i >= first; --i) {
        S* above = A + size_t(i) * n;
        const S factor = row[i] / pivot;
        order.way(i, [above, row, factor](int a, int b) {
          for (int j = a; j <= b; ++j) above[j] -= factor * row[j];
        });
        row[i] = factor;
      }
    });
  }
  for (int k = 0; k < n; ++k) {
    const S pivot = A[size_t(k) * n + k];
    if (!in_doubt(pivot, diagonal[k])) continue;
    S reach = sqrt(diagonal[k]);
    std::fill_n(w, n, S(0));
    w[k] = S(1);
    for (int j = k + 1; j < n; ++j) {  // L w = e_k
      const S* row = A + size_t(j) * n;
      order.way(order.inboard(j), [&](int a, int b) {
        for (int i = std::max(a, k); i <= b; ++i) w[j] -= row[i] * w[i];
      });
      reach += abs(w[j]) * sqrt(diagonal[j]);
    }
    if (const S bound = pivot_bound(reach); !(pivot > bound)) return {k, pivot, bound};
  }
  return {};
}

// x <- A⁻¹ x with L and D from ldl_tip_to_base: L* y = x outboard to inboard, D, then L inboard to outboard.
template <class S>
void ldl_solve(const TreeOrder& order, const S* A, int n, S* x) {
  for (int k = n - 1; k >= 0; --k) {
    const S* row = A + size_t(k) * n;
    const S xk = x[k];
    order.way(order.inboard(k), [&](int a, int b) {
      for (int j = a; j <= b; ++j) x[j] -= row[j] * xk;
    });
  }
  for (int k = 0; k < n; ++k) {
    const S* row = A + size_t(k) * n;
    S sum = x[k] / row[k];
    order.way(order.inboard(k), [&](int a, int b) {
      for (int j = a; j <= b; ++j) sum -= row[j] * x[j];
    });
    x[k] = sum;
  }
}

}  // namespace pycraft
