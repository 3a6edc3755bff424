// The inverse of the mass matrix, entry by entry, by the innovations factors (ℳ + J)⁻¹ = [I - HψK]* D⁻¹ [I - HψK]:
//
//   tip to base, for the coordinates i of body k and the columns c of them and of all outboard; δ Kronecker's, z(c) = 0 at first:
//     ε(i,c) = δ(i,c) - H(i) z(c),   ν(k,c) = D(k)⁻¹ ε(k,c),   z(c) <- φ(p,k) (z(c) + G(k) ε(k,c))
//   base to tip, for the columns c from those of k on:
//     α(c) <- φ*(p,k) α(c),   (ℳ + J)⁻¹(k,c) = ν(k,c) - G(k)* α(c),   α(c) <- α(c) + H(k)* (ℳ + J)⁻¹(k,c)
//
// Bodies stand depth first, so the columns outboard of one are neighbours, and every loop runs along rows. The lower triangle is a copy.
// Cost O(N · depth) tip to base and N²/2 base to tip; 6 N numbers for every branch that waits for its turn.
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, operator factorization and inversion of the mass matrix.
#pragma once

#include <algorithm>
#include <vector>

#include "rigid/rigid_blocks.h"
#include "runtime/interrupt.h"

namespace pycraft {

// What it works in, kept from call to call.
template <class S>
struct InverseColumns {
  std::vector<S> z, innovations, alpha;  // (6, nv); (coordinates of one hinge, nv); (6, nv) a slot
  std::vector<int> end, slot, free;      // the first column past those outboard; where a body's α is
};

// y(c) <- y(c) + x(c) h, with the six entries of y(c) a stride apart.
template <class S>
inline void add_along(const Vector6<S>& h, const S* __restrict x, S* __restrict y, int stride, int columns) {
  for (int a = 0; a < 6; ++a) {
    const S factor = h[a];
    S* __restrict row = y + size_t(a) * stride;
    for (int c = 0; c < columns; ++c) row[c] += factor * x[c];
  }
}
// x(c) <- x(c) - h · y(c).
template <class S>
inline void subtract_across(const Vector6<S>& h, const S* __restrict y, S* __restrict x, int stride, int columns) {
  const S *__restrict y0 = y, *__restrict y1 = y + stride, *__restrict y2 = y + 2 * size_t(stride), *__restrict y3 = y + 3 * size_t(stride),
          *__restrict y4 = y + 4 * size_t(stride), *__restrict y5 = y + 5 * size_t(stride);
  const S h0 = h[0], h1 = h[1], h2 = h[2], h3 = h[3], h4 = h[4], h5 = h[5];
  for (int c = 0; c < columns; ++c) x[c] -= h0 * y0[c] + h1 * y1[c] + h2 * y2[c] + h3 * y3[c] + h4 * y4[c] + h5 * y5[c];
}
// y(c) <- f(y(c)).
template <class S, class F>
inline void move_columns(S* y, int stride, int columns, F f) {
  S *__restrict y0 = y, *__restrict y1 = y + stride, *__restrict y2 = y + 2 * size_t(stride), *__restrict y3 = y + 3 * size_t(stride),
    *__restrict y4 = y + 4 * size_t(stride), *__restrict y5 = y + 5 * size_t(stride);
  for (int c = 0; c < columns; ++c) {
    const Vector6<S> moved = f(Vector6<S>{{y0[c], y1[c], y2[c]}, {y3[c], y4[c], y5[c]}});
    y0[c] = moved.angular[0], y1[c] = moved.angular[1], y2[c] = moved.angular[2];
    y3[c] = moved.linear[0], y4[c] = moved.linear[1], y5[c] = moved.linear[2];
  }
}

// Rows of ν, in their columns; the others are zero.
template <class S>
void innovations_tip_to_base(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, InverseColumns<S>& w, S* out) {
  const int N = model.nv;
  int widest = 0;  // hinges of one's own may have more coordinates than six
  for (const int n : model.nv_of) widest = std::max(widest, n);
  w.z.resize(size_t(6) * N), w.innovations.resize(size_t(widest) * N), w.end.resize(model.bodies);
  for (int k = 0; k < model.bodies; ++k) w.end[k] = model.v_offset[k] + model.nv_of[k];
  for (int k = model.bodies - 1; k >= 0; --k) {
    check_interrupt_at(k, N);
    const int first = model.v_offset[k], n = model.nv_of[k], end = w.end[k], width = end - first, p = model.parent[k];
    S *const e = w.innovations.data(), *const z = w.z.data() + first;
    for (int a = 0; a < 6; ++a) std::fill_n(z + size_t(a) * N, n, S(0));
    for (int i = 0; i < n; ++i) {
      S* const row = e + size_t(i) * width;
      std::fill_n(row, width, S(0));
      row[i] = S(1);
      subtract_across(blocks.H[first + i], z + n, row + n, N, width - n);
    }
    for (int i = 0; i < n && p >= 0; ++i) add_along(blocks.G[first + i], e + size_t(i) * width, z, N, width);
    blocks.solve_D_in_place(k, e, width);
    for (int i = 0; i < n; ++i) {
      S* const row = out + size_t(first + i) * N;
      std::copy_n(e + size_t(i) * width, width, row + first);
      std::fill(row + end, row + N, S(0));
    }
    if (p < 0) continue;
    w.end[p] = std::max(w.end[p], end);
    move_columns(z, N, width, [X = blocks.pose[k]](const Vector6<S>& f) { return force_to_parent(X, f); });
  }
}

template <class S>
void inverse_mass_matrix(const SkoStructure& tree, const CompiledModel<S>& model, const RigidBlocks<S>& blocks, InverseColumns<S>& w, S* out) {
  const int N = model.nv;
  const size_t size = size_t(6) * N;
  innovations_tip_to_base(model, blocks, w, out);
  w.slot.resize(model.bodies);
  w.free.clear();
  int slots = 0;
  for (int k = 0; k < model.bodies; ++k) {
    check_interrupt_at(k, N);
    const int first = model.v_offset[k], n = model.nv_of[k], p = model.parent[k];
    const bool in_place = p >= 0 && tree.last_child[p] == k;  // the last to read its parent's α takes its place
    if (in_place) {
      w.slot[k] = w.slot[p];
    } else if (w.free.empty()) {
      w.slot[k] = slots++;
      w.alpha.resize(std::max(w.alpha.size(), slots * size));
    } else {
      w.slot[k] = w.free.back();
      w.free.pop_back();
    }
    S* const alpha = w.alpha.data() + w.slot[k] * size + first;
    for (int a = 0; a < 6 && !in_place; ++a) {
      S* const row = alpha + size_t(a) * N;
      if (p < 0)
        std::fill_n(row, N - first, S(0));
      else
        std::copy_n(w.alpha.data() + w.slot[p] * size + size_t(a) * N + first, N - first, row);
    }
    if (p >= 0) {
      move_columns(alpha, N, N - first, [X = blocks.pose[k]](const Vector6<S>& V) { return motion_to_child(X, V); });
      for (int j = first; j < first + n; ++j) subtract_across(blocks.G[j], alpha, out + size_t(j) * N + first, N, N - first);
    }
    if (tree.last_child[k] < 0)
      w.free.push_back(w.slot[k]);
    else
      for (int j = first; j < first + n; ++j) add_along(blocks.H[j], out + size_t(j) * N + first, alpha, N, N - first);
  }
  constexpr int tile = 32;
  for (int top = 0; top < N; top += tile)
    for (int left = 0; left <= top; left += tile)
      for (int i = top; i < std::min(top + tile, N); ++i)
        for (int j = left; j < std::min(left + tile, i); ++j) out[size_t(i) * N + j] = out[size_t(j) * N + i];
}

}  // namespace pycraft
