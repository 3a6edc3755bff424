// ℳ⁻¹ and ℳ on columns by the kernels' own formulas, on numbers that write down what is done to them: products fused where kernels fuse them.
#pragma once

#include "kernels/bodies.h"
#include "numerics/recorded.h"

namespace pycraft::kernels {

extern const ColumnKernels<Recorded> recorded_columns;

}  // namespace pycraft::kernels
