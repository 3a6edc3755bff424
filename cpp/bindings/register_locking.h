// Hinges that are locked and bodies that are coalesced, as pycraft.models.locking and pycraft.models.coalescing call them.
#pragma once

#include "bindings/bindings.h"

namespace pycraft {

void register_locking(py::module_& m);

}  // namespace pycraft
