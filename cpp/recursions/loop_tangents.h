// ∂Q along velocities w of the tree, and along twists inserted in its hinges (loop_rows.h): the rows' own code with derivatives carried along,
// q̇ = N(q) w; of a user's function, which is in double precision, its second derivatives, and third ones where S carries derivatives:
//
//   ∂Q(row, i) = Σ_j ∂²r/∂q_i ∂q_j w_j
//
// S may carry derivatives itself: those of ∂Q along a second direction, along which w may move too.
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "algebra/language/symbol_arguments.h"
#include "model/configuration.h"
#include "numerics/tangent.h"
#include "recursions/loop_rows.h"

namespace pycraft {

// A direction: velocities of the tree (nv), and inserted twists with how much of each.
template <class S>
struct LoopMotion {
  std::vector<S> w;
  std::vector<std::pair<double, OfTwist>> twists;
};

template <class S>
class LoopTangents {
 public:
  using T = Tangent<S, 1>;
  // `inserted`: twists that S carries derivatives along already.
  LoopTangents(const CompiledModel<S>& numbers, const ResolvedLoops& loops, const std::vector<S>& at, const LoopMotion<S>& along,
               const std::vector<InsertedMotion<S>>& before = {})
      : model(broadcast<T>(numbers)), q(at.begin(), at.end()), loops_(loops), at_(at), along_(along.w) {
    std::vector<S> rate(at.size());
    configuration_rate(numbers, at.data(), along.w.data(), rate.data());
    for (size_t i = 0; i < q.size(); ++i) q[i].d[0] = rate[i];
    by_rule.rows = loops.rows;
    for (const ResolvedLoop& loop : loops.loops)
      if (!loop.loop->coupling.function) by_rule.loops.push_back(loop);
    for (const InsertedMotion<S>& of : before) inserted.push_back({of.body, of.position, cast<T>(of.twist)});
    for (const auto& [amount, of] : along.twists) {
      inserted.push_back({of.body, of.position, Vector6<T>::zero()});
      inserted.back().twist[of.component].d[0] = S(amount);
    }
    std::stable_sort(inserted.begin(), inserted.end(), [](const auto& a, const auto& b) { return a.position < b.position; });
  }
  // put(row, coordinate, entry) of ∂Q, each to be added.
  template <class Put>
  void jacobian(Put put) const {
    LoopBuffers<T> buffers;
    buffers.inserted = inserted;
    loop_jacobian(model, by_rule, q.data(), buffers, [&](int row, int i, const T& number) { put(row, i, number.d[0]); });
    for (const ResolvedLoop& loop : loops_.loops)
      if (loop.loop->coupling.function) of_function(loop, put);
  }

  CompiledModel<T> model;
  std::vector<T> q;
  std::vector<InsertedMotion<T>> inserted;
  ResolvedLoops by_rule;  // loops whose code carries derivatives

 private:
  template <class X>
  static double rate(const X&) { return 0; }
  template <class X>
  static double rate(const Tangent<X, 1>& x) { return to_double(x.d[0]); }
  // ∂²r in S: its rate is that of third derivatives.
  template <class X>
  static void set(X& number, double value, double) { number = X(value); }
  template <class X>
  static void set(Tangent<X, 1>& number, double value, double rate) { number = Tangent<X, 1>(value), number.d[0] = X(rate); }

  template <class Put>
  void of_function(const ResolvedLoop& loop, Put put) const {
    const size_t n = loop.v.size();
    std::vector<double> at(n), rates(n), gradient(n), second(n * n), third(n * n * n);
    for (size_t i = 0; i < n; ++i) at[i] = to_double(at_[loop.q[i]]), rates[i] = rate(at_[loop.q[i]]);
    const bool moves = std::any_of(rates.begin(), rates.end(), [](double one) { return one != 0; });
    double r = 0;
    loop.loop->coupling.function(at.data(), &r, gradient.data(), second.data(), moves ? third.data() : nullptr);
    for (size_t i = 0; i < n; ++i)
      for (size_t j = 0; j < n; ++j) {
        double along_second = 0;
        for (size_t k = 0; k < n; ++k) along_second += third[(i * n + j) * n + k] * rates[k];
        S entry;
        set(entry, second[i * n + j], along_second);
        put(loop.first_row, loop.v[i], S(entry * along_[loop.v[j]]));
      }
  }
  const ResolvedLoops& loops_;
  const std::vector<S>& at_;
  const std::vector<S> along_;
};

}  // namespace pycraft
