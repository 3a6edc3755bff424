#include "simulation/trajectory.h"

#include <algorithm>
#include <boost/numeric/odeint/stepper/bulirsch_stoer.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta4.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_cash_karp54.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <cmath>
#include <cstdio>

#include "runtime/errors.h"
#include "simulation/equations_of_motion.h"

namespace pycraft {

namespace {

namespace odeint = boost::numeric::odeint;

constexpr const char* names[] = {"dopri5", "cash-karp54", "fehlberg78", "bulirsch-stoer", "rk4", "rkmk4"};

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

template <class S>
bool all_finite(const std::vector<S>& x) {
  return std::all_of(x.begin(), x.end(), [](const S& y) { return std::isfinite(to_double(y)); });
}

// One run: the state, the time, and what both kinds of stepping share.
template <class S>
class Run {
 public:
  using State = std::vector<S>;
  Run(EquationsOfMotion<S>& equations, State x, const std::vector<double>& times, const TrajectoryOptions& options)
      : equations_(equations), x_(std::move(x)), times_(times), options_(options), t_(times.front()) {}

  template <class Out>
  TrajectoryCost go(const Out& out) {
    try {
      out(0, x_);
      if (times_.size() > 1) choose_stepper(out);
    } catch (const RefinementError& e) {
      rethrow_with_time(e);
    } catch (const SingularHingeError& e) {
      rethrow_with_time(e);
    } catch (const SingularOperatorError& e) {
      rethrow_with_time(e);
    }
    cost_.evaluations = equations_.evaluations;
    return cost_;
  }

 private:
  std::string at_time() const { return "; integrating, at t = " + number(to_double(t_)) + " s"; }
  template <class E>
  [[noreturn]] void rethrow_with_time(E e) const {  // all else that the error knows stays
    static_cast<std::runtime_error&>(e) = std::runtime_error(e.what() + at_time());
    throw e;
  }
  [[noreturn]] void refuse(const std::string& what) const {
    throw EvaluationError(std::string("integrator '") + integrator_name(options_.integrator) + "': " + what);
  }

  template <class Out>
  void choose_stepper(const Out& out) {
    using Dopri5 = odeint::runge_kutta_dopri5<State, S, State, S>;
    using CashKarp = odeint::runge_kutta_cash_karp54<State, S, State, S>;
    using Fehlberg = odeint::runge_kutta_fehlberg78<State, S, State, S>;
    const S atol = S(options_.atol), rtol = S(options_.rtol);
    const auto controlled = [&]<class Stepper>(Stepper) {
      using Checker = odeint::default_error_checker<S, typename Stepper::algebra_type, typename Stepper::operations_type>;
      with_controlled_steps(odeint::controlled_runge_kutta<Stepper>(Checker(atol, rtol, S(1), S(1))), out);
    };
    switch (options_.integrator) {
      case Integrator::dopri5: return controlled(Dopri5());
      case Integrator::cash_karp54: return controlled(CashKarp());
      case Integrator::fehlberg78: return controlled(Fehlberg());
      case Integrator::bulirsch_stoer: return with_controlled_steps(odeint::bulirsch_stoer<State, S, State, S>(atol, rtol, S(1), S(1)), out);
      case Integrator::rk4: {
        odeint::runge_kutta4<State, S, State, S> stepper;
        return with_fixed_steps([&](const S& h) { stepper.do_step(std::ref(equations_), x_, t_, h); }, out);
      }
      case Integrator::rkmk4: {
        MuntheKaas4<S> stepper(equations_.model());
        lengths_.resize(x_.size());
        quaternion_lengths(equations_.model(), x_.data(), lengths_.data());
        return with_fixed_steps([&](const S& h) { stepper.do_step(equations_, x_, t_, h); }, out);
      }
    }
  }

  void after_step() {
    ++cost_.steps;
    if (options_.normalise)
      scale_quaternions<S>(equations_.model(), nullptr, x_.data());
    else if (!lengths_.empty())
      scale_quaternions<S>(equations_.model(), lengths_.data(), x_.data());
  }

  // As many equal steps between two times as make each at most options_.step.
  template <class Step, class Out>
  void with_fixed_steps(Step step, const Out& out) {
    for (size_t i = 1; i < times_.size(); ++i) {
      const S from = S(times_[i - 1]), span = S(times_[i]) - from;
      const long count = std::max(1L, static_cast<long>(std::ceil(std::abs(to_double(span)) / options_.step * (1 - 1e-12))));
      const S h = span / S(count);
      for (long j = 0; j < count; ++j) {
        t_ = from + S(j) * h;
        step(h);
        after_step();
        if (!all_finite(x_))
          refuse("the state is no longer finite in the step after t = " + number(to_double(t_)) + " s of " + number(to_double(h)) +
                 " s; take smaller steps (step=)");
      }
      t_ = S(times_[i]);
      out(static_cast<int>(i), x_);
    }
  }

  // The first step size: a hundredth of the time in which the state would change by its own size, both measured by the tolerances.
  S first_step() {
    using std::abs;
    if (options_.step > 0) return S(options_.step);
    State rate(x_.size());
    equations_(x_, rate, t_);
    S size = S(0), change = S(0);
    for (size_t i = 0; i < x_.size(); ++i) {
      const S scale = S(options_.atol) + S(options_.rtol) * abs(x_[i]);
      size = std::max(size, S(abs(x_[i]) / scale));
      change = std::max(change, S(abs(rate[i]) / scale));
    }
    const S span = abs(S(times_.back()) - S(times_.front()));
    if (!(change > S(0)) || !(size > S(0))) return span / S(1000);
    return std::min(span, S(size / change / S(100)));
  }

  template <class Stepper, class Out>
  void with_controlled_steps(Stepper stepper, const Out& out) {
    using std::abs;
    const S direction = times_.back() < times_.front() ? S(-1) : S(1), whole = abs(S(times_.back()) - S(times_.front()));
    S h = direction * first_step();
    State kept;
    for (size_t i = 1; i < times_.size(); ++i) {
      const S to = S(times_[i]);
      // What is left is no step any more, but the rounding of the times themselves.
      while (abs(to - t_) > S(4) * epsilon<S>() * std::max(S(abs(to)), S(abs(t_)))) {
        const bool cut = abs(h) >= abs(to - t_);
        S tried = cut ? to - t_ : h;
        const S before = tried, from = t_;
        kept = x_;
        const bool taken = stepper.try_step(std::ref(equations_), x_, t_, tried) == odeint::success;
        if (taken && all_finite(x_)) {
          refusals_ = 0;
          if (cut) t_ = to;
          after_step();
          if constexpr (requires { stepper.reset(); })
            if (options_.normalise) stepper.reset();
          // A step cut short tells only whether the next may be longer.
          h = cut && abs(tried) < abs(h) ? h : tried;
          continue;
        }
        ++cost_.rejected;
        if (taken) {  // not finite: the step was far too long
          x_ = kept;
          t_ = from;
          tried = before / S(10);
          if constexpr (requires { stepper.reset(); }) stepper.reset();
        }
        h = abs(tried) < abs(before) ? tried : before / S(2);
        if (++refusals_ > 200 || abs(h) < S(16) * epsilon<S>() * std::max(whole, S(abs(t_))))
          refuse("the step size fell to " + number(to_double(h)) + " s at t = " + number(to_double(t_)) + " s, without the error estimate " +
                 "reaching rtol = " + number(options_.rtol) + ", atol = " + number(options_.atol) +
                 "; the motion is singular or not finite there, or stiff (integrator=\"scipy:Radau\"), or the tolerances are below the "
                 "precision's rounding");
      }
      t_ = to;
      out(static_cast<int>(i), x_);
    }
  }

  EquationsOfMotion<S>& equations_;
  State x_, lengths_;  // lengths_: of the quaternions at first, where they are kept
  const std::vector<double>& times_;
  const TrajectoryOptions& options_;
  S t_;
  TrajectoryCost cost_;
  int refusals_ = 0;
};

template <class S>
void check(const std::vector<double>& times, const TrajectoryOptions& o) {
  if (times.empty()) throw EvaluationError("times: give at least the time of the initial state");
  for (size_t i = 0; i < times.size(); ++i) {
    if (!std::isfinite(times[i])) throw EvaluationError("times: entry " + std::to_string(i) + " is " + number(times[i]));
    if (i > 0 && !((times[i] > times[i - 1]) == (times[1] > times[0]) && times[i] != times[i - 1]))
      throw EvaluationError("times: entry " + std::to_string(i) + " is " + number(times[i]) + " s after " + number(times[i - 1]) +
                            " s; times are strictly increasing, or strictly decreasing");
  }
  if (!(o.step >= 0) || !std::isfinite(o.step)) throw EvaluationError("step=" + number(o.step) + ": a step is a positive number of seconds");
  const std::string name = std::string("integrator '") + integrator_name(o.integrator) + "'";
  if (fixed_step(o.integrator)) {
    if (o.step == 0) throw EvaluationError(name + " takes steps of one size: give step= in seconds");
    return;
  }
  if (!(o.rtol >= 0) || !(o.atol > 0))
    throw EvaluationError(name + ": rtol=" + number(o.rtol) + ", atol=" + number(o.atol) + "; rtol is not negative, atol is positive");
  const double eps = to_double(epsilon<S>());
  if (o.rtol < 4 * eps && o.atol < 4 * eps)
    throw EvaluationError(name + ": rtol=" + number(o.rtol) + " and atol=" + number(o.atol) + " are below what the precision holds (eps = " +
                          number(eps) + "); choose a wider precision= or larger tolerances");
}

}  // namespace

const char* integrator_name(Integrator integrator) { return names[static_cast<int>(integrator)]; }
bool fixed_step(Integrator integrator) { return integrator == Integrator::rk4 || integrator == Integrator::rkmk4; }

Integrator integrator_from_name(const std::string& name) {
  std::string all;
  for (const Integrator i : integrators) {
    if (name == integrator_name(i)) return i;
    all += (all.empty() ? "'" : ", '") + std::string(integrator_name(i)) + "'";
  }
  throw EvaluationError("no integrator is called '" + name + "'; there are " + all);
}

template <class S>
TrajectoryCost integrate_trajectory(const CompiledModel<S>& model, const Accelerations<S>& accelerations, const S* q, const S* v,
                                    const std::vector<double>& times, const S* tau, const S* damping, const TrajectoryOptions& options,
                                    const std::function<void(int, const S*, const S*)>& out) {
  check<S>(times, options);
  std::vector<S> x(q, q + model.nq);
  x.insert(x.end(), v, v + model.nv);
  EquationsOfMotion<S> equations(model, accelerations, tau, damping);
  Run<S> run(equations, std::move(x), times, options);
  return run.go([&](int i, const std::vector<S>& at) { out(i, at.data(), at.data() + model.nq); });
}

template PYCRAFT_TRAJECTORY(double)
template PYCRAFT_TRAJECTORY(Extended)
template PYCRAFT_TRAJECTORY(Quad)

}  // namespace pycraft
