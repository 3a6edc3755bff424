#include "simulation/integrators/runge_kutta_steps.h"

#include <boost/numeric/odeint/stepper/bulirsch_stoer.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta4.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_cash_karp54.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_dopri5.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_fehlberg78.hpp>

#include "simulation/integrators/steps_on_the_group.h"

namespace pycraft {

namespace {

namespace odeint = boost::numeric::odeint;

template <class Method, class S>
auto controlled(const IntegratorOptions& o) {
  using Checker = odeint::default_error_checker<S, typename Method::algebra_type, typename Method::operations_type>;
  return odeint::controlled_runge_kutta<Method>(Checker(S(o.atol), S(o.rtol), S(1), S(1)));
}

// One of Boost.Odeint's controlled steppers.
template <class S, class Controlled>
class OdeintAttempts : public Attempts<S> {
 public:
  using State = std::vector<S>;
  OdeintAttempts(ExplicitEquations<S>& equations, Controlled stepper) : equations_(equations), stepper_(std::move(stepper)) {}
  bool attempt(S& t, State& x, S& h) override { return stepper_.try_step(std::ref(equations_), x, t, h) == odeint::success; }
  void forget() override {
    if constexpr (requires { stepper_.reset(); }) stepper_.reset();
  }

 private:
  ExplicitEquations<S>& equations_;
  Controlled stepper_;
};

// Dormand and Prince's, whose derivative at the end of a step is that of the next one's start, and whose stages give what is between: a continuous
// extension of order 4. Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, II.6.
template <class S>
class DormandPrince : public Attempts<S> {
 public:
  using State = std::vector<S>;
  using Method = odeint::runge_kutta_dopri5<State, S, State, S>;
  DormandPrince(ExplicitEquations<S>& equations, const IntegratorOptions& o) : equations_(equations), stepper_(controlled<Method, S>(o)) {}

  bool attempt(S& t, State& x, S& h) override {
    make_room(x.size());
    if (!known_) equations_(x, rate_, t);
    known_ = true;
    const S before = t;
    if (stepper_.try_step(std::ref(equations_), x, rate_, t, to_, rate_to_, h) != odeint::success) return false;
    from_.swap(x), x = to_;
    rate_from_.swap(rate_), rate_ = rate_to_;
    t_from_ = before, t_to_ = t;
    return true;
  }
  void forget() override { known_ = false; }
  bool interpolate(const S& t, State& out) override {
    out.resize(from_.size());
    stepper_.stepper().calc_state(t, out, from_, rate_from_, t_from_, to_, rate_to_, t_to_);
    return true;
  }
  bool again(const S& from, const State& x, const S& to) override {
    make_room(x.size());
    from_ = x, t_from_ = from, t_to_ = to, known_ = false;
    equations_(x, rate_from_, from);
    stepper_.stepper().do_step(std::ref(equations_), from_, rate_from_, from, to_, rate_to_, S(to - from));
    return true;
  }

 private:
  void make_room(size_t n) {
    for (State* x : {&from_, &to_, &rate_, &rate_from_, &rate_to_}) x->resize(n);
  }
  using Controlled = decltype(controlled<Method, S>(IntegratorOptions()));
  ExplicitEquations<S>& equations_;
  Controlled stepper_;
  State from_, to_, rate_, rate_from_, rate_to_;
  S t_from_ = S(0), t_to_ = S(1);
  bool known_ = false;
};

template <class S>
class ClassicalRungeKutta {
 public:
  using Needs = ExplicitEquations<S>;
  explicit ClassicalRungeKutta(const Needs&) {}
  void do_step(Needs& equations, std::vector<S>& x, const S& t, const S& h) { stepper_.do_step(std::ref(equations), x, t, h); }

 private:
  odeint::runge_kutta4<std::vector<S>, S, std::vector<S>, S> stepper_;
};

}  // namespace

template <class S>
std::unique_ptr<Stepper<S>> runge_kutta_steps(ExplicitEquations<S>& equations, const IntegratorOptions& o) {
  using State = std::vector<S>;
  const auto twice = [&](auto make) { return std::make_unique<ControlledSteps<S>>(equations, make(), make(), o); };
  const auto pair = [&]<class Method>(Method) {
    using Controlled = decltype(controlled<Method, S>(o));
    return twice([&] { return std::make_unique<OdeintAttempts<S, Controlled>>(equations, controlled<Method, S>(o)); });
  };
  switch (o.integrator) {
    case Integrator::cash_karp54: return pair(odeint::runge_kutta_cash_karp54<State, S, State, S>());
    case Integrator::fehlberg78: return pair(odeint::runge_kutta_fehlberg78<State, S, State, S>());
    case Integrator::bulirsch_stoer: {
      using Extrapolated = odeint::bulirsch_stoer<State, S, State, S>;
      return twice([&] { return std::make_unique<OdeintAttempts<S, Extrapolated>>(equations, Extrapolated(S(o.atol), S(o.rtol), S(1), S(1))); });
    }
    case Integrator::rk4: return std::make_unique<FixedSteps<S, ClassicalRungeKutta<S>>>(equations, o);
    case Integrator::rkmk4: return std::make_unique<FixedSteps<S, MuntheKaas4<S>>>(equations, o);
    case Integrator::dopri5: return twice([&] { return std::make_unique<DormandPrince<S>>(equations, o); });
    default: refuse(o.integrator, "takes more than accelerations at states");
  }
}

template PYCRAFT_RUNGE_KUTTA(double)
template PYCRAFT_RUNGE_KUTTA(Extended)
template PYCRAFT_RUNGE_KUTTA(Quad)

}  // namespace pycraft
