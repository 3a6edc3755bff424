#include "dynamics/recorded_on_loops.h"

#include <string>
#include <vector>

#include "dynamics/constrained_dynamics.h"
#include "model/recorded_model.h"
#include "numerics/recorded_tape.h"
#include "recursions/loop_pairs.h"

namespace pycraft {

kernels::Tape recorded_on_loops(const Multibody& model, const std::shared_ptr<const ResolvedLoops>& loops, const double* q, const double* v, const double* tau, size_t most) {
  check_on_tape<Recorded>(*loops);
  return recorded_tape("dynamics on the loops of '" + model.name() + "'", most, "constrained_dynamics() takes models of any size", [&](Recording& recording) {
    std::vector<Recorded> inputs[3];
    const double* const values[] = {q, v, tau};
    const int sizes[] = {model.nq(), model.nv(), model.nv()};
    for (int a = 0; a < 3; ++a)
      for (int i = 0; i < sizes[a]; ++i) inputs[a].push_back(recording.input(values[a][i], a, i));
    ConstrainedWorkspace<Recorded> workspace(model);
    workspace.accelerate(loops, {inputs[0].data(), inputs[1].data(), inputs[2].data()});
    for (int i = 0; i < model.nv(); ++i) recording.result(i, workspace.result()[i]);
  });
}

}  // namespace pycraft
