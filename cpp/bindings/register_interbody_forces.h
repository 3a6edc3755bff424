// Forces of hinges on the bodies that they move, of a model and of a scene.
#pragma once

#include <pybind11/pybind11.h>

namespace pycraft {

void register_interbody_forces(pybind11::module_& m);

}  // namespace pycraft
