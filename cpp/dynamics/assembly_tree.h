// The order in which divide and conquer puts a tree of bodies together: an assembly tree, binary, of depth O(log N) over any tree of N bodies.
//
// Every body keeps its largest subtree on a chain with itself; the others are branches of it. So the bodies fall into chains, and on the way from
// any body to the base less than log2 N times one ends and another begins. What is put together are segments, runs of bodies of a chain with
// all that branches off them:
//
//   body     one body and the branches it carries                        first: the branches, -1: none
//   join     two segments of a chain, one outboard of the other           first: inboard, second: outboard
//   branches two lots of branches of one body                             first, second
//
// Both a chain and the branches of a body are halved by the number of bodies in each half, not of pieces: a piece of w bodies among W lies at
// most log2(W/w) + 2 below, and as what is inside a piece continues where that ends, these sums telescope to log2 N, and the twos with
// them: the depth is at most 6 log2 N + 4, of a chain log2 N + 1 rounded up.
//
// Source: D. Sleator, R. Tarjan, A data structure for dynamic trees, J. Computer and System Sciences 26(3), 1983 (heavy paths, each as a tree biased by
// weights). Cost O(N log N), once per structure.
#pragma once

#include <vector>

namespace pycraft {

struct AssemblyNode {
  enum class Kind { body, join, branches };
  Kind kind;
  int first, second;  // nodes that come before this one; -1: none
  int body;           // of a body it; of a join the last one of the inboard segment, where the outboard one hangs; of branches who carries them
  int size;           // nodes from its first to itself, which are one after the other
};

class AssemblyTree {
 public:
  // Of bodies by their parents, -1 the base, parents before children.
  explicit AssemblyTree(const std::vector<int>& parents);

  const std::vector<AssemblyNode>& nodes() const { return nodes_; }
  // The chains that hang on the base, each a node with all that is in it.
  const std::vector<int>& roots() const { return roots_; }
  // Nodes on the longest way from a root to a body, both counted: what no number of threads makes shorter. 0 without bodies.
  int depth() const;
  // The body that follows on the chain, -1 at its end.
  const std::vector<int>& next() const { return next_; }

  // Nodes first..last, one after the other, with all that is inside them: what a thread does by itself.
  struct Piece {
    int first, last;
  };
  // The largest pieces of at most `most` nodes, and the nodes outside of them, in their order.
  void cut(int most, std::vector<Piece>& pieces, std::vector<int>& rest) const;

 private:
  int chain(int root);
  int segment(const std::vector<int>& bodies, const std::vector<long>& sums, int from, int to);
  int single(int body);
  int branches(int body, const std::vector<int>& children, const std::vector<long>& sums, int from, int to);
  int push(AssemblyNode::Kind kind, int first, int second, int body);

  std::vector<AssemblyNode> nodes_;
  std::vector<int> roots_, next_;
  // While it is made: bodies in subtrees, and children in their order.
  std::vector<int> bodies_in_, first_child_, sibling_;
};

}  // namespace pycraft
