#include "simulation/integrators/integrate.h"

#include <algorithm>
#include <boost/numeric/odeint/stepper/bulirsch_stoer.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta4.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_cash_karp54.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>
#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"
#include "simulation/integrators/steps_on_the_group.h"

namespace pycraft {

namespace {

namespace odeint = boost::numeric::odeint;

template <class S>
bool all_finite(const std::vector<S>& x) {
  return std::all_of(x.begin(), x.end(), [](const S& y) { return std::isfinite(to_double(y)); });
}

// One run: the state, the time, and what both kinds of stepping share.
template <class S>
class Run {
 public:
  using State = std::vector<S>;
  using Out = std::function<void(const S&, const State&)>;
  Run(Equations<S>& equations, State x, const std::vector<double>& times, const IntegratorOptions& options, const Out& out)
      : equations_(equations), x_(std::move(x)), times_(times), options_(options), out_(out), t_(times.front()) {}

  IntegrationCost go() {
    try {
      out_(t_, x_);
      if (times_.size() > 1) choose_stepper();
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
  std::string at_time() const { return "; integrating, at t = " + short_number(to_double(t_)) + " s"; }
  template <class E>
  [[noreturn]] void rethrow_with_time(E e) const {  // all else that the error knows stays
    static_cast<std::runtime_error&>(e) = std::runtime_error(e.what() + at_time());
    throw e;
  }
  [[noreturn]] void refuse(const std::string& what) const {
    throw EvaluationError(std::string("integrator '") + integrator_name(options_.integrator) + "': " + what);
  }

  void choose_stepper() {
    using Dopri5 = odeint::runge_kutta_dopri5<State, S, State, S>;
    using CashKarp = odeint::runge_kutta_cash_karp54<State, S, State, S>;
    using Fehlberg = odeint::runge_kutta_fehlberg78<State, S, State, S>;
    const S atol = S(options_.atol), rtol = S(options_.rtol);
    const auto controlled = [&]<class Stepper>(Stepper) {
      using Checker = odeint::default_error_checker<S, typename Stepper::algebra_type, typename Stepper::operations_type>;
      with_controlled_steps(odeint::controlled_runge_kutta<Stepper>(Checker(atol, rtol, S(1), S(1))));
    };
    const auto on_the_group = [&](auto stepper) {
      lengths_.resize(x_.size());
      quaternion_lengths(equations_.model(), x_.data(), lengths_.data());
      with_fixed_steps([&](const S& h) { stepper.do_step(equations_, x_, t_, h); });
    };
    switch (options_.integrator) {
      case Integrator::dopri5: return controlled(Dopri5());
      case Integrator::cash_karp54: return controlled(CashKarp());
      case Integrator::fehlberg78: return controlled(Fehlberg());
      case Integrator::bulirsch_stoer: return with_controlled_steps(odeint::bulirsch_stoer<State, S, State, S>(atol, rtol, S(1), S(1)));
      case Integrator::rk4: {
        odeint::runge_kutta4<State, S, State, S> stepper;
        return with_fixed_steps([&](const S& h) { stepper.do_step(std::ref(equations_), x_, t_, h); });
      }
      case Integrator::rkmk4: return on_the_group(MuntheKaas4<S>(equations_));
      case Integrator::semi_implicit_euler: return on_the_group(SemiImplicitEuler<S>(equations_));
    }
  }

  void after_step() {
    ++cost_.steps;
    equations_.settle(t_, x_);
    if (options_.normalise)
      scale_quaternions<S>(equations_.model(), nullptr, x_.data());
    else if (!lengths_.empty())
      scale_quaternions<S>(equations_.model(), lengths_.data(), x_.data());
    if (options_.every_step) out_(t_, x_);
  }

  // advance(from, to) along all pieces between the times, which stops cut.
  template <class Advance>
  void piece_by_piece(Advance advance) {
    for (size_t i = 1; i < times_.size(); ++i) {
      double from = times_[i - 1];
      for (;;) {
        const double stop = equations_.next_stop(from), to = std::min(stop, times_[i]);
        advance(from, to);
        t_ = S(to);
        if (stop <= times_[i]) equations_.stop(t_, x_);
        if (to == times_[i]) break;
        from = to;
      }
      if (!options_.every_step) out_(t_, x_);
    }
  }
  template <class Advance>
  void advance_along(Advance advance) {
    if (equations_.stops()) {
      if (times_.back() < times_.front()) refuse("a sampled controller acts, and time runs backwards");
      return piece_by_piece(advance);
    }
    for (size_t i = 1; i < times_.size(); ++i) {
      advance(times_[i - 1], times_[i]);
      t_ = S(times_[i]);
      if (!options_.every_step) out_(t_, x_);
    }
  }

  // As many equal steps between two times as make each at most options_.step.
  template <class Step>
  void with_fixed_steps(Step step) {
    advance_along([&](double begin, double end) {
      const S from = S(begin), span = S(end) - from;
      const long count = std::max(1L, static_cast<long>(std::ceil(std::abs(to_double(span)) / options_.step * (1 - 1e-12))));
      const S h = span / S(count);
      for (long j = 0; j < count; ++j) {
        const S before = t_ = from + S(j) * h;
        step(h);
        t_ = j + 1 == count ? S(end) : from + S(j + 1) * h;
        after_step();
        if (!all_finite(x_))
          refuse("the state is no longer finite in the step after t = " + short_number(to_double(before)) + " s of " + short_number(to_double(h)) +
                 " s; take smaller steps (step=)");
      }
    });
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

  template <class Stepper>
  void with_controlled_steps(Stepper stepper) {
    using std::abs;
    const S direction = times_.back() < times_.front() ? S(-1) : S(1), whole = abs(S(times_.back()) - S(times_.front()));
    S h = direction * first_step();
    State kept;
    bool begun = false;
    advance_along([&](double, double end) {
      const S to = S(end);
      if (begun && equations_.stops()) forget(stepper);
      begun = true;
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
          if (options_.normalise) forget(stepper);
          // A step cut short tells only whether the next may be longer.
          h = cut && abs(tried) < abs(h) ? h : tried;
          continue;
        }
        ++cost_.rejected;
        if (taken) {  // not finite: the step was far too long
          x_ = kept;
          t_ = from;
          tried = before / S(10);
          forget(stepper);
        }
        h = abs(tried) < abs(before) ? tried : before / S(2);
        if (++refusals_ > 200 || abs(h) < S(16) * epsilon<S>() * std::max(whole, S(abs(t_)))) refuse_step(h);
      }
    });
  }
  // A stepper that keeps the derivative at the end of its step, where the state has changed since.
  template <class Stepper>
  static void forget(Stepper& stepper) {
    if constexpr (requires { stepper.reset(); }) stepper.reset();
  }
  [[noreturn]] void refuse_step(const S& h) const {
    refuse("the step size fell to " + short_number(to_double(h)) + " s at t = " + short_number(to_double(t_)) + " s, without the error estimate " +
           "reaching rtol = " + short_number(options_.rtol) + ", atol = " + short_number(options_.atol) +
           "; the motion is singular or not finite there, or stiff (integrator=\"scipy:Radau\"), or the tolerances are below the "
           "precision's rounding");
  }

  Equations<S>& equations_;
  State x_, lengths_;  // lengths_: of the quaternions at first, where they are kept
  const std::vector<double>& times_;
  const IntegratorOptions& options_;
  const Out& out_;
  S t_;
  IntegrationCost cost_;
  int refusals_ = 0;
};

}  // namespace

template <class S>
IntegrationCost integrate(Equations<S>& equations, std::vector<S> x, const std::vector<double>& times, const IntegratorOptions& options,
                          const std::function<void(const S&, const std::vector<S>&)>& out) {
  check_integration(times, options, to_double(epsilon<S>()));
  struct PlainSteps {  // implicit terms are those of this run alone
    Equations<S>& equations;
    ~PlainSteps() { equations.set_step(S(0)); }
  } after{equations};
  return Run<S>(equations, std::move(x), times, options, out).go();
}

template PYCRAFT_INTEGRATE(double)
template PYCRAFT_INTEGRATE(Extended)
template PYCRAFT_INTEGRATE(Quad)

}  // namespace pycraft
