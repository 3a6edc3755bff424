#include "model/structure_edits.h"

#include <utility>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

void StructureEdits::rehang(Multibody& model, const std::string& body, const std::string& parent, Hinge hinge, const std::vector<double>& q,
                            const std::vector<double>& v) {
  model.require_whole("hang body '" + body + "' elsewhere");
  const Multibody::Edit edit(model);
  model.settle();
  const int k = model.body_index(body);
  const std::string before = model.bodies_[k].hinge.name;
  if (hinge.name.empty()) throw ModelError("the hinge of body '" + body + "' has no name");
  if (hinge.name != before && model.hinge_numbers_.count(hinge.name))
    throw ModelError("'" + model.name_ + "' has a hinge called '" + hinge.name + "' already; give every hinge a name of its own");
  const Node onto = model.find_frame(parent);
  for (int j = onto.body; j >= 0; j = model.bodies_[j].parent)
    if (j == k) throw ModelError("body '" + body + "' cannot hang on '" + parent + "', which is outboard of it");
  hinge = checked_hinge(std::move(hinge));
  hinge.placement = placed_on(onto.pose, hinge.placement, "the placement of hinge '" + hinge.name + "'");
  model.hinge_numbers_.erase(before);
  try {
    model.check_coordinate_names(hinge);
    if (static_cast<int>(q.size()) != hinge.nq() || static_cast<int>(v.size()) != hinge.nv())
      throw ModelError("hinge '" + hinge.name + "' takes " + std::to_string(hinge.nq()) + " coordinates and " + std::to_string(hinge.nv()) + " velocities");
    check_configuration(hinge, q.data());
    check_rates(hinge, v.data(), "v");
  } catch (...) {
    model.hinge_numbers_[before] = k;
    throw;
  }
  model.structure_changed("body '" + body + "' was hung on " + (parent.empty() ? "the base" : "'" + parent + "'") + " by hinge '" + hinge.name + "'");
  model.carried_.erase(before);
  model.carried_[hinge.name] = {q, v};
  model.hinge_numbers_[hinge.name] = k;
  model.bodies_[k].parent = onto.body;
  model.bodies_[k].hinge = std::move(hinge);
  model.settle();
}

}  // namespace pycraft
