#include "dynamics/batches.h"

#include "runtime/of_state.h"

namespace pycraft {

int common_batch(Givens given) {
  int batch = -1;
  for (const Given& g : given) {
    if (g.batch < 0) continue;
    if (batch >= 0 && batch != g.batch)
      throw ModelError("batches of " + std::to_string(batch) + " and " + std::to_string(g.batch) + " states in one call");
    batch = g.batch;
  }
  return batch;
}

void throw_width(const Multibody& model, const std::string& name, int width) {
  throw ModelError(name + " of '" + model.name() + "' takes " + std::to_string(width) + " numbers, or (B, " + std::to_string(width) + ") for a batch");
}

void check_widths(const Multibody& model, Givens given) {
  for (const Given& g : given) {
    const int width = g.is_configuration() ? model.nq() : model.nv();
    if (g.width != width) throw_width(model, g.name, width);
  }
}

void check_given(const Multibody& model, Givens given) {
  check_widths(model, given);
  for (const Given& g : given)
    for (int b = 0; b < (g.batch < 0 ? 1 : g.batch); ++b)
      checking_state(b, g.batch, [&] {
        if (g.is_configuration())
          model.check_q(g.at(b), g.width);
        else
          model.check_v(g.at(b), g.width, g.name);
      });
}

void require_finite(const double* x, size_t n, const Multibody& model) {
  if (!all_finite(x, n))
    throw EvaluationError("a result for '" + model.name() +
                          "' is beyond the range of its numbers: the state, the forces or the masses are too large or too small; take other units, or a wider precision");
}

}  // namespace pycraft
