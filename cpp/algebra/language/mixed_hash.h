// Hashes of what has parts.
#pragma once

#include <cstddef>

namespace pycraft {

inline size_t mix(size_t seed, size_t value) { return seed ^ (value * 0x9e3779b97f4a7c15ULL + 0x7f4a7c15ULL + (seed << 6) + (seed >> 2)); }

}  // namespace pycraft
