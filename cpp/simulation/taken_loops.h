// Loops that an effect names, of all that a model has: checked, and their rows numbered anew.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "model/loops.h"
#include "model/multibody.h"
#include "runtime/errors.h"

namespace pycraft {

// ModelError for names of loops that are not there or twice, and where none is named, for a model that has none.
inline void check_names(const LoopSet& set, const std::vector<std::string>& names) {
  for (auto name = names.begin(); name != names.end(); ++name) {
    set.loop(*name);
    if (std::find(names.begin(), name, *name) != name) throw ModelError("loop: '" + *name + "' is named twice");
  }
  if (names.empty() && set.names().empty()) throw ModelError("loop: '" + set.model().name() + "' has no loops; declare them, add_loop(...)");
}

// Loops of these names after those that `to` has. What is returned has the poses that their paths point to, and is kept as long as they are.
inline std::shared_ptr<const ResolvedLoops> take_loops(const LoopSet& set, const std::vector<std::string>& names, ResolvedLoops& to) {
  std::shared_ptr<const ResolvedLoops> all = set.resolved();
  std::unordered_map<std::string, const ResolvedLoop*> by_name;
  for (const ResolvedLoop& loop : all->loops) by_name[loop.loop->name] = &loop;
  for (const std::string& name : names)
    if (const auto known = by_name.find(name); known != by_name.end()) {
      const ResolvedLoop& loop = *known->second;
      ResolvedLoop own = loop;
      own.first_row = to.rows;
      for (int r = loop.first_row; r < loop.first_row + loop.rows; ++r) to.names.push_back(all->names[r]), to.of_positions.push_back(all->of_positions[r]);
      to.rows += loop.rows;
      to.loops.push_back(std::move(own));
    }
  return all;
}

}  // namespace pycraft
