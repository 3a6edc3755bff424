// The skeleton of an SKO model: a tree and the block sizes per body. No numbers, no mechanics.
#pragma once

#include <string>
#include <vector>

namespace pycraft {

// Bodies in an order with parents before children; parent -1 is the base. Several roots are allowed.
struct SkoStructure {
  std::vector<int> parent;
  std::vector<int> size;                       // s_k: rows of body k in V and F (6 for a rigid body)
  std::vector<int> dof;                        // n_k: rows of H(k)
  std::vector<int> offset, dof_offset;         // prefix sums, one longer
  std::vector<int> last_child;                 // the child that sweeps from the tips come from first, -1 at a tip
  std::vector<std::string> body_names, hinge_names, coordinate_names;

  int bodies() const { return static_cast<int>(parent.size()); }
  int dimension() const { return offset.back(); }
  int coordinates() const { return dof_offset.back(); }
  // Fills the offsets from size and dof, and names where there are none; throws ModelError where a parent does not precede its child.
  void finish();
  bool is_chain() const;                       // every body's parent is the body before it
  bool single_dof() const;                     // no hinge of more than one coordinate
  bool equal_blocks() const;                   // every body as many rows as its parent
  bool free_root() const;                      // one root, with as many coordinates as rows
};

}  // namespace pycraft
