// Iterative refinement of a linear system whose factors are kept:
//
//   r = b - A x,   δ = A⁻¹ r,   x <- x + δ
//
// It contracts by about the relative error of the first solution, and |δ|/|x| is the estimate of that error. A first correction above 0.3
// of the solution is refused: nothing is known then. It ends where corrections no longer halve, which is at the floor of the residual's
// own rounding; a residual in a wider scalar lowers the floor.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "algebra/arithmetic.h"
#include "algebra/errors.h"

namespace pycraft {

constexpr int most_corrections = 20;  // of "auto"

[[noreturn]] inline void throw_no_contraction(const std::string& what, Form form, double ratio) {
  char number[32];
  std::snprintf(number, sizeof number, "%.2g", ratio);
  throw RefinementError("refinement of " + what + " does not contract: the first correction is " + number +
                        " of the solution (0.3 is the limit), so no digit of either is sure; take " + (form == Form::fast ? "form=\"ud\" or " : "") + "a wider precision");
}

// x: n rows of m columns, with terms as large as `largest` that cancelled in it: a solution that is nothing but their rounding is not
// refused. residual(x, r) and solve(r, δ); what() names the system.
// corrections receives |δ|/|x| of every step, the largest over the columns.
template <class S, class What, class Residual, class Solve>
void refine(S* x, int n, int m, const Refinement& how, Form form, const S& largest, What&& what, Residual&& residual, Solve&& solve,
            std::vector<S>& r, std::vector<S>& delta, std::vector<double>& corrections) {
  using std::abs;
  const size_t size = size_t(n) * m;
  r.resize(std::max(r.size(), size)), delta.resize(std::max(delta.size(), size));
  corrections.clear();
  const int steps = how.steps == Refinement::automatic ? most_corrections : how.steps;
  S last = S(0);
  for (int step = 0; step < steps; ++step) {
    residual(x, r.data());
    solve(r.data(), delta.data());
    S worst = S(0), sure = S(0);
    for (int c = 0; c < m; ++c) {
      S correction = S(0), solution = S(0);
      for (size_t i = c; i < size; i += m) {
        const S d = abs(delta[i]), y = abs(x[i]);
        if (!(d <= correction)) correction = d;
        if (!(y <= solution)) solution = y;
      }
      if (correction == S(0)) continue;
      const S ratio = correction / maximum(solution, correction);
      if (!(ratio <= worst)) worst = ratio;
      // what cancelled in the solution has left its own rounding, which no form would do better
      const S judged = correction / maximum(solution, S(S(1e3) * epsilon<S>() * largest));
      if (!(judged <= sure)) sure = judged;
    }
    if (!std::isfinite(to_double(sure))) throw EvaluationError(what() + " overflows: a residual is beyond the range of its numbers; take other units, or a wider precision");
    corrections.push_back(to_double(worst));
    if (step == 0 && !(sure <= S(0.3))) throw_no_contraction(what(), form, to_double(sure));
    if (step > 0 && !(worst < last / S(2))) return;
    for (size_t i = 0; i < size; ++i) x[i] += delta[i];
    if (worst <= epsilon<S>()) return;
    last = worst;
  }
}

}  // namespace pycraft
