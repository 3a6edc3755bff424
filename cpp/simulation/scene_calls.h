// Calls of a scene from any number of threads, at one precision: a compiled scene for each, kept from call to call.
#pragma once

#include <tuple>
#include <utility>

#include "dynamics/workspace_pool.h"
#include "numerics/arithmetic.h"
#include "runtime/errors.h"
#include "simulation/compiled_scene.h"

namespace pycraft {

class SceneCalls {
 public:
  // EvaluationError for a precision in which no scene runs.
  SceneCalls(Scene scene, const Solving& how, Precision precision) : scene_(std::move(scene)), how_(how), precision_(precision) {
    if (precision != Precision::double_ && precision != Precision::extended && precision != Precision::quad)
      throw EvaluationError("trajectories and scenes are computed in precision 'double', 'extended' or 'quad', not '" + std::string(precision_name(precision)) + "'");
  }

  const Scene& scene() const { return scene_; }
  Precision precision() const { return precision_; }
  // f(scene compiled), in the scalar of the precision. While the caller holds a ModelInUse.
  template <class F>
  void with(F f) {
    switch (precision_) {
      case Precision::extended: return in_pool<Extended>(f);
      case Precision::quad: return in_pool<Quad>(f);
      default: return in_pool<double>(f);
    }
  }

 private:
  template <class S, class F>
  void in_pool(F& f) {
    std::get<WorkspacePool<CompiledScene<S>>>(pools_).with(scene_.model(), f, [this] { return CompiledScene<S>(scene_, how_); });
  }
  Scene scene_;
  Solving how_;
  Precision precision_;
  std::tuple<WorkspacePool<CompiledScene<double>>, WorkspacePool<CompiledScene<Extended>>, WorkspacePool<CompiledScene<Quad>>> pools_;
};

}  // namespace pycraft
