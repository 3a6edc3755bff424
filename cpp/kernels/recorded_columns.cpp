#include "kernels/recorded_columns.h"

#define PYCRAFT_INSTRUCTION_SET recorded
#include "lanes/lanes.h"

namespace pycraft::kernels::recorded {

template <>
struct BitsOf<Recorded> {
  using type = std::int64_t;  // nothing is asked of them
};

}  // namespace pycraft::kernels::recorded

#include "kernels/mass_matrix_of_columns.h"

namespace pycraft::kernels {

const ColumnKernels<Recorded> recorded_columns{
    recorded::of_columns<recorded::MassMatrixInverse, Recorded, 1>,
    {recorded::of_columns<recorded::MassMatrix<false>, Recorded, 1>, recorded::of_columns<recorded::MassMatrix<true>, Recorded, 1>}};

}  // namespace pycraft::kernels
