#include "kernels/taped_calls.h"

#include <numeric>

#include "runtime/errors.h"
#include "runtime/interrupt.h"

#define PYCRAFT_INSTRUCTION_SET traced
#include "kernels/traced.h"
// Kernels after the number that they run on.
#include "kernels/forward_dynamics.h"
#include "kernels/inverse_dynamics.h"
#include "kernels/mass_matrix_inverse.h"
#include "kernels/mass_matrix_of_links.h"

namespace pycraft::kernels {

using traced::Number;

Tape tape_of(const Links<double>& links, Call call, const double* gravity, bool with_u, int size) {
  Tape tape;
  const std::vector<double> q(links.nq + 1), v(links.nv + 1), u(links.nv + 1);  // never read: places alone
  const States<double> at{q.data(), v.data(), with_u ? u.data() : nullptr, 0, 0, 0, 1, gravity, nullptr, check_interrupt};
  traced::Recording recording{tape, at, links.nq, links.nv};
  std::vector<double> out(size);
  size_t bytes = 0;
  switch (call) {
    case Call::forward_dynamics: bytes = traced::ForwardWork<Number>::size(links); break;
    case Call::inverse_dynamics: bytes = links.count * sizeof(traced::InverseLink<Number>); break;
    case Call::mass_matrix: bytes = traced::MatrixWork<Number>::size(links); break;
    case Call::mass_matrix_inverse: bytes = traced::ForwardWork<Number>::size(links) + traced::InverseWork<Number>::size(links); break;
    default: throw EvaluationError("this call is not compiled");
  }
  std::vector<double> work(bytes / sizeof(double) + 2);
  struct Recorded {
    explicit Recorded(traced::Recording& r) { traced::recording = &r; }
    ~Recorded() { traced::recording = nullptr; }
  } recorded(recording);
  switch (call) {
    case Call::forward_dynamics: traced::forward_dynamics<Number>(links, at, out.data(), size, work.data()); break;
    case Call::inverse_dynamics: traced::inverse_dynamics<Number>(links, at, out.data(), size, work.data()); break;
    case Call::mass_matrix: traced::mass_matrix<Number>(links, at, out.data(), size, work.data()); break;
    case Call::mass_matrix_inverse: traced::mass_matrix_inverse<Number>(links, at, out.data(), size, work.data()); break;
    default: break;
  }
  for (int i = 0; i < size; ++i) tape.results.push_back({i, static_cast<int>(out[i])});
  return tape;
}

}  // namespace pycraft::kernels
