// What takes the steps of a run: a method, and the sizes of its steps, which are chosen by it (ControlledSteps) or all the same (FixedSteps).
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "model/checks.h"
#include "numerics/scalar.h"
#include "runtime/errors.h"
#include "simulation/equations.h"
#include "simulation/integrators/integrator.h"

namespace pycraft {

// Of the first `count`, or of all.
template <class S>
bool all_finite(const std::vector<S>& x, int count = -1) {
  return std::all_of(x.begin(), count < 0 ? x.end() : x.begin() + count, [](const S& y) { return std::isfinite(to_double(y)); });
}
// Of what the motion is; integrals beside it decide about nothing.
template <class S>
bool finite_motion(const Equations<S>& equations, const std::vector<S>& x) {
  return all_finite(x, equations.size() - equations.integrals());
}

// What an error says that came while a run was at t.
inline std::string while_integrating(const Error& error, double t) { return error.what() + ("; integrating, at t = " + short_number(t) + " s"); }

// What the next step depends on besides the state.
template <class S>
struct Pace {
  S size = S(0);    // controlled: to be tried next, with a sign; fixed: of every step
  S origin = S(0);  // fixed: the time from which steps are counted
  long taken = 0;   // fixed: and how many were taken since; switching_steps.h: its method and what it counts
};

template <class S>
class Stepper {
 public:
  using State = std::vector<S>;
  virtual ~Stepper() = default;
  // A run from (t, x) to `last`; resumed: as one that was left with this pace.
  virtual void start(const S& t, const State& x, const S& last, const Pace<S>* resumed) = 0;
  // Where the piece that begins next would end if nothing were asked for before, infinite: nowhere. Told before `begin`.
  virtual void plan(const S&) {}
  // The next piece of it, to `end`: no step goes beyond.
  virtual void begin(const S& t, const State& x, const S& end) = 0;
  // One step; t is the end itself where it is reached. EvaluationError where no step can be taken.
  virtual void advance(S& t, State& x) = 0;
  // Whether the last step was cut short by the end of its piece, or follows, in this piece, from an attempt that was: a longer piece has other steps then.
  bool cut() const { return cut_; }
  // x is another one than the last step ended with.
  virtual void forget() {}

  // The state at t within a step that began at (from, x), to the method's own accuracy.
  virtual void within(const S& from, const State& x, const S& t, State& out) = 0;
  // The same by the method's dense output of the last step. False where it has none.
  virtual bool interpolate(const S&, State&) { return false; }
  // Takes the step from (from, x) to `to` again, whatever its error, for interpolate. False where that has none.
  virtual bool again(const S&, const State&, const S&) { return false; }
  // Of how many steps, up to the last, stability seems to have held the size, and not accuracy: the motion is stiff. doubt(): it is not, as was found
  // otherwise; what is counted begins a thousand steps later.
  virtual int held() const { return 0; }
  virtual void doubt() {}
  // Which of several methods took the last step; 0 of one alone.
  virtual int method() const { return 0; }

  const Pace<S>& pace() const { return pace_; }
  long rejected() const { return rejected_; }

 protected:
  Pace<S> pace_;
  bool cut_ = false;
  long rejected_ = 0;
};

// The component of x that changes most in no time, measured by the tolerances: what errors point at.
template <class S>
std::string fastest_of(Equations<S>& equations, const std::vector<S>& x, const S& t, const IntegratorOptions& options) {
  using std::abs;
  std::vector<S> rate(x.size());
  equations(x, rate, t);
  int worst = 0;
  double most = -1;
  for (int i = 0; i < equations.size() - equations.integrals(); ++i) {
    const double change = to_double(S(abs(rate[i]) / (S(options.atol) + S(options.rtol) * abs(x[i]))));
    if (!(change <= most)) most = std::isnan(change) ? HUGE_VAL : change, worst = i;
  }
  return x.empty() ? "nothing" : equations.name_of(worst) + " changes fastest there, by " + short_number(to_double(rate[worst])) + " a second";
}

// A method that judges its own steps.
template <class S>
class Attempts {
 public:
  using State = std::vector<S>;
  virtual ~Attempts() = default;
  // A step of size h, if its error allows; h is then the size for the next one, or for another try.
  virtual bool attempt(S& t, State& x, S& h) = 0;
  virtual void forget() {}
  virtual bool interpolate(const S&, State&) { return false; }
  virtual bool again(const S&, const State&, const S&) { return false; }
  // h |λ| of the last step over that at which the method becomes unstable, λ the fastest rate that its stages saw; 0: not known.
  virtual double share_of_stability() const { return 0; }
};

// The size of h |λ|, by the last two stages, both at the end of a step: |h (k - k')| / |y - y'|. apart: weights of y - y'; count: of numbers of the motion.
// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Springer 1996, IV.2.
template <class S>
double stiffness_of_stages(Stages<S>& stages, const Weights<S>& apart, int last, int count, std::vector<S>& scratch, const S& h) {
  stages.sum(apart, scratch);
  double above = 0, below = 0;
  for (int i = 0; i < count; ++i) {
    const double k = to_double(S(stages.k(last)[i] - stages.k(last - 1)[i])), y = to_double(scratch[i]);
    above += k * k, below += y * y;
  }
  return below > 0 ? std::abs(to_double(h)) * std::sqrt(above / below) : 0;
}

template <class S>
class ControlledSteps : public Stepper<S> {
 public:
  using State = std::vector<S>;
  // Twice the same method: one for the run, one for states within its steps.
  ControlledSteps(Equations<S>& equations, std::unique_ptr<Attempts<S>> method, std::unique_ptr<Attempts<S>> beside, const IntegratorOptions& options)
      : equations_(equations), method_(std::move(method)), beside_(std::move(beside)), options_(options) {}

  void start(const S& t, const State& x, const S& last, const Pace<S>* resumed) override {
    using std::abs;
    whole_ = abs(last - t);
    pace_.size = resumed ? resumed->size : (last < t ? S(-1) : S(1)) * first_step(t, x);
  }
  void begin(const S&, const State&, const S& end) override { end_ = end, cut_ = false; }
  void forget() override { method_->forget(); }
  bool interpolate(const S& t, State& out) override { return method_->interpolate(t, out); }
  bool again(const S& from, const State& x, const S& to) override { return method_->again(from, x, to); }

  void advance(S& t, State& x) override {
    using std::abs;
    S& h = pace_.size;
    for (int refusals = 0;;) {
      if (options_.longest > 0 && abs(h) > S(options_.longest)) h = (h < S(0) ? S(-1) : S(1)) * S(options_.longest);
      const bool last = abs(h) >= abs(end_ - t);
      cut_ |= last;
      S tried = last ? S(end_ - t) : h;
      const S before = tried, from = t;
      kept_ = x;
      const bool taken = method_->attempt(t, x, tried);
      if (taken && finite_motion(equations_, x)) {
        if (last) t = end_;
        short_ = !last && abs(t - from) < shortest(t) ? short_ + 1 : 0;
        count(method_->share_of_stability());
        if (short_ == patience) refuse_step(t, x, std::to_string(patience) + " steps in a row were as short as " + short_number(to_double(before)) + " s");
        // A step cut short tells only whether the next may be longer.
        h = last && abs(tried) < abs(h) ? h : tried;
        return;
      }
      ++rejected_;
      if (taken) {  // not finite: the step was far too long
        x = kept_, t = from;
        tried = before / S(10);
        method_->forget();
      }
      h = abs(tried) < abs(before) ? tried : S(before / S(2));
      if (++refusals > 200 || abs(h) < shortest(t)) refuse_step(t, x);
    }
  }
  int held() const override { return std::max(stiff_, 0); }
  void doubt() override { stiff_ = -1000, calm_ = 0; }
  // What is counted for that, as one number; 0: nothing.
  long counts() const { return calm_ + 8L * (stiff_ + 1024); }
  void resume_counts(long counts) {
    calm_ = counts == 0 ? 0 : static_cast<int>(counts % 8);
    stiff_ = counts == 0 ? 0 : static_cast<int>(counts / 8) - 1024;
  }
  void within(const S& from, const State& x, const S& t, State& out) override {
    using std::abs;
    out = x;
    beside_->forget();
    S at = from, h = t - from;
    for (int tries = 0; at != t; ++tries) {
      if (abs(h) >= abs(t - at)) h = t - at;
      const bool last = h == t - at;
      if (beside_->attempt(at, out, h)) at = last ? t : at;
      if (tries > 1000) refuse_step(at, out);
    }
  }

 private:
  using Stepper<S>::pace_, Stepper<S>::cut_, Stepper<S>::rejected_;

  // A step so short is the rounding of times, and no way to the end. First ones may be: threefold each time they have grown from the least double to
  // one in 700 steps.
  static constexpr int patience = 1000;
  // Six others in a row end a series of steps at the bound of stability (Hairer's number).
  static constexpr int others = 6, most = 1 << 30;
  void count(double share) {
    if (share > 1)
      calm_ = 0, stiff_ = std::min(stiff_ + 1, most);
    else if (share > 0 && ++calm_ == others)
      calm_ = 0, stiff_ = std::min(stiff_, 0);
  }
  S shortest(const S& t) const {
    using std::abs;
    return S(16) * epsilon<S>() * std::max(whole_, S(abs(t)));
  }
  // A hundredth of the time in which the state would change by its own size, both measured by the tolerances.
  S first_step(const S& t, const State& x) {
    using std::abs;
    if (options_.step > 0) return S(options_.step);
    State rate(x.size());
    equations_(x, rate, t);
    S size = S(0), change = S(0);
    for (size_t i = 0; i < x.size(); ++i) {
      const S scale = S(options_.atol) + S(options_.rtol) * abs(x[i]);
      size = std::max(size, S(abs(x[i]) / scale));
      change = std::max(change, S(abs(rate[i]) / scale));
    }
    if (!(change > S(0)) || !(size > S(0))) return whole_ / S(1000);
    return std::min(whole_, S(size / change / S(100)));
  }
  [[noreturn]] void refuse_step(const S& t, const State& x) {
    refuse_step(t, x, "the step size fell to " + short_number(to_double(pace_.size)) + " s");
  }
  [[noreturn]] void refuse_step(const S& t, const State& x, const std::string& what) {
    refuse(options_.integrator, what + " at t = " + short_number(to_double(t)) + " s, without the error estimate reaching rtol = " + short_number(options_.rtol) +
                                    ", atol = " + short_number(options_.atol) + "; " + fastest_of(equations_, x, t, options_) +
                                    "; the motion is singular or not finite there, or stiff (integrator=\"rosenbrock4\"), or the tolerances are below the precision's rounding");
  }

  Equations<S>& equations_;
  std::unique_ptr<Attempts<S>> method_, beside_;
  IntegratorOptions options_;
  State kept_;
  S end_ = S(0), whole_ = S(0);
  int short_ = 0;             // steps in a row that were as short as times are rounded
  int stiff_ = 0, calm_ = 0;  // steps at the bound of stability, and others in a row since
};

// Steps of options.step; in a piece that ends by itself, as at a knot or where a controller is sampled, as many equal ones as make each at most that.
// Where a run ends before, the last one is shorter, so that the steps of a run that goes on are those of one that never ended. Method::Needs says how
// it has accelerations found.
template <class S, class Method>
class FixedSteps : public Stepper<S> {
 public:
  using State = std::vector<S>;
  using Needs = typename Method::Needs;
  FixedSteps(Needs& equations, const IntegratorOptions& options) : equations_(equations), method_(equations), options_(options) {}

  void start(const S&, const State&, const S&, const Pace<S>* resumed) override {
    resumed_ = resumed && !(resumed->size == S(0));  // else steps were to be counted anew
    if (resumed) pace_ = *resumed;
  }
  void plan(const S& whole) override { whole_ = whole; }
  void begin(const S& t, const State&, const S& end) override {
    using std::abs;
    end_ = end, cut_ = false;
    if (!resumed_) {
      pace_ = {end < t ? -S(options_.step) : S(options_.step), t, 0};
      if (std::isfinite(to_double(whole_))) {
        const long count = steps_to(whole_);
        // What is no more than the rounding of the times themselves makes no step another one.
        if (const S off = S(count) * pace_.size - (whole_ - t); abs(off) > S(4) * epsilon<S>() * std::max(S(abs(whole_)), S(abs(t)))) pace_.size = (whole_ - t) / S(count);
      }
    }
    count_ = steps_to(end);
    resumed_ = false;
    const S over = pace_.origin + S(count_) * pace_.size - end;
    shortened_ = abs(over) > S(4) * epsilon<S>() * std::max(S(abs(end)), S(abs(pace_.origin)));
  }
  void advance(S& t, State& x) override {
    const S from = t;
    const bool last = pace_.taken + 1 >= count_;
    cut_ = last && shortened_;
    const S h = cut_ ? S(end_ - t) : pace_.size;
    method_.do_step(equations_, x, t, h);
    t = last ? end_ : S(pace_.origin + S(++pace_.taken) * pace_.size);
    if (last && !cut_) ++pace_.taken;
    if (!finite_motion<S>(equations_, x)) refuse_state(from, h, x);
  }
  void within(const S& from, const State& x, const S& t, State& out) override {
    out = x;
    method_.do_step(equations_, out, from, t - from);
  }

 private:
  using Stepper<S>::pace_, Stepper<S>::cut_;
  long steps_to(const S& end) const {
    return std::max(pace_.taken + 1, static_cast<long>(std::ceil(std::abs(to_double(S((end - pace_.origin) / pace_.size))) * (1 - 1e-12))));
  }
  [[noreturn]] void refuse_state(const S& from, const S& h, const State& x) const {
    int i = 0;
    while (std::isfinite(to_double(x[i]))) ++i;
    refuse(options_.integrator, "the state is no longer finite in the step after t = " + short_number(to_double(from)) + " s of " + short_number(to_double(h)) + " s: " +
                                    equations_.name_of(i) + " is " + (std::isnan(to_double(x[i])) ? "nan" : short_number(to_double(x[i]))) + "; take smaller steps (step=)");
  }

  Needs& equations_;
  Method method_;
  IntegratorOptions options_;
  S end_ = S(0), whole_ = S(HUGE_VAL);
  long count_ = 1;
  bool resumed_ = false, shortened_ = false;
};

}  // namespace pycraft
