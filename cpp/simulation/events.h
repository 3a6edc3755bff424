// Events: functions g(t, x) whose zeros are looked for along a run.
//
// A zero lies in a step at whose ends g has different signs. It is found by Chandrupatla's method on the states that the integrator itself gives within
// the step, so that state and time are as good as at the end of a step, the time to rounding. Where g is zero at the start, its sign is that
// of the first step's end, and nothing has happened.
// Source: T. R. Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without using derivatives,
// Advances in Engineering Software 28, 1997.
#pragma once

#include <algorithm>
#include <functional>
#include <string>
#include <vector>

#include "numerics/scalar.h"

namespace pycraft {

struct EventKind {
  std::string name;
  int direction = 0;       // of g where it counts: 1 rising, -1 falling, 0 both
  bool terminal = false;   // whether the run ends there
  bool ends_step = false;  // whether a step does
};

template <class S>
struct EventFunctions {
  std::vector<EventKind> kinds;
  std::function<S(int event, const S& t, const std::vector<S>& x)> value;
  std::function<void(const S& t, const std::vector<S>& x, S* out)> all;  // values of all, where that is less than one by one
};

template <class S>
struct Crossing {
  int event;
  bool counts;  // in its direction
  S t;
  std::vector<S> x;
};

// A zero of f between a and b, where it is fa and fb, of different signs: to the rounding of the arguments.
template <class S, class F>
S zero_between(S a, S fa, S b, S fb, F f) {
  using std::abs;
  // x1 the last guess, x2 on the other side of the zero, x3 the one before.
  S x1 = b, f1 = fb, x2 = a, f2 = fa, x3 = a, f3 = fa, share = S(0.5);
  for (int i = 0; i < 300; ++i) {
    const S x = x1 + share * (x2 - x1), fx = f(x);
    if ((fx > S(0)) == (f1 > S(0)))
      x3 = x1, f3 = f1;
    else
      x3 = x2, f3 = f2, x2 = x1, f2 = f1;
    x1 = x, f1 = fx;
    const S& best = abs(f2) < abs(f1) ? x2 : x1;
    const S least = S(2) * epsilon<S>() * std::max(S(abs(x1)), S(abs(x2))) / abs(x2 - x1);
    if (least > S(0.5) || f1 == S(0)) return f1 == S(0) ? x1 : best;
    const S xi = (x1 - x2) / (x3 - x2), phi = (f1 - f2) / (f3 - f2), rest = S(1) - phi;
    share = S(0.5);
    if (phi * phi < xi && rest * rest < S(1) - xi) share = f1 / (f2 - f1) * f3 / (f2 - f3) + (x3 - x1) / (x2 - x1) * f1 / (f3 - f1) * f2 / (f3 - f2);
    share = std::min(std::max(share, least), S(S(1) - least));
  }
  return x1;
}

template <class S>
class EventWatch {
 public:
  using State = std::vector<S>;
  explicit EventWatch(const EventFunctions<S>& functions) : functions_(functions), signs_(functions.kinds.size(), 0), values_(functions.kinds.size()) {}

  bool any() const { return !signs_.empty(); }
  // Signs that were kept, or those at the start.
  void begin(const S& t, const State& x, const std::vector<int>* kept) {
    if (any()) evaluate(t, x);
    for (size_t i = 0; i < signs_.size(); ++i) signs_[i] = kept && i < kept->size() ? (*kept)[i] : sign(values_[i]);
  }
  const std::vector<int>& signs() const { return signs_; }

  // What happens from (t0, x0) to (t1, x1), in order; within(t, x): the state at t between.
  template <class Within>
  std::vector<Crossing<S>> in_step(const S& t0, const State& x0, const S& t1, const State& x1, Within within) {
    std::vector<Crossing<S>> found;
    evaluate(t1, x1);
    for (size_t i = 0; i < signs_.size(); ++i) {
      const int event = static_cast<int>(i), direction = functions_.kinds[i].direction;
      const S g1 = values_[i];
      if (signs_[i] == 0) signs_[i] = sign(g1);
      if (signs_[i] == 0 || sign(g1) == signs_[i]) continue;
      const bool counts = direction == 0 || direction == -signs_[i];
      Crossing<S> c{event, counts, t1, x1};
      if (counts && sign(g1) != 0) {
        const S g0 = functions_.value(event, t0, x0);
        c.t = sign(g0) != signs_[i] ? t0 : zero_between(t0, g0, t1, g1, [&](const S& t) {
          within(t, c.x);
          return functions_.value(event, t, c.x);
        });
        if (c.t == t0)
          c.x = x0;
        else if (c.t == t1)
          c.x = x1;
        else
          within(c.t, c.x);
      }
      found.push_back(std::move(c));
    }
    std::stable_sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.t < b.t; });
    return found;
  }
  // That one has happened.
  void pass(const Crossing<S>& c) { signs_[c.event] = -signs_[c.event]; }

 private:
  static int sign(const S& g) { return g > S(0) ? 1 : g < S(0) ? -1 : 0; }
  void evaluate(const S& t, const State& x) {
    if (functions_.all) return functions_.all(t, x, values_.data());
    for (size_t i = 0; i < values_.size(); ++i) values_[i] = functions_.value(static_cast<int>(i), t, x);
  }
  const EventFunctions<S>& functions_;
  std::vector<int> signs_;
  State values_;
};

}  // namespace pycraft
