// Columns of ℳ^-½Q* by the articulated bodies' factors, of the rows of all loops at a state, without ℳ:
//
//   ℳ⁻¹ = [I - HψK]* D⁻¹ [I - HψK],    W = D^-½ [I - HψK] Q*,    Q ℳ⁻¹ Q* = W* W = A B*ΩB A*
//
// the operational-space compliance of the loops' ends, row by row of Q, tip to base, over the hinges of the row and all inboard of them:
//
//   ε(k) = Q*(k) - H(k) z(k),   w(k) = d^-½ L⁻¹ ε(k)  with D(k) = L d L*,   z(p) <- z(p) + φ(p,k) (z(k) + G(k) ε(k))
//
// Loops share hinges inboard of them, and what hangs so together, directly or by others, is a group: of rows of two groups the products in
// W* W are zero, and each is solved for by itself. Cost O(depth) a row, and what the groups' own factors cost.
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011 (tree augmentation).
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/unit_data.h"
#include "numerics/small_ldl.h"
#include "recursions/loop_rows.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

// Q by rows, without zeros that are none by meaning, and of each entry the size of what it is the sum of: its rounding, by epsilon.
template <class S>
struct LoopRows {
  struct Entry {
    int coordinate;
    S value, size;
  };
  std::vector<std::vector<Entry>> entries;   // rows
  std::vector<Vector6<S>> gradients;         // rows of pairs: of the twist of the end on b, in its axes
  std::vector<Pose<S>> ends;                 // loops: the end on b in the end on a

  void find(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, LoopBuffers<S>& w) {
    using std::abs;
    entries.resize(loops.rows), gradients.assign(loops.rows, Vector6<S>::zero()), ends.assign(loops.loops.size(), Pose<S>::identity());
    for (auto& row : entries) row.clear();
    visit_loop_rows(
        model, loops, q, w, [&](const ResolvedLoop& loop, int i, const S& slope) { entries[loop.first_row].push_back({loop.v[i], slope, S(abs(slope))}); },
        [&](const ResolvedLoop& loop, const Pose<S>& X) {
          ends[&loop - loops.loops.data()] = X;
          for (int r = 0; r < loop.rows; ++r) {
            const Vector6<S>& g = gradients[loop.first_row + r] = w.rows[r].gradient;
            for (const auto& [i, J] : w.columns) {
              // Of lengths, and not of entries: a direction along which nothing moves has the rounding of those along which something does. A custom
              // hinge's row is what a projection leaves of one of length 1 (custom_rows.h).
              const bool projected = loop.loop->pair.kind == PairKind::custom;
              const S size = projected ? length(J.angular) + length(J.linear) : length(g.angular) * length(J.angular) + length(g.linear) * length(J.linear);
              entries[loop.first_row + r].push_back({i, dot(g, J), size});
            }
          }
        });
  }
  // Q(row) x
  S product(int row, const S* x) const {
    S sum = S(0);
    for (const Entry& e : entries[row]) sum += e.value * x[e.coordinate];
    return sum;
  }
  S product_size(int row, const S* x) const {
    using std::abs;
    S sum = S(0);
    for (const Entry& e : entries[row]) sum += e.size * abs(x[e.coordinate]);
    return sum;
  }
  // x += Q* λ
  void add_transposed(const S* lambda, S* x) const {
    for (size_t r = 0; r < entries.size(); ++r)
      for (const Entry& e : entries[r]) x[e.coordinate] += e.value * lambda[r];
  }
  // Of recorded numbers a sum of magnitudes, at most √3 times as much: a root takes longer than all of it.
  static S length(const Vector3<S>& x) {
    using std::abs;
    if constexpr (is_recorded<S>) return abs(x[0]) + abs(x[1]) + abs(x[2]);
    else return norm(x);
  }
  // What a loop puts on b, or on a, in its axes about its origin; nothing of a coupling.
  Vector6<S> force(const ResolvedLoops& loops, const std::vector<S>& lambda, int loop, bool on_a) const {
    const ResolvedLoop& of = loops.loops[loop];
    Vector6<S> f = Vector6<S>::zero();
    if (of.loop->is_coupling()) return f;
    for (int r = of.first_row; r < of.first_row + of.rows; ++r) f = f + lambda[r] * gradients[r];
    if (!on_a) return force_to_parent(renormalised<S>(of.loop->pair.end_b), f);
    return force_to_parent(renormalised<S>(of.loop->pair.end_a), S(-1) * force_to_parent(ends[loop], f));
  }
};

// What of loops and bodies is the same at every state.
struct LoopGroups {
  struct Group {
    std::vector<int> rows, bodies;           // bodies: that its rows reach, tips first
    int coordinates = 0;
  };
  std::vector<Group> groups;
  std::vector<int> place;                    // of a body's coordinates among those of its group
  std::vector<std::vector<int>> reach;       // of every loop: its bodies, tips first

  // parent, v_offset, nv_of: of bodies
  template <class Model>
  static LoopGroups of(const Model& model, const ResolvedLoops& loops) {
    LoopGroups made;
    std::vector<int> body_of(model.nv), owner(model.bodies, -1), leader(loops.loops.size());
    for (int k = 0; k < model.bodies; ++k) std::fill_n(body_of.begin() + model.v_offset[k], model.nv_of[k], k);
    const auto lead = [&](int l) {
      while (leader[l] != l) l = leader[l] = leader[leader[l]];
      return l;
    };
    made.place.assign(model.bodies, 0);
    std::vector<std::vector<int>> hinges(loops.loops.size());
    for (size_t l = 0; l < loops.loops.size(); ++l) {
      const ResolvedLoop& loop = loops.loops[l];
      leader[l] = int(l);
      for (const auto* steps : {&loop.path.up, &loop.path.down})
        for (const FrameStep& step : *steps)
          if (step.kind == FrameStep::Kind::hinge) hinges[l].push_back(step.number);
      for (const int i : loop.v) hinges[l].push_back(body_of[i]);
      for (int k : hinges[l])
        for (; k >= 0; k = model.parent[k]) {
          const int other = owner[k];
          owner[k] = int(l);
          if (other < 0) continue;
          leader[lead(other)] = lead(int(l));  // its own way inboard is that loop's too
          if (lead(other) == lead(int(l)) && other != int(l)) break;
        }
    }
    std::vector<int> number(loops.loops.size(), -1);
    for (size_t l = 0; l < loops.loops.size(); ++l) {
      const ResolvedLoop& loop = loops.loops[l];
      if (loop.rows == 0) continue;
      int& g = number[lead(int(l))];
      if (g < 0) g = int(made.groups.size()), made.groups.emplace_back();
      for (int i = 0; i < loop.rows; ++i) made.groups[g].rows.push_back(loop.first_row + i);
    }
    for (int k = model.bodies - 1; k >= 0; --k) {
      if (owner[k] < 0) continue;
      const int g = number[lead(owner[k])];
      if (g < 0) continue;
      made.groups[g].bodies.push_back(k);
      made.place[k] = made.groups[g].coordinates;
      made.groups[g].coordinates += model.nv_of[k];
    }
    // Of every loop the hinges and all inboard of them.
    std::vector<int> seen(model.bodies, -1);
    made.reach.resize(loops.loops.size());
    for (size_t l = 0; l < loops.loops.size(); ++l) {
      for (int k : hinges[l])
        for (; k >= 0 && seen[k] != int(l); k = model.parent[k]) seen[k] = int(l), made.reach[l].push_back(k);
      std::sort(made.reach[l].rbegin(), made.reach[l].rend());
    }
    return made;
  }
};

// d: D(k) = L d L*.
template <class S>
const S& pivot(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, int k, int i) {
  return model.nv_of[k] == 1 ? blocks.D[blocks.d_offsets()[k]] : blocks.pivots(k)[i];
}

// L⁻¹ [I - HψK] x over these bodies, tips first; out(k, i, ε, d): of coordinate i of body k, which D^-½ has as ε/√d. z: scratch, one Vector6 per body.
template <class S, class F>
void half_inverse_tip_to_base(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const std::vector<int>& bodies, const S* x, std::vector<Vector6<S>>& z,
                              std::vector<S>& epsilon, F out) {
  for (const int k : bodies) z[k] = Vector6<S>::zero();
  for (const int k : bodies) {
    const int first = model.v_offset[k], n = model.nv_of[k];
    const Vector6<S> zk = z[k];
    Vector6<S> plus = zk;
    epsilon.resize(std::max(epsilon.size(), size_t(n)));
    for (int i = 0; i < n; ++i) {
      epsilon[i] = x[first + i] - dot(blocks.H[first + i], zk);
      plus = plus + epsilon[i] * blocks.G[first + i];
    }
    if (n > 1) forward_substitute(blocks.L.data() + blocks.d_offsets()[k], n, epsilon.data(), 1);
    for (int i = 0; i < n; ++i) out(k, i, epsilon[i], pivot(model, blocks, k, i));
    if (const int p = model.parent[k]; p >= 0) z[p] = z[p] + force_to_parent(blocks.pose[k], plus);
  }
}

}  // namespace pycraft
