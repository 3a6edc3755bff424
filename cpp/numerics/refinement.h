// Iterative refinement of a linear system whose factors are kept:
//
//   r = b - A x,   δ = A⁻¹ r,   x <- x + δ
//
// It contracts by about the relative error of the first solution, down to the floor that the rounding of r leaves. So much of δ as that
// rounding may have made is known, along δ itself (algebra/trees/sweeps/residual_rounding.h), and decides:
//
//   - a δ that may be nothing but rounding is not applied, as x may be better than the residual can tell; one of four roundings of x or less is
//     not even asked, unless motions and forces, all of the residual, are formed in a wider scalar;
//   - a first δ above 0.3 of the solution is refused, for nothing is known then; unless it is small beside terms that cancelled in the
//     solution, and rounding, or followed by a correction that is small;
//   - corrections that do not halve end it, and are refused where they are above 0.3 of the solution.
//
// The correction left over, or the floor where that is larger, is the estimate of the error. A residual in a wider scalar lowers the floor.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "numerics/arithmetic.h"
#include "runtime/errors.h"

namespace pycraft {

constexpr int most_corrections = 20;  // of "auto"

[[noreturn]] inline void throw_no_contraction(const std::string& what, Form form, double ratio) {
  char number[32];
  std::snprintf(number, sizeof number, "%.2g", ratio);
  throw RefinementError("refinement of " + what + " does not contract: the first correction is " + number +
                        " of the solution (0.3 is the limit), so no digit of either is sure; take " + (form == Form::fast ? "form=\"ud\" or " : "") + "a wider precision");
}

// The memory of refinements, and what the last one found.
template <class S>
struct RefinementWork {
  std::vector<S> r, delta, direction, length, rounding, last;
  std::vector<char> open;
  std::vector<double> corrections;  // |δ|/max(|x|, |δ|) of every step, the largest over the columns
};

// The largest of column c of m; what is no number where one is none.
template <class S>
S largest_in_column(const S* v, size_t size, int m, int c) {
  using std::abs;
  S most = S(0);
  for (size_t i = c; i < size; i += m)
    if (const S y = abs(v[i]); !(y <= most)) {
      most = y;
      if (!(y == y)) break;
    }
  return most;
}

// The unit direction of a correction of column c into work.direction, and its length; zeros where the column is not open.
template <class S>
void take_direction(RefinementWork<S>& work, size_t size, int m, int c, const S& correction) {
  using std::sqrt;
  S square = S(0);
  for (size_t i = c; i < size; i += m) {
    work.direction[i] = work.open[c] ? S(work.delta[i] / correction) : S(0);
    square += work.direction[i] * work.direction[i];
  }
  const S length = sqrt(square);
  for (size_t i = c; i < size && work.open[c]; i += m) work.direction[i] /= length;
  work.length[c] = correction * length;
}

// x: n rows of m columns, with terms as large as `largest` that cancelled in it. residual(x, r) and solve(r, δ); what() names the system;
// rounding(w, out): of every column, the most that the rounding of the last residual can make of δ along w, |w| = 1.
template <class S, class What, class Residual, class Solve, class Rounding>
void refine(S* x, int n, int m, const Refinement& how, Form form, const S& largest, What&& what, Residual&& residual, Solve&& solve,
            Rounding&& rounding, RefinementWork<S>& work) {
  const size_t size = size_t(n) * m;
  const S limit = S(0.3), exact = how.wider() ? S(0) : S(S(4) * epsilon<S>());
  for (auto* v : {&work.r, &work.delta, &work.direction})
    if (v->size() < size) v->resize(size);
  work.length.resize(m), work.rounding.assign(m, S(0)), work.last.assign(m, S(0)), work.open.assign(m, 1), work.corrections.clear();
  const S* delta = work.delta.data();
  const auto largest_of = [&](const S* v, int c) { return largest_in_column(v, size, m, c); };
  const int asked = how.steps == Refinement::automatic ? most_corrections : how.steps;
  bool unsure = false;
  for (int step = 0; step < asked || (unsure && step == asked); ++step) {
    residual(x, work.r.data());
    solve(work.r.data(), work.delta.data());
    // directions of the corrections that are more than a few roundings of the solution
    S worst = S(0);
    bool doubt = false;
    for (int c = 0; c < m; ++c) {
      const S correction = largest_of(delta, c), solution = largest_of(x, c);
      if (!std::isfinite(to_double(correction)))
        throw EvaluationError(what() + " overflows: a residual is beyond the range of its numbers; take other units, or a wider precision");
      if (work.open[c] && correction > S(0)) worst = maximum(worst, S(correction / maximum(solution, correction)));
      if (!(correction > exact * solution)) work.open[c] = 0;
      doubt |= bool(work.open[c]);
      take_direction(work, size, m, c, correction);
    }
    work.corrections.push_back(to_double(worst));
    if (!doubt) return;
    rounding(work.direction.data(), work.rounding.data());
    bool applied = false;
    unsure = false;
    for (int c = 0; c < m; ++c) {
      if (!work.open[c]) continue;
      const S length = work.length[c], correction = largest_of(delta, c), solution = largest_of(x, c);
      const bool large = correction > limit * solution;
      if (step == 0 && correction > limit * maximum(solution, S(S(1e3) * epsilon<S>() * largest)))
        throw_no_contraction(what(), form, to_double(S(correction / solution)));
      work.open[c] = length > work.rounding[c];
      if (!work.open[c]) continue;
      if (step > 0 && !(length < work.last[c] / S(2))) {
        if (large) throw_no_contraction(what(), form, to_double(S(correction / solution)));
        work.open[c] = 0;
        continue;
      }
      if (step == asked) {
        if (large) throw_no_contraction(what(), form, to_double(S(correction / solution)));
        continue;
      }
      unsure |= large;
      for (size_t i = c; i < size; i += m) x[i] += delta[i];
      applied = true;
      work.last[c] = length;
      if (!(correction > epsilon<S>() * solution)) work.open[c] = 0;
    }
    if (!applied) return;
  }
}

}  // namespace pycraft
