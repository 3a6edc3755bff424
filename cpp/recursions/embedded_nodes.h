// ℳ_C = X*(ℳ + J)X of a tree with its loops embedded, factored and solved node by node without ℳ_C.
//
// The bodies around loops that hang together, up to the body p that carries all of them, are one node n of the tree; any other body is a node of
// its own with X = 1. X is that of operators/embedded_operators.h. With the articulated inertias of what is outboard put in at the node's bodies, tip
// to base inside the node and from node to node:
//
//   P(k) = M(k) + Σ_{nodes on k} P⁺
//   of every column x of X:  α(k) = φ*α + H*x,  f(k) = P(k) α(k) + Σ_{c in n} φ(k,c) f(c),  (ℳ_n X)(k) = H(k) f(k),  G = Σ_{roots of n} φ f
//   D = X*(ℳ_n + J)X,   R(k) = P(k) + Σ_{c in n} φ(k,c) R(c) φ(k,c)*,   P⁺ = Σ_{roots of n} φ R φ* - G D⁻¹ G*
//   z(k) = Σ φ z(c),  ε = X*(x - H z),  ν = D⁻¹ε,  z(p) <- z(p) + Σ φ z + G ν;      base to tip:  y = ν - D⁻¹G* α(p),  α(k) = φ*α + H*X y
//
// Cost O(N) over nodes, of a node of n coordinates with r independent ones O(n r²) and O(r³).
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, the chapter on constraint embedding.
#pragma once

#include <algorithm>
#include <vector>

#include "model/loops.h"
#include "numerics/small_ldl.h"
#include "rigid/rigid_blocks.h"
#include "runtime/interrupt.h"

namespace pycraft {

struct EmbeddedNode {
  std::vector<int> bodies;                   // base to tips
  std::vector<int> coordinates;              // of the tree, in the bodies' order
  std::vector<int> rows;                     // of loops around it
  int parent;                                // the body that carries it, -1 the base
};

// Nodes, base to tips. Of the structure alone: which bodies, whatever the state.
template <class Model>
std::vector<EmbeddedNode> embedded_nodes(const Model& model, const ResolvedLoops& loops) {
  std::vector<int> body_of(model.nv), leader(model.bodies);
  for (int k = 0; k < model.bodies; ++k) std::fill_n(body_of.begin() + model.v_offset[k], model.nv_of[k], k), leader[k] = k;
  const auto lead = [&](int k) {
    while (leader[k] != k) k = leader[k] = leader[leader[k]];
    return k;
  };
  const auto join = [&](int a, int b) { leader[std::max(lead(a), lead(b))] = std::min(lead(a), lead(b)); };
  const auto bodies_of = [&](const ResolvedLoop& loop) {
    std::vector<int> found;
    for (const auto* steps : {&loop.path.up, &loop.path.down})
      for (const FrameStep& step : *steps)
        if (step.kind == FrameStep::Kind::hinge) found.push_back(step.number);
    for (const int i : loop.v) found.push_back(body_of[i]);
    return found;
  };
  for (const ResolvedLoop& loop : loops.loops) {
    const std::vector<int> found = loop.rows > 0 ? bodies_of(loop) : std::vector<int>{};
    for (size_t i = 1; i < found.size(); ++i) join(found[0], found[i]);
  }
  // Up to the one body that carries all: the outermost of a node's roots joins what carries it, until all hang on one.
  for (bool again = true; again;) {
    again = false;
    std::vector<int> carrier(model.bodies, -2);
    for (int k = model.bodies - 1; k >= 0; --k) {
      const int own = lead(k), p = model.parent[k];
      if (p >= 0 && lead(p) == own) continue;
      if (carrier[own] == -2) {
        carrier[own] = p;
      } else if (carrier[own] != p) {
        const int outer = std::max(carrier[own], p);
        join(own, outer), again = true;
        break;
      }
    }
  }
  std::vector<EmbeddedNode> nodes;
  std::vector<int> number(model.bodies, -1);
  for (int k = 0; k < model.bodies; ++k) {
    int& n = number[lead(k)];
    if (n < 0) n = static_cast<int>(nodes.size()), nodes.push_back({{}, {}, {}, model.parent[k]});
    nodes[n].bodies.push_back(k);
    for (int i = 0; i < model.nv_of[k]; ++i) nodes[n].coordinates.push_back(model.v_offset[k] + i);
  }
  for (const ResolvedLoop& loop : loops.loops)
    if (const std::vector<int> found = bodies_of(loop); loop.rows > 0 && !found.empty())
      for (int i = 0; i < loop.rows; ++i) nodes[number[lead(found[0])]].rows.push_back(loop.first_row + i);
  return nodes;
}

// What is known of a node at a state. X is (n, r), row-major; G has r columns.
template <class S>
struct EmbeddedFactors {
  int n = 0, r = 0;
  std::vector<S> X, MX, D, pivots, epsilon, nu, full;
  std::vector<Vector6<S>> G, K;              // K = D⁻¹G*
  void resize(int coordinates, int independent) {
    n = coordinates, r = independent;
    X.assign(size_t(n) * r, S(0)), MX.resize(size_t(n) * r), D.resize(size_t(r) * r), pivots.resize(r);
    epsilon.resize(r), nu.resize(r), full.resize(n), G.resize(r), K.resize(r);
  }
};

template <class S>
class EmbeddedTree {
 public:
  // X of nodes is set by the caller between `begin` and `factor`.
  void begin(const CompiledModel<S>& model, const std::vector<EmbeddedNode>& nodes) {
    model_ = &model, nodes_ = &nodes;
    factors.resize(nodes.size());
    P_.resize(model.bodies), z_.resize(model.bodies), alpha_.resize(model.bodies);
    inside_.assign(model.bodies, 0), place_.resize(model.nv);
    for (size_t n = 0; n < nodes.size(); ++n)
      for (size_t i = 0; i < nodes[n].coordinates.size(); ++i) place_[nodes[n].coordinates[i]] = static_cast<int>(i);
    for (const EmbeddedNode& node : nodes)
      for (const int k : node.bodies) inside_[k] = model.parent[k] != node.parent;
  }
  // Articulated inertias. The coordinate at whose pivot D is not positive, -1: all are.
  int factor(const RigidBlocks<S>& blocks) {
    for (int k = 0; k < model_->bodies; ++k) P_[k] = symmetric6(blocks.inertia[k]);
    for (size_t n = nodes_->size(); n-- > 0;) {
      const EmbeddedNode& node = (*nodes_)[n];
      EmbeddedFactors<S>& f = factors[n];
      for (int a = 0; a < f.r; ++a) find_column(blocks, node, f, a);
      project(f);
      if (const int bad = ldl_in_place(f.D.data(), f.r, f.pivots.data()); bad < f.r) return coordinate_of(node, f, bad);
      if (node.parent >= 0) take_off(blocks, node, f);
    }
    return -1;
  }
  // y = ℳ_C⁻¹ X* x of the tree's coordinates, X put in front: X y, to `out`. Returns the energy x* X ℳ_C⁻¹ X* x. out may be null: only that.
  S solve(const RigidBlocks<S>& blocks, const S* x, S* out) {
    S energy = S(0);
    for (auto& z : z_) z = Vector6<S>::zero();
    for (size_t n = nodes_->size(); n-- > 0;) {
      const EmbeddedNode& node = (*nodes_)[n];
      EmbeddedFactors<S>& f = factors[n];
      for (size_t b = node.bodies.size(); b-- > 0;) {
        const int k = node.bodies[b];
        for (int i = model_->v_offset[k]; i < model_->v_offset[k] + model_->nv_of[k]; ++i) f.full[place_[i]] = x[i] - dot(blocks.H[i], z_[k]);
        if (const int p = model_->parent[k]; p >= 0) z_[p] = z_[p] + force_to_parent(blocks.pose[k], z_[k]);
      }
      for (int a = 0; a < f.r; ++a) {
        f.epsilon[a] = S(0);
        for (int i = 0; i < f.n; ++i) f.epsilon[a] += f.X[size_t(i) * f.r + a] * f.full[i];
        f.nu[a] = f.epsilon[a];
      }
      ldl_solve(f.D.data(), f.pivots.data(), f.r, f.nu.data(), 1);
      for (int a = 0; a < f.r; ++a) {
        energy += f.epsilon[a] * f.nu[a];
        if (node.parent >= 0) z_[node.parent] = z_[node.parent] + f.nu[a] * f.G[a];
      }
    }
    if (out) base_to_tip(blocks, out);
    return energy;
  }

  // D(a,a) of a node, from its factors.
  S diagonal(const EmbeddedFactors<S>& f, int a) const {
    S felt = S(0);
    for (int b = 0; b <= a; ++b) felt += f.pivots[b] * (b == a ? S(1) : f.D[size_t(a) * f.r + b] * f.D[size_t(a) * f.r + b]);
    return felt;
  }

  int place(int coordinate) const { return place_[coordinate]; }  // of the tree's, in its node

  std::vector<EmbeddedFactors<S>> factors;   // of nodes

 private:
  // Column a of (ℳ_n + J)X, and of G.
  void find_column(const RigidBlocks<S>& blocks, const EmbeddedNode& node, EmbeddedFactors<S>& f, int a) {
    check_interrupt_at(a, f.n);
    for (const int k : node.bodies) {
      alpha_[k] = inside_[k] ? motion_to_child(blocks.pose[k], alpha_[model_->parent[k]]) : Vector6<S>::zero();
      for (int i = model_->v_offset[k]; i < model_->v_offset[k] + model_->nv_of[k]; ++i) alpha_[k] = alpha_[k] + f.X[size_t(place_[i]) * f.r + a] * blocks.H[i];
      z_[k] = P_[k] * alpha_[k];
    }
    f.G[a] = Vector6<S>::zero();
    for (size_t b = node.bodies.size(); b-- > 0;) {
      const int k = node.bodies[b];
      for (int i = model_->v_offset[k]; i < model_->v_offset[k] + model_->nv_of[k]; ++i)
        f.MX[size_t(place_[i]) * f.r + a] = dot(blocks.H[i], z_[k]) + blocks.J[i] * f.X[size_t(place_[i]) * f.r + a];
      Vector6<S>& onto = inside_[k] ? z_[model_->parent[k]] : f.G[a];
      onto = onto + force_to_parent(blocks.pose[k], z_[k]);
    }
  }
  void project(EmbeddedFactors<S>& f) {
    for (int a = 0; a < f.r; ++a)
      for (int b = 0; b <= a; ++b) {
        S sum = S(0);
        for (int i = 0; i < f.n; ++i) sum += f.X[size_t(i) * f.r + a] * f.MX[size_t(i) * f.r + b];
        f.D[size_t(a) * f.r + b] = f.D[size_t(b) * f.r + a] = sum;
      }
  }
  void take_off(const RigidBlocks<S>& blocks, const EmbeddedNode& node, EmbeddedFactors<S>& f) {
    Symmetric6<S>& P = P_[node.parent];
    for (size_t b = node.bodies.size(); b-- > 0;) {  // composite: P_ becomes R inside the node
      const int k = node.bodies[b];
      add(P_[model_->parent[k]], to_parent(blocks.pose[k], P_[k]));
    }
    // L⁻¹G*, by rows: P - Σ w w*/d
    for (int a = 0; a < f.r; ++a) {
      f.K[a] = f.G[a];
      for (int b = 0; b < a; ++b) f.K[a] = f.K[a] - f.D[size_t(a) * f.r + b] * f.K[b];
      downdate(P, f.K[a], S(1) / f.pivots[a] * f.K[a]);
    }
    for (int a = 0; a < f.r; ++a) f.K[a] = S(1) / f.pivots[a] * f.K[a];
    for (int a = f.r - 1; a >= 0; --a)
      for (int b = a + 1; b < f.r; ++b) f.K[a] = f.K[a] - f.D[size_t(b) * f.r + a] * f.K[b];
  }
  void base_to_tip(const RigidBlocks<S>& blocks, S* out) {
    for (size_t n = 0; n < nodes_->size(); ++n) {
      const EmbeddedNode& node = (*nodes_)[n];
      EmbeddedFactors<S>& f = factors[n];
      for (int a = 0; node.parent >= 0 && a < f.r; ++a) f.nu[a] -= dot(f.K[a], alpha_[node.parent]);
      for (int i = 0; i < f.n; ++i) {
        S sum = S(0);
        for (int a = 0; a < f.r; ++a) sum += f.X[size_t(i) * f.r + a] * f.nu[a];
        out[node.coordinates[i]] = sum;
      }
      for (const int k : node.bodies) {
        alpha_[k] = model_->parent[k] >= 0 ? motion_to_child(blocks.pose[k], alpha_[model_->parent[k]]) : Vector6<S>::zero();
        for (int i = model_->v_offset[k]; i < model_->v_offset[k] + model_->nv_of[k]; ++i) alpha_[k] = alpha_[k] + out[i] * blocks.H[i];
      }
    }
  }
  // The tree's coordinate that is the node's independent one `a`.
  static int coordinate_of(const EmbeddedNode& node, const EmbeddedFactors<S>& f, int a) {
    for (int i = 0; i < f.n; ++i) {
      bool unit = true;
      for (int b = 0; b < f.r; ++b) unit = unit && f.X[size_t(i) * f.r + b] == S(b == a ? 1 : 0);
      if (unit) return node.coordinates[i];
    }
    return node.coordinates[0];
  }

  const CompiledModel<S>* model_ = nullptr;
  const std::vector<EmbeddedNode>* nodes_ = nullptr;
  std::vector<Symmetric6<S>> P_;
  std::vector<Vector6<S>> z_, alpha_;
  std::vector<char> inside_;                 // bodies: whether what carries it is of its node
  std::vector<int> place_;                   // coordinates: in their nodes
};

}  // namespace pycraft
