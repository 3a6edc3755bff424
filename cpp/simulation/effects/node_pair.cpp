#include "simulation/effects/node_pair.h"

#include "runtime/errors.h"

namespace pycraft {

NodePair::NodePair(const Multibody& model, const std::string& first, const std::string& second, const std::string& effect)
    : a(node_named(model, first, effect)), b(node_named(model, second, effect)) {
  if (a.body == b.body)
    throw ModelError(effect + ": '" + (first.empty() ? "the base" : first) + "' and '" + (second.empty() ? "the base" : second) + "' are on one body, where it does nothing; name nodes of two");
}

void NodePair::declare(Declaration& d, bool twists) const {
  for (const int k : {a.body, b.body}) {
    if (k < 0) continue;
    d.poses.push_back(k), d.wrenches.push_back(k);
    if (twists) d.twists.push_back(k);
  }
}

}  // namespace pycraft
