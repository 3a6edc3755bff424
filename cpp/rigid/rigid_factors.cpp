// The factored forms of rigid bodies, compiled once for every scalar.
#include "rigid/rigid_factors.h"

namespace pycraft {

#define PYCRAFT_INSTANTIATE(S) template class RigidFactors<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
