// Direct calls of forward dynamics on loops, of one state or a batch, at any precision to quad: by tree augmentation (constrained_dynamics.h), and
// by constraint embedding (embedded_dynamics.h).
#pragma once

#include <memory>
#include <vector>

#include "dynamics/constrained_dynamics.h"
#include "dynamics/embedded_dynamics.h"

namespace pycraft {

struct AskedOnLoops {
  Given q, v, input, wrenches;                // input: T of accelerations, an impulse p of velocities
  const PushedNodes* pushed = nullptr;
  Form form = Form::fast;
  Refinement refinement;
  Precision precision = Precision::double_;
  double alpha = 0, beta = 0;                 // of augmentation
  bool velocities = false;                    // of augmentation
  std::vector<int> independent;               // of embedding, at every state; none: chosen at each state by itself
};
// A state: θ̈ or v⁺ (nv), λ (rows), of each loop the force on b and on a (6 each, in their axes about their origins), the rank of Q.
struct ResultsOnLoops {
  double *x, *multipliers, *forces;
  int* rank;
};

template <template <class> class Workspace>
class CallsOnLoops : public Batches<Workspace> {
 public:
  explicit CallsOnLoops(std::shared_ptr<LoopSet> loops) : Batches<Workspace>(loops->shared_model()), loops_(std::move(loops)) {}
  void run(const AskedOnLoops& asked, const ResultsOnLoops& out);

 private:
  std::shared_ptr<LoopSet> loops_;
};
using ConstrainedDynamics = CallsOnLoops<ConstrainedWorkspace>;
using EmbeddedDynamics = CallsOnLoops<EmbeddedWorkspace>;

extern template class CallsOnLoops<ConstrainedWorkspace>;
extern template class CallsOnLoops<EmbeddedWorkspace>;

}  // namespace pycraft
