#include "simulation/integrators/switching_steps.h"

#include "simulation/decay.h"

namespace pycraft {

namespace {

constexpr int enough = 15;            // steps at the bound of stability after which a motion seems stiff (Hairer's number)
constexpr int every = 10, looks = 2;  // steps from look to look of the implicit method; looks in a row after which it is left
constexpr double stable = 2;          // of 3.3, the size of a rate times a step at which the explicit method becomes unstable

class SwitchingSteps : public Stepper<double> {
 public:
  SwitchingSteps(LinearizedEquations<double>& equations, std::unique_ptr<ControlledSteps<double>> explicit_steps, std::unique_ptr<ControlledSteps<double>> implicit_steps)
      : finder_(equations), steps_{std::move(explicit_steps), std::move(implicit_steps)} {}

  void start(const double& t, const State& x, const double& last, const Pace<double>* resumed) override {
    last_ = last;
    now_ = took_ = resumed ? static_cast<int>(resumed->taken & 1) : 0;
    counted_ = resumed ? resumed->taken >> 1 : 0;
    if (resumed && now_ == 0) steps_[0]->resume_counts(counted_);
    now().start(t, x, last, resumed);
    told();
  }
  void begin(const double& t, const State& x, const double& end) override {
    end_ = end, took_ = now_, cut_ = false;
    now().begin(t, x, end);
    told();
  }
  void advance(double& t, State& x) override {
    took_ = now_;
    now().advance(t, x);
    cut_ |= now().cut();
    if (now_ == 0 && now().held() >= enough)
      leave_explicit(t, x);
    else if (now_ == 1 && ++counted_ % every == 0)
      leave_implicit(t, x);
    told();
  }
  void forget() override {
    for (const auto& steps : steps_) steps->forget();
  }
  void within(const double& from, const State& x, const double& t, State& out) override { steps_[took_]->within(from, x, t, out); }
  bool interpolate(const double& t, State& out) override { return steps_[took_]->interpolate(t, out); }
  // The steps of the implicit one are taken again by that itself.
  bool again(const double& from, const State& x, const double& to) override {
    took_ = 0;
    return steps_[0]->again(from, x, to);
  }
  int method() const override { return took_; }

 private:
  Stepper<double>& now() { return *steps_[now_]; }
  void leave_explicit(double t, const State& x) {
    const double step = now().pace().size;
    if (!finder_.fastest(t, x, step).holds(std::abs(step))) return now().doubt();
    change(t, x, step);
  }
  // counted_: steps, and looks in a row in the digits above.
  void leave_implicit(double t, const State& x) {
    const double step = now().pace().size;
    const long calm = finder_.fastest(t, x, step).size * std::abs(step) < stable ? counted_ / 1000 + 1 : 0;
    counted_ = 1000 * calm;
    if (calm >= looks) change(t, x, step);
  }
  void change(double t, const State& x, double step) {
    now_ = 1 - now_, counted_ = 0;
    const Pace<double> pace{step, 0, 0};
    steps_[0]->resume_counts(0);
    now().start(t, x, last_, &pace);
    now().forget();
    now().begin(t, x, end_);
  }
  void told() {
    pace_ = {now().pace().size, 0, now_ + 2 * (now_ == 0 ? steps_[0]->counts() : counted_)};
    rejected_ = steps_[0]->rejected() + steps_[1]->rejected();
  }

  DecayFinder finder_;
  std::unique_ptr<ControlledSteps<double>> steps_[2];
  double last_ = 0, end_ = 0;
  int now_ = 0, took_ = 0;  // which of them takes the next step, and which took the last
  long counted_ = 0;
};

}  // namespace

std::unique_ptr<Stepper<double>> switching_steps(LinearizedEquations<double>& equations, std::unique_ptr<ControlledSteps<double>> explicit_steps,
                                                 std::unique_ptr<ControlledSteps<double>> implicit_steps) {
  return std::make_unique<SwitchingSteps>(equations, std::move(explicit_steps), std::move(implicit_steps));
}

}  // namespace pycraft
