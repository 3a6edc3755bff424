// What a library built of compiled source offers (pycraft/compiled/source.py), loaded.
#pragma once

#include <cstdint>
#include <string>

#include <dlfcn.h>

#include "runtime/errors.h"

namespace pycraft {

// The results at `states` states, given[i] + b strides[i] the input i of state b; how many of them are in doubt.
using CompiledRun = std::int64_t (*)(const double* const* given, const std::int64_t* strides, double* out, std::int64_t states);

inline CompiledRun load_compiled(const std::string& library, const std::string& function) {
  void* const loaded = dlopen(library.c_str(), RTLD_NOW | RTLD_LOCAL);  // never unloaded: functions may run for as long as Python does
  void* const run = loaded ? dlsym(loaded, function.c_str()) : nullptr;
  if (!run) throw EvaluationError("'" + library + "' cannot be loaded: " + dlerror());
  return reinterpret_cast<CompiledRun>(run);
}

}  // namespace pycraft
