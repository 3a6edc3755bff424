#include "kernels/tree_parts.h"

#include <algorithm>

namespace pycraft::kernels {

std::vector<TreePart> tree_parts(const std::vector<int>& parents, int least) {
  const int count = static_cast<int>(parents.size());
  std::vector<int> size(count, 1), large(count + 1, 0);  // of subtrees; how many large ones a link carries, the base last
  std::vector<char> trunk(count, 0);
  const auto carrier = [&](int k) { return parents[k] < 0 ? count : parents[k]; };
  for (int k = count - 1; k >= 0; --k) {
    if (large[k] >= 2) trunk[k] = 1;
    if (parents[k] >= 0) {
      size[parents[k]] += size[k];
      trunk[parents[k]] |= trunk[k];
    }
    large[carrier(k)] += size[k] >= least;
  }
  std::vector<TreePart> parts;
  int apart = 0;
  for (int k = 0; k < count;) {
    const bool alone = !trunk[k] && 4 * size[k] >= least;
    const int last = alone ? k + size[k] : k + 1;
    if (!alone && !parts.empty() && !parts.back().apart)
      parts.back().last = last;
    else
      parts.push_back({k, last, alone});
    apart += alone;
    k = last;
  }
  if (apart < 2) parts.clear();
  return parts;
}

}  // namespace pycraft::kernels
