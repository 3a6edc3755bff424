#include "simulation/integrators/runge_kutta_steps.h"

#include <boost/numeric/odeint/stepper/bulirsch_stoer.hpp>
#include <boost/numeric/odeint/stepper/controlled_runge_kutta.hpp>
#include <boost/numeric/odeint/stepper/runge_kutta_cash_karp54.hpp>
#include <initializer_list>
#include <utility>

#include "simulation/integrators/dormand_prince_8.h"
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

template <class S>
S ratio(double a, double b) {
  return S(a) / S(b);
}
template <class S>
Weights<S> weights(std::initializer_list<std::pair<int, S>> all) {
  Weights<S> w;
  for (const auto& [rate, weight] : all) w.add(rate, weight);
  return w;
}

template <class S>
const Tableau<S>& dormand_prince() {
  const auto r = ratio<S>;
  static const Tableau<S> tableau{
      7,
      {S(0), r(1, 5), r(3, 10), r(4, 5), r(8, 9), S(1), S(1)},
      {{},
       weights<S>({{0, r(1, 5)}}),
       weights<S>({{0, r(3, 40)}, {1, r(9, 40)}}),
       weights<S>({{0, r(44, 45)}, {1, r(-56, 15)}, {2, r(32, 9)}}),
       weights<S>({{0, r(19372, 6561)}, {1, r(-25360, 2187)}, {2, r(64448, 6561)}, {3, r(-212, 729)}}),
       weights<S>({{0, r(9017, 3168)}, {1, r(-355, 33)}, {2, r(46732, 5247)}, {3, r(49, 176)}, {4, r(-5103, 18656)}}),
       weights<S>({{0, r(35, 384)}, {2, r(500, 1113)}, {3, r(125, 192)}, {4, r(-2187, 6784)}, {5, r(11, 84)}})},
      {},
      weights<S>({{0, r(35, 384) - r(5179, 57600)}, {2, r(500, 1113) - r(7571, 16695)}, {3, r(125, 192) - r(393, 640)}, {4, r(-2187, 6784) - r(-92097, 339200)},
                  {5, r(11, 84) - r(187, 2100)}, {6, r(-1, 40)}})};
  return tableau;
}

// Dormand and Prince's, whose derivative at the end of a step is that of the next one's start, and whose stages give what is between: a continuous
// extension of order 4. Steps are chosen as Boost.Odeint does.
// Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, II.5, II.6.
template <class S>
class DormandPrince : public Attempts<S> {
 public:
  using State = std::vector<S>;
  DormandPrince(Equations<S>& equations, const IntegratorOptions& o)
      : equations_(equations), stages_(dormand_prince<S>()), checker_(S(o.atol), S(o.rtol), S(1), S(1)), apart_(apart()), count_(equations.size() - equations.integrals()) {}

  bool attempt(S& t, State& x, S& h) override {
    start_ = x;
    stages_.begin(start_, t, h, known_);
    equations_.go_through(stages_);
    known_ = true;
    stages_.sum(stages_.tableau().error, error_);
    const S error = checker_.error(algebra_, start_, stages_.k(0), error_, h);
    if (error > S(1)) {
      h = adjuster_.decrease_step(h, error, 4);
      return false;
    }
    t_from_ = t, t_to_ = t + h;
    x = stages_.last();
    share_of_stability_ = stiffness_of_stages(stages_, apart_, 6, count_, error_, h) / 3.25;
    t += h;
    h = adjuster_.increase_step(h, error, 5);
    stages_.k(0).swap(stages_.k(6));
    return true;
  }
  void forget() override { known_ = false; }
  double share_of_stability() const override { return share_of_stability_; }
  // y(θ) = y + h Σ b(i, θ) k(i).
  bool interpolate(const S& t, State& out) override {
    const auto r = ratio<S>;
    const S h = t_to_ - t_from_, u = (t - t_from_) / h, less = u - S(1), square = u * u;
    const S A = square * (S(3) - S(2) * u), B = square * less, C = square * less * less, D = u * less * less;
    const auto X = [&](double by, double a, double b, double whole) { return S(by) * (S(a) - S(b) * u) / S(whole); };
    const S b[] = {A * r(35, 384) - C * X(5, 2558722523, 31403016, 11282082432) + D, A * r(500, 1113) + C * X(100, 882725551, 15701508, 32700410799),
                   A * r(125, 192) - C * X(25, 443332067, 31403016, 1880347072),     A * r(-2187, 6784) + C * X(32805, 23143187, 3489224, 199316789632),
                   A * r(11, 84) - C * X(55, 29972135, 7076736, 822651844),          B + C * X(10, 7414447, 829305, 29380423)};
    static constexpr int of[] = {6, 2, 3, 4, 5, 0};  // first and last have changed places
    out.resize(start_.size());
    for (size_t i = 0; i < out.size(); ++i) {
      S y = start_[i];
      for (int j = 0; j < 6; ++j) y += h * b[j] * stages_.k(of[j])[i];
      out[i] = y;
    }
    return true;
  }
  bool again(const S& from, const State& x, const S& to) override {
    start_ = x, known_ = false;
    stages_.begin(start_, from, to - from);
    equations_.go_through(stages_);
    stages_.k(0).swap(stages_.k(6));
    t_from_ = from, t_to_ = to;
    return true;
  }

 private:
  // Of the last two stages, both at the end of a step.
  static Weights<S> apart() {
    const auto& rows = dormand_prince<S>().rows;
    return difference(rows[6], rows[5]);
  }
  Equations<S>& equations_;
  Stages<S> stages_;
  odeint::range_algebra algebra_;
  odeint::default_error_checker<S, odeint::range_algebra, odeint::default_operations> checker_;
  odeint::default_step_adjuster<S, S> adjuster_;
  State start_, error_;
  Weights<S> apart_;
  int count_;
  double share_of_stability_ = 0;
  S t_from_ = S(0), t_to_ = S(1);
  bool known_ = false;  // the first rate is that of x
};

template <class S>
const Tableau<S>& classical() {
  const auto r = ratio<S>;
  static const Tableau<S> tableau{4, {S(0), r(1, 2), r(1, 2), S(1)}, {{}, weights<S>({{0, r(1, 2)}}), weights<S>({{1, r(1, 2)}}), weights<S>({{2, S(1)}})},
                                  weights<S>({{0, r(1, 6)}, {1, r(1, 3)}, {2, r(1, 3)}, {3, r(1, 6)}}), {}};
  return tableau;
}
template <class S>
class ClassicalRungeKutta {
 public:
  using Needs = ExplicitEquations<S>;
  explicit ClassicalRungeKutta(const Needs&) : stages_(classical<S>()) {}
  void do_step(Needs& equations, std::vector<S>& x, const S& t, const S& h) {
    stages_.begin(x, t, h);
    equations.go_through(stages_);
    stages_.combine(stages_.tableau().last, x);
  }

 private:
  Stages<S> stages_;
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
    case Integrator::dop853: return twice([&] { return std::make_unique<DormandPrince8<S>>(equations, o); });
    case Integrator::bulirsch_stoer: {
      using Extrapolated = odeint::bulirsch_stoer<State, S, State, S>;
      return twice([&] { return std::make_unique<OdeintAttempts<S, Extrapolated>>(equations, Extrapolated(S(o.atol), S(o.rtol), S(1), S(1))); });
    }
    case Integrator::rk4: return std::make_unique<FixedSteps<S, ClassicalRungeKutta<S>>>(equations, o);
    case Integrator::rkmk4: return std::make_unique<FixedSteps<S, MuntheKaas4<S>>>(equations, o);
    case Integrator::automatic:
    case Integrator::dopri5: return twice([&] { return std::make_unique<DormandPrince<S>>(equations, o); });
    default: refuse(o.integrator, "takes more than accelerations at states");
  }
}

std::unique_ptr<ControlledSteps<double>> dormand_prince_steps(Equations<double>& equations, const IntegratorOptions& o) {
  const auto make = [&] { return std::make_unique<DormandPrince<double>>(equations, o); };
  return std::make_unique<ControlledSteps<double>>(equations, make(), make(), o);
}

template PYCRAFT_RUNGE_KUTTA(double)
template PYCRAFT_RUNGE_KUTTA(Extended)
template PYCRAFT_RUNGE_KUTTA(Quad)

}  // namespace pycraft
