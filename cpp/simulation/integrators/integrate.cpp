#include "simulation/integrators/integrate.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "runtime/errors.h"
#include "simulation/dense_output.h"
#include "simulation/integrators/runge_kutta_steps.h"

namespace pycraft {

namespace {

template <class S>
class Run {
 public:
  using State = std::vector<S>;
  Run(Equations<S>& equations, Stepper<S>& stepper, State x, const RunPlan<S>& plan, const IntegratorOptions& options, Watcher<S>& watcher, RunEnd<S>& end)
      : equations_(equations), stepper_(stepper), x_(std::move(x)), plan_(plan), options_(options), watcher_(watcher), end_(end), events_(with_those_of(equations, plan.events)), watch_(events_),
        between_(equations, record().order == 1), t_(plan.resumed ? plan.resumed->t : S(plan.times.front())), at_times_(plan.end_at_times || !record().samples_between) {}

  void go() {
    try {
      retelling([&] { run(); }, [&](const Error& e) { return while_integrating(e, to_double(t_)); });
    } catch (...) {
      close();
      throw;
    }
    close();
  }

 private:
  const IntegratorRecord& record() const { return record_of(options_.integrator); }
  static EventFunctions<S> with_those_of(Equations<S>& equations, const EventFunctions<S>& given) {
    EventFunctions<S> all;
    const std::vector<std::string> own = equations.event_names(), jumps = equations.jump_names();
    for (const std::string& name : own) all.kinds.push_back({name, 0, false, true});
    for (const std::string& name : jumps) all.kinds.push_back({name, 0, false, false, true});
    all.kinds.insert(all.kinds.end(), given.kinds.begin(), given.kinds.end());
    const int n = static_cast<int>(own.size()), others = n + static_cast<int>(jumps.size());
    all.value = [&equations, &given, n, others, values = State(own.size())](int i, const S& t, const State& x) mutable {
      if (i >= others) return given.value(i - others, t, x);
      if (i >= n) return S(1);
      equations.events(t, x, values.data());
      return values[i];
    };
    all.all = [&equations, &given, n, others](const S& t, const State& x, S* out) {
      if (n > 0) equations.events(t, x, out);
      std::fill(out + n, out + others, S(1));
      for (size_t i = 0; i < given.kinds.size(); ++i) out[others + i] = given.value(static_cast<int>(i), t, x);
    };
    all.known = own.size();
    all.rates = [&equations](const S& t, const State& x, S* out) { equations.event_rates(t, x, out); };
    return all;
  }

  void run() {
    const std::vector<double>& times = plan_.times;
    forwards_ = times.back() >= times.front();
    if (record().on_group) {
      lengths_.resize(x_.size());
      lengths_.resize(quaternion_lengths(equations_.model(), x_.data(), lengths_.data()));
      if (plan_.resumed && plan_.resumed->lengths.size() == lengths_.size()) lengths_ = plan_.resumed->lengths;
    }
    kept_.lengths = lengths_;
    keep();
    watcher_.step(t_, x_);
    if (plan_.resumed) jump();  // one that fell on the end of what is gone on from
    watcher_.sample(t_, x_);
    if (times.size() == 1) return;
    if (equations_.stops()) stop_ = equations_.next_stop(to_double(t_));
    if (!forwards_ && (equations_.stops() || equations_.next_knot(-std::numeric_limits<double>::infinity()) < times.front()))
      refuse(options_.integrator, "a controller is sampled, an impulse acts or a function of time has knots, and time runs backwards");
    stepper_.start(t_, x_, S(times.back()), plan_.resumed ? &plan_.resumed->pace : nullptr);
    watch_.begin(t_, x_, plan_.resumed ? &plan_.resumed->signs : nullptr);
    keep();
    left_ = kept_;  // its arrays are there when a step is cut
    while (next_ < times.size() && end_.event < 0) piece();
  }

  // To the next time at which a step must end.
  void piece() {
    const double never = std::numeric_limits<double>::infinity(), target = at_times_ ? plan_.times[next_] : plan_.times.back();
    const double stop = stop_, knot = forwards_ ? equations_.next_knot(to_double(t_)) : never;
    to_ = S(forwards_ ? std::min({stop, knot, target}) : target);
    equations_.between(t_, to_);
    stepper_.plan(S(at_times_ ? to_double(to_) : std::min(stop, knot)));
    stepper_.begin(t_, x_, to_);
    parted_ = false;
    while (!there() && end_.event < 0) step();
    if (end_.event >= 0) return;
    t_ = to_;
    if (to_ == S(knot)) {
      if (knot < plan_.times.back()) jump();  // else it is what follows that begins with it
      begin_anew();
    }
    if (to_ == S(stop)) {
      equations_.stop(t_, x_);
      stop_ = equations_.next_stop(to_double(t_));
      if (equations_.jumps()) watcher_.step(t_, x_);
      begin_anew();
    }
    while (next_ < plan_.times.size() && S(plan_.times[next_]) == t_) watcher_.sample(t_, x_), ++next_;
  }
  void jump() {
    equations_.between(t_, S(std::numeric_limits<double>::infinity()));
    const std::vector<int> which = equations_.jump(t_, x_);
    if (which.empty()) return;
    finish(t_, x_);
    watcher_.step(t_, x_);
    const int first = static_cast<int>(equations_.event_names().size());
    for (int each : which) watcher_.event(first + each, t_, x_);
  }
  // Where rates or states are others than those at the end of the last step.
  void begin_anew() {
    stepper_.forget();
    watch_.forget();
    whole_ = true, fresh_ = true;
  }
  // Beyond a stop forces may be far larger than any that chose the last step, and no estimate of an error need see them in one as long.
  void begin_slowly() {
    stepper_.start(t_, x_, S(plan_.times.back()), nullptr);
    stepper_.begin(t_, x_, to_);
  }
  // What is left is no step any more, but the rounding of the times themselves.
  bool there() const {
    using std::abs;
    return !(abs(to_ - t_) > S(4) * epsilon<S>() * std::max(S(abs(to_)), S(abs(t_))));
  }

  void step() {
    if (stepper_.cut() && !parted_) left_ = kept_, parted_ = true;  // a longer run took other steps from there
    keep();
    whole_ = fresh_ = false;
    if (!record().controlled && end_.cost.steps == 0) look_at_stability();
    const bool beyond = std::exchange(met_, false);
    stepper_.advance(t_, x_);
    ++end_.cost.steps;
    if (const int method = stepper_.method(); method != method_) end_.switches.emplace_back(to_double(kept_.t), method_ = method);
    finish(t_, x_);
    if (watch_.any())
      look_for_events();
    else
      sample_to(t_, x_);
    if (options_.normalise || equations_.settles()) stepper_.forget();
    watcher_.step(t_, x_);
    tell_progress();
    if (record().controlled) {
      if (!stiff_ && stepper_.held() >= lasting) look_at_stability();
    } else if (beyond && ++looks_ <= enough) {
      look_beyond();
    } else if (end_.cost.steps == next_look_) {
      look_at_stability();
    }
  }
  // At the end of the step that began at a stop, or, where it ended at one, in its middle: what came and went in one step is felt there alone.
  void look_beyond() {
    if (!met_) return look_at_stability();
    if (stiff_) return;
    const S middle = (kept_.t + t_) / S(2);
    stepper_.within(kept_.t, kept_.x, middle, sampled_);
    finish(middle, sampled_);
    stiff_ = watcher_.stiff(middle, sampled_, stepper_.pace().size, S(plan_.times.back()));
  }
  void look_at_stability() {
    if (end_.cost.steps == next_look_) next_look_ *= 4;
    if (stiff_) return;
    stiff_ = watcher_.stiff(t_, x_, stepper_.pace().size, S(plan_.times.back()));
    if (!stiff_) stepper_.doubt();
  }
  void finish(const S& t, State& x) {
    equations_.settle(t, x);
    if (options_.normalise)
      scale_quaternions<S>(equations_.model(), nullptr, x.data());
    else if (!lengths_.empty())
      scale_quaternions<S>(equations_.model(), lengths_.data(), x.data());
  }
  void look_for_events() {
    using std::abs;
    const auto within = [&](const S& t, State& x) {
      stepper_.within(kept_.t, kept_.x, t, x);
      finish(t, x);
    };
    bool set = false;
    const auto roughly = [&](const S& t, State& x) {
      if (stepper_.interpolate(t, x)) return;
      if (!set) between_.set(kept_.t, kept_.x, t_, x_);
      set = true;
      between_.at(t, x);
    };
    // Every step rounds the time.
    const S due = t_ == S(plan_.times.back()) ? S(static_cast<double>(4 + end_.cost.steps)) * epsilon<S>() * std::max(S(abs(t_)), S(abs(S(plan_.times.front())))) : S(0);
    for (const Crossing<S>& c : watch_.in_step(kept_.t, kept_.x, t_, x_, within, roughly, due)) {
      watch_.pass(c);
      if (!c.counts) continue;
      const EventKind& kind = events_.kinds[c.event];
      watcher_.event(c.event, c.t, c.x);
      if (!kind.terminal && !kind.ends_step) continue;
      sample_to(c.t, x_);
      t_ = c.t, x_ = c.x;
      met_ = kind.ends_step;
      begin_anew();
      if (kind.terminal)
        end_.event = c.event;
      else if (!there())
        begin_slowly();
      return;
    }
    sample_to(t_, x_);
  }
  // The times asked for within the last step, up to one at which it goes on; x: its own end.
  void sample_to(const S& until, const State& x) {
    bool set = false;
    for (; !at_times_ && next_ < plan_.times.size(); ++next_) {
      const S t = S(plan_.times[next_]);
      if (forwards_ ? t > until : t < until) return;
      if (t == to_) return;  // after what happens there
      if (t == until && until == t_) {
        watcher_.sample(t, x);
        continue;
      }
      if (!stepper_.interpolate(t, sampled_)) {
        if (!set) between_.set(kept_.t, kept_.x, t_, x);
        set = true;
        between_.at(t, sampled_);
      }
      finish(t, sampled_);
      watcher_.sample(t, sampled_);
    }
  }
  void tell_progress() {
    const auto now = std::chrono::steady_clock::now();
    if (now - told_ < std::chrono::milliseconds(100)) return;
    told_ = now;
    watcher_.progress(to_double(t_));
  }

  // Steps at the bound of stability after which a motion is no passing stiffness, and a word is due.
  static constexpr int lasting = 1000;
  // Of steps of one size: stops beyond which stability is looked at, and the first of the steps after which it is, each four times the last.
  static constexpr int enough = 8, first_look = 1024;
  // Where the last step began.
  void keep() { kept_.t = t_, kept_.x = x_, kept_.pace = stepper_.pace(), kept_.signs = watch_.signs(); }
  // A run that goes on takes the step again that the end of this one cut short, so that its steps are those of one that never ended.
  void close() {
    const bool completed = next_ >= plan_.times.size() || end_.event >= 0;
    if (completed && (whole_ || !stepper_.cut())) keep(), parted_ = false;
    if (parted_) kept_ = left_;
    if (fresh_ && completed && !record().controlled) kept_.pace = {};
    end_.checkpoint = kept_;
    end_.cost.rejected = stepper_.rejected();
    end_.cost.evaluations = equations_.evaluations;
  }

  Equations<S>& equations_;
  Stepper<S>& stepper_;
  State x_, lengths_, sampled_;  // lengths_: of the quaternions at first, where they are kept
  const RunPlan<S>& plan_;
  const IntegratorOptions& options_;
  Watcher<S>& watcher_;
  RunEnd<S>& end_;
  EventFunctions<S> events_;
  EventWatch<S> watch_;
  HermiteOutput<S> between_;
  Checkpoint<S> kept_, left_;  // where the last step began; where the steps of this run parted from those of a longer one
  S t_, to_ = S(0);
  double stop_ = std::numeric_limits<double>::infinity();  // the next one
  size_t next_ = 1;
  int method_ = 0, looks_ = 0;
  long next_look_ = first_look;
  bool at_times_, forwards_ = true, stiff_ = false, parted_ = false, met_ = false;  // met_: the last step ended at a stop
  bool whole_ = false, fresh_ = false;  // where the run stands: a step had to end there; and what follows is counted anew
  std::chrono::steady_clock::time_point told_ = std::chrono::steady_clock::now();
};

}  // namespace

template <class S>
void integrate(Equations<S>& equations, Stepper<S>& stepper, std::vector<S> x, const RunPlan<S>& plan, const IntegratorOptions& options, Watcher<S>& watcher, RunEnd<S>& end) {
  check_integration(plan.times, options, to_double(epsilon<S>()));
  Run<S>(equations, stepper, std::move(x), plan, options, watcher, end).go();
}

template <class S>
IntegrationCost integrate(ExplicitEquations<S>& equations, std::vector<S> x, const std::vector<double>& times, const IntegratorOptions& options,
                          const std::function<void(const S& t, const std::vector<S>& x)>& out) {
  struct Outputs : Watcher<S> {
    explicit Outputs(const std::function<void(const S& t, const std::vector<S>& x)>& f) : out(f) {}
    void sample(const S& t, const std::vector<S>& x) override { out(t, x); }
    const std::function<void(const S& t, const std::vector<S>& x)>& out;
  } outputs(out);
  check_integration(times, options, to_double(epsilon<S>()));
  const auto stepper = runge_kutta_steps(equations, options);
  RunEnd<S> end;
  integrate<S>(equations, *stepper, std::move(x), RunPlan<S>{times, true, {}, nullptr}, options, outputs, end);
  return end.cost;
}

template PYCRAFT_INTEGRATE(double)
template PYCRAFT_INTEGRATE(Extended)
template PYCRAFT_INTEGRATE(Quad)
template PYCRAFT_INTEGRATE_EXPLICITLY(double)
template PYCRAFT_INTEGRATE_EXPLICITLY(Extended)
template PYCRAFT_INTEGRATE_EXPLICITLY(Quad)

}  // namespace pycraft
