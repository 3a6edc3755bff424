#include "algebra/trees/grouping.h"

#include "runtime/errors.h"

namespace pycraft {

std::vector<std::vector<int>> pairs_of_bodies(const SkoStructure& t) {
  std::vector<std::vector<int>> groups;
  for (int k = 0; k < t.bodies(); ++k) {
    groups.push_back({k});
    if (k + 1 < t.bodies() && t.parent[k + 1] == k) groups.back().push_back(++k);
  }
  return groups;
}

Grouping::Grouping(const SkoStructure& t, const std::string& name, const std::vector<std::vector<int>>& named, bool siblings)
    : group_of(t.bodies(), -1), row_of(t.bodies(), 0) {
  std::vector<int> set_of(t.bodies(), -1);  // of bodies that are named
  for (size_t set = 0; set < named.size(); ++set)
    for (int k : named[set]) {
      if (set_of[k] >= 0) throw ModelError("groups of '" + name + "': body '" + t.body_names[k] + "' is named twice; a body belongs to one group");
      set_of[k] = static_cast<int>(set);
    }
  std::vector<int> started(named.size(), -1);
  for (int k = 0; k < t.bodies(); ++k) {
    const int set = set_of[k], p = t.parent[k];
    if (set >= 0 && started[set] >= 0) {
      const bool carried = p >= 0 && set_of[p] == set, beside = siblings && p == t.parent[groups[started[set]][0]];
      if (!carried && !beside)
        throw ModelError("groups of '" + name + "': '" + t.body_names[k] + "' and '" + t.body_names[groups[started[set]][0]] +
                         "' are named as one and do not hang together; name " + (p < 0 ? "bodies on one root" : "'" + t.body_names[p] + "', which carries it, too"));
      group_of[k] = started[set];
      groups[group_of[k]].push_back(k);
      continue;
    }
    group_of[k] = static_cast<int>(groups.size());
    if (set >= 0) started[set] = group_of[k];
    groups.push_back({k});
  }
  for (const std::vector<int>& bodies : groups) {
    int size = 0, dof = 0;
    std::string body, hinge;
    for (int k : bodies) {
      row_of[k] = size;
      size += t.size[k], dof += t.dof[k];
      if (k != bodies[0]) body += '+', hinge += '+';
      body += t.body_names[k], hinge += t.hinge_names[k];
      structure.coordinate_names.insert(structure.coordinate_names.end(), t.coordinate_names.begin() + t.dof_offset[k], t.coordinate_names.begin() + t.dof_offset[k + 1]);
    }
    const int p = t.parent[bodies[0]];
    structure.parent.push_back(p < 0 ? -1 : group_of[p]);
    structure.size.push_back(size), structure.dof.push_back(dof);
    structure.body_names.push_back(body), structure.hinge_names.push_back(hinge);
  }
  structure.finish();
}

}  // namespace pycraft
