// The sweeps over trees of rigid bodies, compiled once for every scalar (multibody_operators.cpp): whose numbers stand in such a tree needs their
// names alone.
#pragma once

#include "algebra/trees/tree_values.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

#define PYCRAFT_EXTERN(S) extern template class TreeValues<RigidBlocks<S>>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
