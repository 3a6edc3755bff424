// What the rounding of a residual can make of the correction that is solved from it.
//
// A residual r = b - (HφMφ*H* + J) x is formed by two sweeps. They round every motion α(k) by u A(k), every force f(k) by u F(k) and every
// entry of r by u T, with sizes A, F, T of the terms that are added there. The correction made of it, δ = (ℳ + J)⁻¹ r, so contains
//
//   n = (ℳ + J)⁻¹ (Hφ (Mφ* δα + δf) + δT),     |δα| <= u A,  |δf| <= u F,  |δT| <= u T
//
// Along a direction w (2-norm 1), with y = (ℳ + J)⁻¹ w, g = φ*H* y and e = φM g, that is at most
//
//   w* n <= u (Σ |e|* A + Σ |g|* F + Σ |y|* T)
//
// whatever the signs: bound and adjoint are exact, and cost one solve and one gather. Taken along δ itself it tells whether δ may be
// nothing but rounding: then w* n = |δ|.
//
// Source: the componentwise analysis of iterative refinement, N. J. Higham, Accuracy and Stability of Numerical Algorithms, SIAM 2002,
// chapter 12, carried through the sweeps. Cost O(N m).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "algebra/language/residual_sizes.h"
#include "algebra/trees/sweeps/mass_matrix.h"

namespace pycraft {

// The sizes of b - (HφMφ*H* + J) x, m columns.
template <class Blocks, class S>
void residual_sizes(const SkoStructure& tree, const Blocks& blocks, const S* x, const S* b, int m, const RoundingUnits<S>& units, ResidualSizes<S>& sizes) {
  using std::abs;
  sizes.resize(tree, m);
  S *alpha = sizes.g.data(), *f = sizes.f.data();
  const auto row = [&](S* v, int k) { return v + size_t(tree.offset[k]) * m; };
  std::fill_n(alpha, size_t(tree.dimension()) * m, S(0));
  for (int k = 0; k < tree.bodies(); ++k) {
    const int p = tree.parent[k];
    const S *from = p < 0 ? nullptr : row(alpha, p), *xk = x + size_t(tree.dof_offset[k]) * m;
    if (from) blocks.shift_transposed_add(k, from, row(alpha, k), m);
    blocks.hinge_transposed_add(k, xk, row(alpha, k), m);
    blocks.motion_sizes(k, from, xk, row(alpha, k), row(sizes.motion.data(), k), m);
    blocks.inertia_sizes(k, row(alpha, k), units, row(sizes.force.data(), k), m);
    std::copy_n(row(alpha, k), size_t(tree.size[k]) * m, row(f, k));
    blocks.inertia_in_place(k, row(f, k), m);
  }
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    S* coordinate = sizes.coordinate.data() + size_t(tree.dof_offset[k]) * m;
    const size_t at = size_t(tree.dof_offset[k]) * m;
    blocks.coordinate_sizes(k, row(f, k), x + at, units, coordinate, m);
    for (size_t i = 0; i < size_t(tree.dof[k]) * m; ++i) coordinate[i] += units.force * abs(b[at + i]);
    if (const int p = tree.parent[k]; p >= 0) {
      blocks.shift_add(k, row(f, k), row(f, p), m);
      blocks.shifted_force_sizes(k, row(f, k), units, row(sizes.force.data(), p), m);
    }
  }
  for (size_t i = 0; i < size_t(tree.dimension()) * m; ++i) sizes.motion[i] *= units.motion;
}

// u (Σ |e|* A + Σ |g|* F + Σ |y|* T) of every column, with y and g of sizes.
template <class Blocks, class S>
void rounding_of_response(const SkoStructure& tree, const Blocks& blocks, int m, ResidualSizes<S>& sizes, S* out) {
  using std::abs;
  S* e = sizes.f.data();
  std::copy_n(sizes.g.data(), size_t(tree.dimension()) * m, e);
  for (int k = 0; k < tree.bodies(); ++k) blocks.inertia_in_place(k, e + size_t(tree.offset[k]) * m, m);
  for (int k = tree.bodies() - 1; k >= 0; --k)
    if (tree.parent[k] >= 0) blocks.shift_add(k, e + size_t(tree.offset[k]) * m, e + size_t(tree.offset[tree.parent[k]]) * m, m);
  std::fill_n(out, m, S(0));
  const auto add = [&](const std::vector<S>& adjoint, const std::vector<S>& size, int rows) {
    for (size_t i = 0, at = 0; i < size_t(rows); ++i)
      for (int c = 0; c < m; ++c, ++at) out[c] += abs(adjoint[at]) * size[at];
  };
  add(sizes.f, sizes.motion, tree.dimension());
  add(sizes.g, sizes.force, tree.dimension());
  add(sizes.y, sizes.coordinate, tree.coordinates());
}

// The most that rounding makes of the correction along w, of every column of it.
template <class Blocks, class S>
void rounding_along(const SkoStructure& tree, const Blocks& blocks, const S* w, int m, ResidualSizes<S>& sizes, S* out) {
  mass_matrix_inverse_apply(tree, blocks, w, sizes.y.data(), m, sizes.g.data());
  rounding_of_response(tree, blocks, m, sizes, out);
}

// The same of one column where y = solve(w) is found otherwise.
template <class Blocks, class S, class Solve>
void rounding_along(const SkoStructure& tree, const Blocks& blocks, const Solve& solve, const S* w, ResidualSizes<S>& sizes, S* out) {
  S *y = sizes.y.data(), *g = sizes.g.data();
  solve(w, y);
  std::fill_n(g, tree.dimension(), S(0));
  for (int k = 0; k < tree.bodies(); ++k) {
    if (const int p = tree.parent[k]; p >= 0) blocks.shift_transposed_add(k, g + tree.offset[p], g + tree.offset[k], 1);
    blocks.hinge_transposed_add(k, y + tree.dof_offset[k], g + tree.offset[k], 1);
  }
  rounding_of_response(tree, blocks, 1, sizes, out);
}

// The residual that errors u A, u F, u T with the signs of the last rounding_along (m = 1) make, in sizes.y: no errors of these sizes move
// w* n farther. work: nv numbers.
template <class Blocks, class S>
void worst_residual(const SkoStructure& tree, const Blocks& blocks, ResidualSizes<S>& sizes, S* work) {
  const auto with_sign = [](const S& size, const S& sign) { return sign < S(0) ? S(-size) : size; };
  S *motion = sizes.f.data(), *force = sizes.g.data(), *r = sizes.y.data();
  for (int i = 0; i < tree.dimension(); ++i) motion[i] = with_sign(sizes.motion[i], motion[i]), force[i] = with_sign(sizes.force[i], force[i]);
  for (int j = 0; j < tree.coordinates(); ++j) r[j] = with_sign(sizes.coordinate[j], r[j]);
  for (int k = 0; k < tree.bodies(); ++k)
    if (const int p = tree.parent[k]; p >= 0) blocks.shift_transposed_add(k, motion + tree.offset[p], motion + tree.offset[k], 1);
  for (int k = tree.bodies() - 1; k >= 0; --k) {
    S *fk = force + tree.offset[k], *mk = motion + tree.offset[k];
    blocks.inertia_in_place(k, mk, 1);
    for (int i = 0; i < tree.size[k]; ++i) fk[i] += mk[i];
    blocks.hinge(k, fk, work + tree.dof_offset[k], 1);
    if (const int p = tree.parent[k]; p >= 0) blocks.shift_add(k, fk, force + tree.offset[p], 1);
  }
  for (int j = 0; j < tree.coordinates(); ++j) r[j] += work[j];
}

// The most that rounding makes of a correction in any direction, 2-norm. w: nv numbers, the direction to begin with, which are overwritten.
// along(w): rounding_along; correct(w): w = (ℳ + J)⁻¹ of the worst residual. From any direction the worst signs along it and what they make are
// found in turn: each is at least as long as the one before (W. W. Hager, Condition estimates, 1984, in the 2-norm), and two turns come close
// to the longest.
template <class S, class Along, class Correct>
S most_rounding(std::vector<S>& w, const Along& along, const Correct& correct) {
  using std::sqrt;
  const auto length = [&] {
    S square = S(0);
    for (const S& y : w) square += y * y;
    return S(sqrt(square));
  };
  S reached = S(0);
  for (int turn = 0; turn < 3; ++turn) {
    S size = length();
    if (!(size > S(0))) {  // no direction: all coordinates, with signs that alternate
      for (size_t i = 0; i < w.size(); ++i) w[i] = i % 2 ? S(-1) : S(1);
      size = S(sqrt(S(static_cast<double>(w.size()))));
    }
    reached = maximum(reached, turn ? size : S(0));
    for (S& y : w) y /= size;
    reached = maximum(reached, along(w.data()));
    if (turn < 2) correct(w.data());
  }
  return reached;
}

}  // namespace pycraft
