// `operator @ array` of a contiguous float64 array, past pybind11's dispatcher: the slot of the type itself.
#pragma once

#include "bindings/bindings.h"

namespace pycraft {

// After `__matmul__` is defined: that still takes whatever else is given, and says what is wrong.
void take_plain_products(const py::object& type);

}  // namespace pycraft
