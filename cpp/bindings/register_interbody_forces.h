// Forces of hinges on the bodies that they move, of a model and of a scene.
#pragma once

#include <pybind11/pybind11.h>

#include <string>
#include <vector>

namespace pycraft {

class Multibody;
struct PushedNodes;

// The nodes of these names that wrenches act on. ModelError where one is not there, or on the base.
PushedNodes pushed_nodes(const Multibody& model, const std::vector<std::string>& names, bool in_world);

void register_interbody_forces(pybind11::module_& m);

}  // namespace pycraft
