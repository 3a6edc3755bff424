#include "dynamics/assembly_tree.h"

#include <algorithm>
#include <cstdlib>

namespace pycraft {

namespace {

// Where pieces from..to, of which sums[i] count the bodies before the i-th, fall into halves that are as equal as they can be.
int halfway(const std::vector<long>& sums, int from, int to) {
  const long twice = sums[from] + sums[to];
  const auto uneven = [&](int at) { return std::labs(2 * sums[at] - twice); };
  const auto above = std::lower_bound(sums.begin() + from + 1, sums.begin() + to - 1, twice, [](long sum, long middle) { return 2 * sum < middle; });
  const int at = static_cast<int>(above - sums.begin());
  return at - 1 > from && uneven(at - 1) <= uneven(at) ? at - 1 : at;
}

}  // namespace

AssemblyTree::AssemblyTree(const std::vector<int>& parents) {
  const int count = static_cast<int>(parents.size());
  bodies_in_.assign(count, 1), next_.assign(count, -1), first_child_.assign(count, -1), sibling_.assign(count, -1);
  for (int k = count - 1; k >= 0; --k) {
    const int p = parents[k];
    if (p < 0) continue;
    bodies_in_[p] += bodies_in_[k];
    sibling_[k] = first_child_[p];
    first_child_[p] = k;
    if (next_[p] < 0 || bodies_in_[k] >= bodies_in_[next_[p]]) next_[p] = k;
  }
  nodes_.reserve(size_t(2) * count);
  for (int k = 0; k < count; ++k)
    if (parents[k] < 0) roots_.push_back(chain(k));
  for (auto* made : {&bodies_in_, &first_child_, &sibling_}) std::vector<int>().swap(*made);
}

int AssemblyTree::push(AssemblyNode::Kind kind, int first, int second, int body) {
  const int size = 1 + (first < 0 ? 0 : nodes_[first].size) + (second < 0 ? 0 : nodes_[second].size);
  nodes_.push_back({kind, first, second, body, size});
  return static_cast<int>(nodes_.size()) - 1;
}

int AssemblyTree::chain(int root) {
  std::vector<int> bodies;
  std::vector<long> sums{0};  // a body with what branches off it
  for (int k = root; k >= 0; k = next_[k]) {
    bodies.push_back(k);
    sums.push_back(sums.back() + bodies_in_[k] - (next_[k] < 0 ? 0 : bodies_in_[next_[k]]));
  }
  return segment(bodies, sums, 0, static_cast<int>(bodies.size()));
}

int AssemblyTree::segment(const std::vector<int>& bodies, const std::vector<long>& sums, int from, int to) {
  if (to - from == 1) return single(bodies[from]);
  const int half = halfway(sums, from, to);
  const int first = segment(bodies, sums, from, half), second = segment(bodies, sums, half, to);
  return push(AssemblyNode::Kind::join, first, second, bodies[half - 1]);
}

int AssemblyTree::single(int body) {
  std::vector<int> children;
  std::vector<long> sums{0};
  for (int c = first_child_[body]; c >= 0; c = sibling_[c])
    if (c != next_[body]) {
      children.push_back(c);
      sums.push_back(sums.back() + bodies_in_[c]);
    }
  const int carried = children.empty() ? -1 : branches(body, children, sums, 0, static_cast<int>(children.size()));
  return push(AssemblyNode::Kind::body, carried, -1, body);
}

int AssemblyTree::branches(int body, const std::vector<int>& children, const std::vector<long>& sums, int from, int to) {
  if (to - from == 1) return chain(children[from]);
  const int half = halfway(sums, from, to);
  const int first = branches(body, children, sums, from, half), second = branches(body, children, sums, half, to);
  return push(AssemblyNode::Kind::branches, first, second, body);
}

int AssemblyTree::depth() const {
  std::vector<int> below(nodes_.size());
  int deepest = 0;
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const AssemblyNode& node = nodes_[i];
    below[i] = 1 + std::max(node.first < 0 ? 0 : below[node.first], node.second < 0 ? 0 : below[node.second]);
    deepest = std::max(deepest, below[i]);
  }
  return deepest;
}

void AssemblyTree::cut(int most, std::vector<Piece>& pieces, std::vector<int>& rest) const {
  pieces.clear(), rest.clear();
  for (int i = static_cast<int>(nodes_.size()) - 1; i >= 0;) {
    if (nodes_[i].size <= most) {
      pieces.push_back({i + 1 - nodes_[i].size, i + 1});
      i -= nodes_[i].size;
    } else {
      rest.push_back(i--);
    }
  }
  std::reverse(pieces.begin(), pieces.end());
  std::reverse(rest.begin(), rest.end());
}

}  // namespace pycraft
