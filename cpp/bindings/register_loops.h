// Loops and their rows: pycraft/models/loop_set.py is their face.
#pragma once

#include "bindings/bindings.h"

namespace pycraft {

void register_loops(py::module_& m);

}  // namespace pycraft
