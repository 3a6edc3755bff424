// Rows of loops (model/loops.h): residuals, the Jacobian Q and Q̇θ̇, in any scalar, without allocation where the buffers have been used before.
//
// X is the pose of the end frame on b in the end frame on a, V its twist, A = V̇ (recursions/frame_motions.h). Every row is g·V = 0, g a function
// of X, and of a row of positions g the gradient of its residual r(X), so that with V = 𝒥θ̇
//
//   Q = g·𝒥,   Qθ̈ + Q̇θ̇ = 0,   Q̇θ̇ = g·𝒥̇θ̇ + ġ·V
//
// exactly, where the loop is open too. What r and g are is said in pair_rows.h.
// Source: A. Jain, Robot and Multibody Dynamics, Springer 2011 (Q of loops).
#pragma once

#include <algorithm>
#include <vector>

#include "model/loops.h"
#include "recursions/loop_pairs.h"
#include "runtime/errors.h"

namespace pycraft {

// The polynomials of a coupling, or its function: constant + Σ P_i(q_i), P_i' per coordinate to entry(i, P_i'), and Σ P_i'' v_i² in `rate`.
template <class S, class F>
S coupling_row(const ResolvedLoop& loop, const S* q, const S* v, LoopBuffers<S>& w, S& rate, F entry) {
  const Coupling& of = loop.loop->coupling;
  const int n = static_cast<int>(of.coordinates.size());
  rate = S(0);
  if (of.function) {
    if constexpr (!std::is_same_v<S, double>) throw EvaluationError("coupling '" + loop.loop->name + "' is a function in double precision; ask for that, or give polynomials");
    w.coordinates.resize(n), w.gradient.resize(n), w.second.resize(n * n);
    for (int i = 0; i < n; ++i) w.coordinates[i] = to_double(q[loop.q[i]]);
    double r = 0;
    of.function(w.coordinates.data(), &r, w.gradient.data(), w.second.data(), nullptr);
    for (int i = 0; i < n; ++i) {
      entry(i, S(w.gradient[i]));
      for (int j = 0; v && j < n; ++j) rate += S(w.second[i * n + j]) * v[loop.v[i]] * v[loop.v[j]];
    }
    return S(r);
  }
  S r(of.constant);
  for (int i = 0; i < n; ++i) {
    const S& x = q[loop.q[i]];
    S value(0), slope(0), half_bend(0);  // Horner's scheme with its derivatives
    for (auto c = of.coordinates[i].coefficients.rbegin(); c != of.coordinates[i].coefficients.rend(); ++c) {
      half_bend = half_bend * x + slope;
      slope = slope * x + value;
      value = value * x + S(*c);
    }
    r += value;
    entry(i, slope);
    if (v) rate += S(2) * half_bend * v[loop.v[i]] * v[loop.v[i]];
  }
  return r;
}

// r (rows), at q.
template <class S>
void loop_residuals(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, LoopBuffers<S>& w, S* residual) {
  for (const ResolvedLoop& loop : loops.loops) {
    if (loop.loop->is_coupling()) {
      S rate;
      residual[loop.first_row] = coupling_row(loop, q, static_cast<const S*>(nullptr), w, rate, [](int, const S&) {});
      continue;
    }
    find_rows(model, loop, q, static_cast<const S*>(nullptr), MotionPart::pose, w);
    for (int i = 0; i < loop.rows; ++i) residual[loop.first_row + i] = w.rows[i].residual;
  }
}

// Calls coupling(loop, i, slope) for every coordinate of a coupling, and pair(loop, X) for a pair, whose rows' gradients are w.rows and whose 𝒥
// is w.columns then.
template <class S, class C, class P>
void visit_loop_rows(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, LoopBuffers<S>& w, C coupling, P pair) {
  for (const ResolvedLoop& loop : loops.loops) {
    if (loop.loop->is_coupling()) {
      S rate;
      coupling_row(loop, q, static_cast<const S*>(nullptr), w, rate, [&](int i, const S& slope) { coupling(loop, i, slope); });
      continue;
    }
    pair(loop, find_rows_and_columns(model, loop, q, w));
  }
}

// entry(row, coordinate, number) of Q at q, for those that may be other than zero.
template <class S, class F>
void loop_jacobian(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, LoopBuffers<S>& w, F entry) {
  visit_loop_rows(
      model, loops, q, w, [&](const ResolvedLoop& loop, int i, const S& slope) { entry(loop.first_row, loop.v[i], slope); },
      [&](const ResolvedLoop& loop, const Pose<S>&) {
        for (int r = 0; r < loop.rows; ++r)
          for (const auto& [i, J] : w.columns) entry(loop.first_row + r, i, dot(w.rows[r].gradient, J));
      });
}

// Q̇θ̇ (rows), at q and v.
template <class S>
void loop_bias(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, const S* v, LoopBuffers<S>& w, S* bias) {
  w.at_rest.assign(model.nv, S(0));
  for (const ResolvedLoop& loop : loops.loops) {
    if (loop.loop->is_coupling()) {
      coupling_row(loop, q, v, w, bias[loop.first_row], [](int, const S&) {});
      continue;
    }
    const RelativeMotion<S> m = find_rows(model, loop, q, v, MotionPart::acceleration, w);
    for (int i = 0; i < loop.rows; ++i) bias[loop.first_row + i] = dot(w.rows[i].gradient, m.A) + w.rows[i].rate;
  }
}

}  // namespace pycraft
