// ∂Q along velocities w of the tree (loop_rows.h): the rows' own code with derivatives carried along, q̇ = N(q) w; of a user's function, which is in
// double precision, its second derivatives:
//
//   ∂Q(row, i) = Σ_j ∂²r/∂q_i ∂q_j w_j
#pragma once

#include <vector>

#include "model/configuration.h"
#include "numerics/tangent.h"
#include "recursions/loop_rows.h"

namespace pycraft {

template <class S>
class LoopTangents {
 public:
  using T = Tangent<S, 1>;
  LoopTangents(const CompiledModel<S>& numbers, const ResolvedLoops& loops, const std::vector<S>& at, const std::vector<S>& along)
      : model(broadcast<T>(numbers)), q(at.begin(), at.end()), loops_(loops), at_(at), along_(along) {
    std::vector<S> rate(at.size());
    configuration_rate(numbers, at.data(), along.data(), rate.data());
    for (size_t i = 0; i < q.size(); ++i) q[i].d[0] = rate[i];
    by_rule.rows = loops.rows;
    for (const ResolvedLoop& loop : loops.loops)
      if (!loop.loop->coupling.function) by_rule.loops.push_back(loop);
  }
  // put(row, coordinate, entry) of ∂Q, each to be added.
  template <class Put>
  void jacobian(Put put) const {
    LoopBuffers<T> buffers;
    loop_jacobian(model, by_rule, q.data(), buffers, [&](int row, int i, const T& number) { put(row, i, number.d[0]); });
    for (const ResolvedLoop& loop : loops_.loops)
      if (loop.loop->coupling.function) of_function(loop, put);
  }

  CompiledModel<T> model;
  std::vector<T> q;
  ResolvedLoops by_rule;  // loops whose code carries derivatives

 private:
  template <class Put>
  void of_function(const ResolvedLoop& loop, Put put) const {
    const size_t n = loop.v.size();
    std::vector<double> at(n), gradient(n), second(n * n);
    for (size_t i = 0; i < n; ++i) at[i] = to_double(at_[loop.q[i]]);
    double r = 0;
    loop.loop->coupling.function(at.data(), &r, gradient.data(), second.data());
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j) put(loop.first_row, loop.v[i], S(S(second[i * n + j]) * along_[loop.v[j]]));
  }
  const ResolvedLoops& loops_;
  const std::vector<S>&at_, &along_;
};

}  // namespace pycraft
