// Factored articulated inertias, compiled once for every scalar.
#include "algebra/trees/sweeps/factored_inertia.h"

namespace pycraft {

#define PYCRAFT_INSTANTIATE(S) template class FactoredInertia<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
