// Dormand and Prince's method of order 8, with two estimates of its error and dense output of order 7.
//
//   e = e₅²/√(e₅² + e₃²/100),   e₅, e₃ the largest shares that the estimates of orders 5 and 3 have of what the tolerances allow
//
// which is of the order of h⁸. A step takes 12 evaluations, the last rate being the first of the next step; dense output takes 3 more, when it is first
// asked for:
//
//   y(θ) = y₀ + θ (F₀ + (1-θ) (F₁ + θ (F₂ + (1-θ) (F₃ + θ (F₄ + (1-θ) (F₅ + θ F₆)))))),
//   F₀ = y₁ - y₀,   F₁ = h f₀ - F₀,   F₂ = 2 F₀ - h (f₀ + f₁),   F₃ ... F₆ = h Σ d k
//
// Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, II.5, II.10, and its code DOP853.
#pragma once

#include <algorithm>
#include <cmath>

#include "simulation/integrators/dop853_coefficients.h"
#include "simulation/integrators/stepper.h"

namespace pycraft {

template <class S>
class DormandPrince8 : public Attempts<S> {
 public:
  using State = std::vector<S>;
  DormandPrince8(ExplicitEquations<S>& equations, const IntegratorOptions& options) : equations_(equations), options_(options), pair_(coefficients()), stages_(pair_.tableau), count_(equations.size() - equations.integrals()) {
    for (State& F : between_) F.resize(equations.size());
  }

  bool attempt(S& t, State& x, S& h) override {
    if (ended_) stages_.k(0).swap(stages_.k(judged));  // the rate at the last step's end
    ended_ = false;
    start_ = x;
    stages_.begin(start_, t, h, known_);
    stages_.up_to(judged);
    equations_.go_through(stages_);
    known_ = true;
    const double error = share_of_tolerances(h), change = error > 0 ? 0.9 * std::pow(error, -0.125) : 6.0;
    if (!(error <= 1)) {
      h *= std::isfinite(error) ? S(std::max(change, 1.0 / 3)) : S(0.1);
      return false;
    }
    stages_.up_to(judged + 1);
    equations_.go_through(stages_);
    ended_ = true, extended_ = false;
    t_from_ = t, t_to_ = t + h;
    x = stages_.last();
    end_ = x;
    share_of_stability_ = stiffness_of_stages(stages_, pair_.apart, judged, count_, third_, h) / 6.1;
    t += h;
    h *= S(std::min(change, 6.0));
    return true;
  }
  void forget() override { known_ = ended_ = false; }
  double share_of_stability() const override { return share_of_stability_; }
  bool interpolate(const S& t, State& out) override {
    if (!extended_) extend();
    const S s = (t - t_from_) / (t_to_ - t_from_), r = S(1) - s;
    out.resize(start_.size());
    for (size_t i = 0; i < out.size(); ++i) {
      const auto F = [&](int k) { return between_[k][i]; };
      out[i] = start_[i] + s * (F(0) + r * (F(1) + s * (F(2) + r * (F(3) + s * (F(4) + r * (F(5) + s * F(6)))))));
    }
    return true;
  }
  bool again(const S& from, const State& x, const S& to) override {
    start_ = x, known_ = ended_ = extended_ = false;
    stages_.begin(start_, from, to - from);
    equations_.go_through(stages_);
    end_ = stages_.last();
    t_from_ = from, t_to_ = to;
    return true;
  }

 private:
  static constexpr int judged = 12;  // stages after which a step is judged
  struct Coefficients {
    Tableau<S> tableau{};
    Weights<S> third, apart, dense[4];  // of the estimate of order 3, of the last two stages' states, of dense output
  };
  static const Coefficients& coefficients() {
    static const Coefficients pair = [] {
      Coefficients c;
      c.tableau.stages = judged + 1, c.tableau.beyond = 3;
      for (int i = 0; i < judged + 4; ++i) c.tableau.nodes[i] = dop853::decimal<S>(dop853::nodes[i]);
      const auto row_of = [](const dop853::Entry& e, Weights<S>* rows) { rows[e.row].add(e.rate, dop853::decimal<S>(e.value)); };
      for (const dop853::Entry& e : dop853::step) row_of(e, c.tableau.rows);
      for (const dop853::Entry& e : dop853::between) row_of(e, c.tableau.rows);
      for (const dop853::Entry& e : dop853::error) row_of(e, &c.tableau.error);
      for (const dop853::Entry& e : dop853::dense) row_of(e, c.dense);
      c.apart = difference(c.tableau.rows[judged], c.tableau.rows[judged - 1]);
      c.third = c.tableau.rows[judged];  // less a formula of order 3 with weights 31/127, 12675/17272 and 3/136
      for (int j = 0; j < c.third.count; ++j) {
        if (c.third.of[j] == 0) c.third.by[j] -= S(31) / S(127);
        if (c.third.of[j] == 8) c.third.by[j] -= S(12675) / S(17272);
        if (c.third.of[j] == 11) c.third.by[j] -= S(3) / S(136);
      }
      return c;
    }();
    return pair;
  }
  // Of the step's error; not a number, or infinite, where a rate is.
  double share_of_tolerances(const S& h) {
    using std::abs;
    stages_.sum(pair_.tableau.error, fifth_);
    stages_.sum(pair_.third, third_);
    double five = 0, three = 0;
    for (size_t i = 0; i < start_.size(); ++i) {
      const S allowed = S(options_.atol) + S(options_.rtol) * (abs(start_[i]) + abs(h * stages_.k(0)[i]));
      const double e5 = to_double(S(abs(fifth_[i]) / allowed)), e3 = to_double(S(abs(third_[i]) / allowed));
      if (!(std::isfinite(e5) && std::isfinite(e3))) return HUGE_VAL;
      five = std::max(five, e5), three = std::max(three, e3);
    }
    return five > 0 ? five / std::hypot(1.0, 0.1 * three / five) : 0;
  }
  void extend() {
    stages_.up_to(judged + 4);
    equations_.go_through(stages_);
    extended_ = true;
    const S h = t_to_ - t_from_;
    for (size_t i = 0; i < start_.size(); ++i) {
      const S by = end_[i] - start_[i], first = h * stages_.k(0)[i], last = h * stages_.k(judged)[i];
      between_[0][i] = by, between_[1][i] = first - by, between_[2][i] = S(2) * by - first - last;
    }
    for (int k = 0; k < 4; ++k) stages_.sum(pair_.dense[k], between_[3 + k]);
  }

  ExplicitEquations<S>& equations_;
  IntegratorOptions options_;
  const Coefficients& pair_;
  Stages<S> stages_;
  State start_, end_, fifth_, third_, between_[7];
  int count_;
  double share_of_stability_ = 0;
  S t_from_ = S(0), t_to_ = S(1);
  bool known_ = false, ended_ = false, extended_ = false;  // the first rate is that of x, once those of the step's ends have changed places; dense output is there
};

}  // namespace pycraft
