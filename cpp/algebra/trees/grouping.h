// Connected sets of bodies of a tree, each taken as one node of another tree. With S the bodies of group C and p the parent of the first of them:
//
//   φ_S = (I - E_S)⁻¹,  H_C = H_S φ_S,  M_C = M_S,  J_C = J_S,  E(q,C) = A φ_S
//
// A the row of E that leads to p, in the rows of p in its own group q. Nothing is constrained, so nothing outside changes: H_C φ_C = H φ. Compound
// bodies of any kind are built in this way. Several bodies of S may be carried by p, or stand on the base: then A has a block for each.
#pragma once

#include <algorithm>
#include <vector>

#include "algebra/language/structure.h"
#include "algebra/trees/dense_blocks.h"
#include "numerics/small_matrix.h"

namespace pycraft {

struct Grouping {
  // Bodies that no group names stay by themselves. Throws ModelError for a body that is named twice and for a group that is not connected;
  // with siblings, children of one parent count as that.
  Grouping(const SkoStructure& tree, const std::string& name, const std::vector<std::vector<int>>& named, bool siblings = false);

  std::vector<std::vector<int>> groups;  // each in the order of the tree, by their first bodies
  std::vector<int> group_of, row_of;     // of each body: its group, and its first row there
  SkoStructure structure;                // of the groups

  bool single(int g) const { return groups[g].size() == 1; }
};

// Every body with the one after it that it carries.
std::vector<std::vector<int>> pairs_of_bodies(const SkoStructure& tree);

// φ_S and H_S of group g. get(id, k) hands out a block of the tree as a row-major vector.
template <class S, class Get>
void inner_blocks(const SkoStructure& tree, const Grouping& grouping, int g, Get&& get, std::vector<S>& phi, std::vector<S>& H) {
  const int s = grouping.structure.size[g], n = grouping.structure.dof[g];
  phi.assign(size_t(s) * s, S(0)), H.assign(size_t(n) * s, S(0));
  int first_row = 0;
  for (int k : grouping.groups[g]) {
    const int at = grouping.row_of[k], p = tree.parent[k];
    if (p >= 0 && grouping.group_of[p] == g) {  // the column of k is that of its parent, carried on
      const std::vector<S> E = get(SymbolId::E, k);
      for (int i = 0; i < at; ++i)
        for (int j = 0; j < tree.size[k]; ++j)
          for (int a = 0; a < tree.size[p]; ++a) phi[size_t(i) * s + at + j] += phi[size_t(i) * s + grouping.row_of[p] + a] * E[size_t(a) * tree.size[k] + j];
    }
    for (int i = 0; i < tree.size[k]; ++i) phi[size_t(at + i) * s + at + i] = S(1);
    const std::vector<S> own = get(SymbolId::H, k);
    for (int i = 0; i < tree.dof[k]; ++i)
      for (int j = 0; j < tree.size[k]; ++j) H[size_t(first_row + i) * s + at + j] = own[size_t(i) * tree.size[k] + j];
    first_row += tree.dof[k];
  }
}

// H_C, M_C and J_C.
template <class S, class Get>
void fill_group(const SkoStructure& tree, const Grouping& grouping, int g, Get&& get, const std::vector<S>& phi, const std::vector<S>& H, DenseBlocks<S>& out) {
  const int s = grouping.structure.size[g], n = grouping.structure.dof[g];
  std::fill_n(out.hinge_map(g), size_t(n) * s, S(0));
  multiply_add(H.data(), phi.data(), out.hinge_map(g), n, s, s);
  std::fill_n(out.mass(g), size_t(s) * s, S(0));
  std::fill_n(out.hinge_diagonal(g), size_t(n) * n, S(0));
  int first_row = 0;
  for (int k : grouping.groups[g]) {
    const int at = grouping.row_of[k];
    const std::vector<S> M = get(SymbolId::M, k), J = get(SymbolId::J, k);
    for (int i = 0; i < tree.size[k]; ++i) std::copy_n(M.data() + size_t(i) * tree.size[k], tree.size[k], out.mass(g) + size_t(at + i) * s + at);
    for (int i = 0; i < tree.dof[k]; ++i) std::copy_n(J.data() + size_t(i) * tree.dof[k], tree.dof[k], out.hinge_diagonal(g) + size_t(first_row + i) * n + first_row);
    first_row += tree.dof[k];
  }
}

// E(q,C), of a group that has a parent.
template <class S, class Get>
void fill_edge(const SkoStructure& tree, const Grouping& grouping, int g, Get&& get, const std::vector<S>& phi, S* out) {
  const int p = tree.parent[grouping.groups[g][0]], s = grouping.structure.size[g];
  std::fill_n(out, size_t(grouping.structure.size[grouping.group_of[p]]) * s, S(0));
  for (int k : grouping.groups[g]) {
    if (tree.parent[k] != p) continue;
    const std::vector<S> E = get(SymbolId::E, k);
    multiply_add(E.data(), phi.data() + size_t(grouping.row_of[k]) * s, out + size_t(grouping.row_of[p]) * s, tree.size[p], tree.size[k], s);
  }
}

}  // namespace pycraft
