// The right-hand side of a scene for integrators:
//
//   x = (q, v, y, w),   q̇ = N(q) v,   v̇ the scene's accelerations,   ẏ the rates of the effects' own states,   ẇ the power of each that does work
//
// What controllers hold from one sample to the next is part of y and has no rate. Works are integrals beside the motion: they are kept in units of
// 2¹⁰⁰ J, which no tolerance sees and which costs no bit, so that no step is chosen for their sake. Prescribed coordinates are where their motion
// says at every evaluation, whatever x says; in x they are set to it after each step. Likewise states are taken onto the loops that are kept, at every
// evaluation as far as that is sure.
//
// Kind: which equations they are (simulation/equations.h). The others than explicit ones: scene_steps.h, scene_momenta.h, scene_linearized.h.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "dynamics/states_together.h"
#include "runtime/interrupt.h"
#include "simulation/compiled_scene.h"
#include "simulation/equations.h"

namespace pycraft {

template <class S, template <class> class Kind = ExplicitEquations>
class SceneEquations : public Kind<S> {
 public:
  using typename Equations<S>::State;
  using Equations<S>::nq, Equations<S>::nv, Equations<S>::evaluations;
  // works: whether the works of effects are part of x.
  SceneEquations(CompiledScene<S>& scene, bool works)
      : Kind<S>(scene.numbers(), scene.effects().own() + (works ? static_cast<int>(scene.effects().workers().size()) : 0)), scene_(scene), own_(scene.effects().own()),
        works_(this->rest() - own_), q_(nq()), v_(nv()), gained_(scene.effects().workers().size()) {}

  CompiledScene<S>& scene() const { return scene_; }
  int works() const { return works_; }
  int own() const { return own_; }  // states of the effects
  int integrals() const override { return works_; }
  static S unit_of_work() { return S(std::ldexp(1.0, 100)); }

  // x of a state at t: own states as they are at first where own is null; samples are taken, prescribed coordinates set, works zero.
  State initial(const S& t, const S* q, const S* v, const S* own) {
    between(t, S(std::numeric_limits<double>::infinity()));
    State x = placed(t, q, v, own);
    if (scene_.loops()) scene_.loops()->check_start(x.data(), x.data() + nq());
    settle(t, x);
    sample(t, own == nullptr, x);
    return x;
  }
  // The same on no loops, for what is asked of a configuration alone.
  State initial_of_tree(const S& t, const S* q, const S* v, const S* own) {
    State x = placed(t, q, v, own);
    sample(t, own == nullptr, x);
    return x;
  }

  // Between the ends of a step, where no samples are taken and states need not be on loops.
  State initial_between(const S& t, const S* q, const S* v, const S* own) { return placed(t, q, v, own); }

  void evaluate(const S& now, const S* q, const S* v, const S* rest, S* vdot, S* rest_rate) override {
    if ((++evaluations & 63) == 0) check_interrupt();
    const S t = inside(now);
    place(t, q, v);
    if (works_ > 0)
      scene_.accelerations_and_powers(t, this->at_q_, this->at_v_, rest, vdot, rest_rate + own_);
    else
      scene_.accelerations(t, this->at_q_, this->at_v_, rest, vdot);
    follow(rest_rate);
  }
  // Beside those of other runs where there are such.
  void go_through(Stages<S>& stages) override {
    if constexpr (std::is_same_v<S, double>)
      if (StatesTogether* const others = scene_.others()) {
        InTurn states(*this, stages);
        return others->run(states);
      }
    Kind<S>::go_through(stages);
  }

  void settle(const S& t, State& x) override {
    prescribe(t, x);
    if (settles()) scene_.loops()->take_onto(t, x.data(), x.data() + nq());
  }
  bool settles() const override { return scene_.loops() && scene_.loops()->settles(); }
  bool stops() const override { return std::isfinite(next_stop(0)); }
  double next_stop(double t) const override { return scene_.effects().next_stop(t); }
  bool jumps() const override { return scene_.gives_impulses(); }
  void stop(const S& t, State& x) override {
    S *const v = x.data() + nq(), *const own = v + nv();
    if (jumps()) {
      scene_.give_impulses(t, x.data(), v, own, gained_.data());
      for (int i = 0; i < works_; ++i) own[own_ + i] += gained_[i] / unit_of_work();
    }
    scene_.effects().sample(t, false, x.data(), v, own);
  }
  double next_knot(double t) const override { return scene_.effects().next_knot(t); }
  void between(const S& from, const S& to) override {
    const auto knot = [&](const S& t) { return std::isfinite(to_double(t)) && S(to_double(t)) == t && scene_.effects().is_knot(to_double(t)); };
    const auto rounding = [](const S& t) { return S(2) * epsilon<S>() * maximum(S(t < S(0) ? -t : t), S(std::ldexp(1.0, -200))); };
    begins_ = knot(from), ends_ = knot(to);
    if (begins_) from_ = from, first_ = from + rounding(from);
    if (ends_) to_ = to, last_ = to - rounding(to);
  }
  std::vector<std::string> jump_names() const override {
    std::vector<std::string> names;
    for (int number : scene_.effects().jumping()) names.push_back(scene_.effects().effects()[number]->name);
    return names;
  }
  std::vector<int> jump(const S& t, State& x) override {
    const std::vector<int> which = scene_.effects().jumping(to_double(t));
    std::vector<int> found;
    if (which.empty() || S(to_double(t)) != t) return found;
    S *const v = x.data() + nq(), *const own = v + nv();
    std::copy_n(v, nv(), v_.data());
    scene_.effects().prescribe(inside(t), nullptr, v_.data(), nullptr);
    if (std::equal(v, v + nv(), v_.begin())) return found;  // it has happened
    scene_.change_velocities(t, x.data(), v, v_.data(), gained_.data());
    for (int i = 0; i < works_; ++i) own[own_ + i] += gained_[i] / unit_of_work();
    const std::vector<int>& all = scene_.effects().jumping();
    for (int number : which) found.push_back(static_cast<int>(std::find(all.begin(), all.end(), number) - all.begin()));
    return found;
  }
  std::vector<std::string> event_names() const override { return scene_.effects().event_names(); }
  void events(const S& t, const State& x, S* out) override {
    take(t, x);
    scene_.effects().events(t, q_.data(), v_.data(), x.data() + nq() + nv(), out);
  }
  void event_rates(const S& t, const State& x, S* out) override {
    take(t, x);
    scene_.effects().event_rates(t, q_.data(), v_.data(), x.data() + nq() + nv(), out);
  }
  std::string name_of(int i) const override;

 protected:
  // t, or the time next to it where it is an end that is a knot.
  S inside(const S& t) const { return begins_ && !(t > from_) ? first_ : ends_ && !(t < to_) ? last_ : t; }

 private:
  // q and v at a state, prescribed coordinates as they are.
  void take(const S& t, const State& x) {
    std::copy_n(x.data(), nq(), q_.data()), std::copy_n(x.data() + nq(), nv(), v_.data());
    if (!scene_.prescribed().empty()) set_prescribed(t, q_.data(), v_.data());
  }
  State placed(const S& t, const S* q, const S* v, const S* own) {
    State x(q, q + nq());
    x.insert(x.end(), v, v + nv());
    for (double y : scene_.effects().own_states()) x.push_back(S(y));
    if (own) std::copy_n(own, own_, x.data() + nq() + nv());
    x.insert(x.end(), works_, S(0));
    prescribe(t, x);
    return x;
  }
  void sample(const S& t, bool first, State& x) {
    if (stops()) scene_.effects().sample(t, first, x.data(), x.data() + nq(), x.data() + nq() + nv());
  }
  void prescribe(const S& t, State& x) {
    if (!scene_.prescribed().empty()) set_prescribed(t, x.data(), x.data() + nq());
  }
  // Positions do not jump at a knot.
  void set_prescribed(const S& t, S* q, S* v) {
    scene_.effects().prescribe(t, q, v, nullptr);
    if (const S at = inside(t); at != t) scene_.effects().prescribe(at, nullptr, v, nullptr);
  }
  struct InTurn : StatesInTurn {
    InTurn(SceneEquations& of, Stages<S>& given) : equations(of), stages(given) {}
    PreparedLinks* ask() override { return stages.next() ? equations.ask(stages.time(), stages.at(), stages.rate()) : nullptr; }
    void answer(bool sound) override { equations.answer(sound, stages.rate()); }
    SceneEquations& equations;
    Stages<S>& stages;
  };
  PreparedLinks* ask(const S& now, const State& x, State& rate) {
    ++evaluations;
    const S t = inside(now);
    const S *q = x.data(), *v = q + nq();
    S *const vdot = rate.data() + nq(), *const rest_rate = vdot + nv();
    place(t, q, v);
    return scene_.ask(t, this->at_q_, this->at_v_, v + nv(), vdot, works_ > 0 ? rest_rate + own_ : nullptr);
  }
  void answer(bool sound, State& rate) {
    scene_.answer(sound);
    follow(rate.data() + nq() + nv());
    configuration_rate(this->model(), this->at_q_, this->at_v_, rate.data());
  }
  // Where accelerations are asked for.
  void place(const S& t, const S* q, const S* v) {
    this->at_q_ = q, this->at_v_ = v;
    if (scene_.prescribed().empty() && !settles()) return;
    std::copy_n(q, nq(), q_.data()), std::copy_n(v, nv(), v_.data());
    if (!scene_.prescribed().empty()) scene_.effects().prescribe(t, q_.data(), v_.data(), nullptr);
    if (settles()) scene_.loops()->bring(q_.data(), v_.data());
    this->at_q_ = q_.data(), this->at_v_ = v_.data();
  }
  // The rates of what follows velocities, powers there.
  void follow(S* rest_rate) {
    for (int i = 0; i < works_; ++i) rest_rate[own_ + i] /= unit_of_work();
    if (own_ > 0) scene_.effects().rates(rest_rate);
  }
  CompiledScene<S>& scene_;
  int own_, works_;
  State q_, v_, gained_;
  bool begins_ = false, ends_ = false;  // whether functions of time go over into others where the present piece does
  S from_ = S(0), to_ = S(0), first_ = S(0), last_ = S(0);
};

template <class S, template <class> class Kind>
std::string SceneEquations<S, Kind>::name_of(int i) const {
  const Multibody& model = scene_.scene().model();
  if (i < nq()) {
    int k = 0;
    while (k + 1 < model.bodies() && model.q_offset(k + 1) <= i) ++k;
    const int first = model.q_offset(k), count = (k + 1 < model.bodies() ? model.q_offset(k + 1) : nq()) - first;
    std::string name = "coordinate '" + model.body(k).hinge.name;
    if (count > 1) name.append("[").append(std::to_string(i - first)).append("]");
    return name + "'";
  }
  if (i < nq() + nv()) return "the velocity of '" + model.structure().coordinate_names[i - nq()] + "'";
  for (const auto& e : scene_.effects().effects()) {
    const int at = i - nq() - nv() - e->first;
    if (at >= 0 && at < e->declared.own()) return "state " + std::to_string(at) + " of effect '" + e->name + "'";
    if (i - nq() - nv() - own_ == e->worker) return "the work of effect '" + e->name + "'";
  }
  return Equations<S>::name_of(i);
}

}  // namespace pycraft
