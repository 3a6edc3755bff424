// Events: functions g(t, x) whose zeros are looked for along a run.
//
// A zero lies in a step at whose ends g has different signs, two in one within which g turned: it went towards zero at first, and away from it at
// last. At the end of a run one is found as well that is due later by no more than what times are rounded to. Where a function turned is found on what the method has between the ends of a step, by the zero of its rate, until the tangents on both sides say that
// it keeps away from zero. Rates of the equations' own functions are known; those of others are differences. The zeros themselves are found by Chandrupatla's method on the states that the integrator itself gives within
// the step, so that state and time are as good as at the end of a step, the time to rounding. Where g is zero at the start, its sign is that
// of the first step's end, and nothing has happened.
// Source: T. R. Chandrupatla, A new hybrid quadratic/bisection algorithm for finding the zero of a nonlinear function without using derivatives,
// Advances in Engineering Software 28, 1997.
#pragma once

#include <algorithm>
#include <cmath>
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
  bool told = false;       // it has no zeros: the equations tell when it happens
};

template <class S>
struct EventFunctions {
  std::vector<EventKind> kinds;
  std::function<S(int event, const S& t, const std::vector<S>& x)> value;
  std::function<void(const S& t, const std::vector<S>& x, S* out)> all;  // values of all, where that is less than one by one
  std::function<void(const S& t, const std::vector<S>& x, S* out)> rates;  // of the first `known`
  size_t known = 0;
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
    before_ = values_, known_ = any();
    for (size_t i = 0; i < signs_.size(); ++i) signs_[i] = kept && i < kept->size() ? (*kept)[i] : sign(values_[i]);
  }
  const std::vector<int>& signs() const { return signs_; }
  // The next step does not begin where the last one ended.
  void forget() { known_ = false; }

  // What happens from (t0, x0) to (t1, x1), in order; within(t, x): the state at t between; roughly(t, x): the same at less cost. due: what happens
  // later by no more than that happens at t1.
  template <class Within, class Roughly>
  std::vector<Crossing<S>> in_step(const S& t0, const State& x0, const S& t1, const State& x1, Within within, Roughly roughly, const S& due) {
    std::vector<Crossing<S>> found;
    if (!known_) evaluate(t0, x0), before_ = values_;
    evaluate(t1, x1);
    look_for_turns(t0, x0, t1, x1, within, roughly, due, found);
    before_ = values_, known_ = true;
    for (size_t i = 0; i < signs_.size(); ++i) {
      const int event = static_cast<int>(i), direction = functions_.kinds[i].direction;
      const S g1 = values_[i];
      if (signs_[i] == 0) signs_[i] = sign(g1);
      if (signs_[i] == 0 || sign(g1) == signs_[i]) continue;
      const bool counts = direction == 0 || direction == -signs_[i];
      Crossing<S> c{event, counts, t1, x1};
      if (counts && sign(g1) != 0) {
        S a = t0, ga = before_[i];
        // Where the last step ended on the zero itself, to rounding, it goes beyond before it comes back.
        for (int k = 1; k < 40 && sign(ga) != signs_[i]; ++k) {
          a = t0 + (t1 - t0) * S(std::ldexp(1.0, -k));
          within(a, c.x);
          ga = functions_.value(event, a, c.x);
        }
        c.t = sign(ga) != signs_[i] ? t0 : zero_between(a, ga, t1, g1, [&](const S& t) {
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
  // The two zeros of what was beyond within a step, and is not at its ends.
  template <class Within, class Roughly>
  void look_for_turns(const S& t0, const State& x0, const S& t1, const State& x1, Within within, Roughly roughly, const S& due, std::vector<Crossing<S>>& found) {
    const size_t n = functions_.known;
    if (n > 0) {
      for (State* rates : {&first_rates_, &last_rates_}) rates->resize(n);
      functions_.rates(t0, x0, first_rates_.data()), functions_.rates(t1, x1, last_rates_.data());
    }
    const S part = (t1 - t0) / S(1024), length = t1 < t0 ? t0 - t1 : t1 - t0;
    bool near_ends = false;
    for (size_t i = 0; i < signs_.size(); ++i) {
      const int event = static_cast<int>(i), s = signs_[i];
      if (s == 0 || sign(before_[i]) != s || sign(values_[i]) != s || functions_.kinds[i].told) continue;
      S first, last;
      if (i < n) {
        first = S(s) * first_rates_[i] * (t1 - t0), last = S(s) * last_rates_[i] * (t1 - t0);
      } else {
        if (!near_ends) roughly(t0 + part, near_first_), roughly(t1 - part, near_last_), near_ends = true;
        first = S(1024) * S(s) * (functions_.value(event, t0 + part, near_first_) - before_[i]);
        last = S(1024) * S(s) * (values_[i] - functions_.value(event, t1 - part, near_last_));
      }
      if (last < S(0) && !(S(s) * values_[i] * length > -last * due)) {
        const int direction = functions_.kinds[i].direction;
        found.push_back({event, direction == 0 || direction == -s, t1, x1});
        continue;
      }
      S at = t0;
      if (!(first < S(0)) || !(last > S(0)) || !beyond_between(event, t0, t1, first, last, roughly, at)) continue;
      State x;
      const int direction = functions_.kinds[i].direction;
      if (functions_.kinds[i].ends_step) {  // beyond its zero the motion is another one: the states of this step are none there
        const auto rough = [&](const S& t) {
          roughly(t, x);
          return functions_.value(event, t, x);
        };
        const auto exact = [&](const S& t) {
          within(t, x);
          return functions_.value(event, t, x);
        };
        S zero = zero_between(t0, before_[i], at, rough(at), rough);
        const S a = maximum(S(zero - length * S(1e-6)), t0), b = minimum(S(zero + length * S(1e-6)), at), ga = exact(a), gb = exact(b);
        if (sign(ga) == s && sign(gb) == -s) zero = zero_between(a, ga, b, gb, exact);
        Crossing<S> c{event, direction == 0 || direction == -s, zero, {}};
        within(c.t, c.x);
        found.push_back(std::move(c));
        continue;
      }
      within(at, x);
      const S g = functions_.value(event, at, x);
      if (sign(g) == s) continue;
      const auto zero = [&](const S& a, const S& ga, const S& b, const S& gb) {
        return sign(g) == 0 ? at : zero_between(a, ga, b, gb, [&](const S& t) {
          within(t, x);
          return functions_.value(event, t, x);
        });
      };
      for (const bool back : {false, true}) {
        Crossing<S> c{event, direction == 0 || direction == (back ? s : -s), back ? zero(at, g, t1, values_[i]) : zero(t0, before_[i], at, g), {}};
        within(c.t, c.x);
        found.push_back(std::move(c));
      }
    }
  }
  // Whether a function that goes towards zero at t0 and away from it at t1 passes it, and a time at which it has. first, last: its rates there,
  // away from zero, times the step's size.
  template <class Roughly>
  bool beyond_between(int event, const S& t0, const S& t1, S first, S last, Roughly roughly, S& at) {
    const int s = signs_[event];
    S a = S(0), b = S(1), ga = S(s) * before_[event], gb = S(s) * values_[event];
    for (int i = 0; i < 60; ++i) {
      const S meet = (gb - ga - last * (b - a)) / (first - last), lowest = ga + first * meet;  // of the tangents
      if (lowest > std::min(ga, gb) / S(2) || !(b - a > S(1e-9))) return false;
      const S share = first / (first - last), c = a + (b - a) * std::min(std::max(share, S(0.05)), S(0.95));
      at = t0 + c * (t1 - t0);
      roughly(at, near_state_);
      const S gc = S(s) * functions_.value(event, at, near_state_);
      if (!(gc > S(0))) return true;
      S rate;
      if (static_cast<size_t>(event) < functions_.known) {
        between_rates_.resize(functions_.known);
        functions_.rates(at, near_state_, between_rates_.data());
        rate = S(s) * between_rates_[event] * (t1 - t0);
      } else {
        const S part = (b - a) / S(1024);
        roughly(t0 + (c + part) * (t1 - t0), near_state_);
        rate = (S(s) * functions_.value(event, t0 + (c + part) * (t1 - t0), near_state_) - gc) / part;
      }
      if (rate < S(0))
        a = c, ga = gc, first = rate;
      else if (rate > S(0))
        b = c, gb = gc, last = rate;
      else
        return false;
    }
    return false;
  }
  static S maximum(const S& a, const S& b) { return a < b ? b : a; }
  static S minimum(const S& a, const S& b) { return a < b ? a : b; }
  static int sign(const S& g) { return g > S(0) ? 1 : g < S(0) ? -1 : 0; }
  void evaluate(const S& t, const State& x) {
    if (functions_.all) return functions_.all(t, x, values_.data());
    for (size_t i = 0; i < values_.size(); ++i) values_[i] = functions_.value(static_cast<int>(i), t, x);
  }
  const EventFunctions<S>& functions_;
  std::vector<int> signs_;
  State values_, before_;  // at the end of the last step, and at its start
  bool known_ = false;     // before_ is that of the next step
  State first_rates_, last_rates_, between_rates_, near_first_, near_last_, near_state_;
};

}  // namespace pycraft
