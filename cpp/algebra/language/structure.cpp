#include "algebra/language/structure.h"

#include <algorithm>

#include "runtime/errors.h"

namespace pycraft {

void SkoStructure::finish() {
  const int n = bodies();
  offset.assign(1, 0);
  dof_offset.assign(1, 0);
  last_child.assign(n, -1);
  for (int k = 0; k < n; ++k) {
    if (parent[k] >= k || parent[k] < -1)
      throw ModelError("body " + std::to_string(k) + " has parent " + std::to_string(parent[k]) + "; parents come before their children");
    if (parent[k] >= 0) last_child[parent[k]] = k;
    offset.push_back(offset.back() + size[k]);
    dof_offset.push_back(dof_offset.back() + dof[k]);
  }
  for (int k = static_cast<int>(body_names.size()); k < n; ++k) body_names.push_back("body" + std::to_string(k));
  for (int k = static_cast<int>(hinge_names.size()); k < n; ++k) hinge_names.push_back("hinge" + std::to_string(k));
  if (coordinate_names.empty())
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < dof[k]; ++j)
        coordinate_names.push_back(dof[k] == 1 ? hinge_names[k] : hinge_names[k] + "[" + std::to_string(j) + "]");
}

bool SkoStructure::is_chain() const {
  for (int k = 0; k < bodies(); ++k)
    if (parent[k] != k - 1) return false;
  return true;
}

bool SkoStructure::single_dof() const {
  return std::all_of(dof.begin(), dof.end(), [](int n) { return n <= 1; });
}

bool SkoStructure::equal_blocks() const {
  for (int k = 0; k < bodies(); ++k)
    if (parent[k] >= 0 && size[k] != size[parent[k]]) return false;
  return true;
}

bool SkoStructure::free_root() const {
  return std::count(parent.begin(), parent.end(), -1) == 1 && dof[0] == size[0];
}

}  // namespace pycraft
