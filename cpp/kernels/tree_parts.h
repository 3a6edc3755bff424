// Trees taken apart for threads: subtrees that have nothing to do with one another, and the trunk between them.
#pragma once

#include <vector>

namespace pycraft::kernels {

// Links first..last, one after the other: a subtree that is apart, or a piece of the trunk. Outward they are met in their order, the trunk before
// the subtrees; inward against it.
struct TreePart {
  int first, last;
  bool apart;
};

// Of links by their parents, -1 the base, numbered so that a subtree's follow its root; a subtree apart has `least` links or more where it can,
// and a trunk is what carries two of them. None where there are no two.
std::vector<TreePart> tree_parts(const std::vector<int>& parents, int least);

}  // namespace pycraft::kernels
