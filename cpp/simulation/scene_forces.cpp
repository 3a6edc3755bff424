#include "simulation/scene_forces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
bool finite(const S& x) {
  return std::isfinite(to_double(x));
}
void join(const std::vector<int>& more, std::vector<int>& all) {
  all.insert(all.end(), more.begin(), more.end());
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
}

}  // namespace

template <class S>
SceneForces<S>::SceneForces(const Scene& scene, std::shared_ptr<const CompiledModel<S>> numbers) : numbers_(std::move(numbers)), kinematics_(*numbers_) {
  const SkoStructure tree = scene.model().structure();
  coordinate_names_ = tree.coordinate_names, body_names_ = tree.body_names;
  const int nv = numbers_->nv;
  const HingeTerms terms = hinge_terms(scene);
  std::vector<int> placed, moved, counted;
  for (const SceneEntry& entry : scene.entries()) {
    if (!entry.on) continue;
    auto made = std::make_unique<Active<S>>(Active<S>{entry.name, entry.effect->declaration(), entry.effect->bind(S()), own_, static_cast<int>(effects_.size()), -1, {}, {}});
    made->bound->begin(terms);
    const Declaration& d = made->declared;
    own_ += d.own();
    if (d.work) made->worker = static_cast<int>(workers_.size()), workers_.push_back(made->number), join(d.wrenches, counted);
    if (!d.coordinates.empty()) forced_ = nv;
    for (const Knot& knot : d.knots) knots_.push_back(knot.t);
    if (!d.prescribed.empty() && std::any_of(d.knots.begin(), d.knots.end(), [](const Knot& k) { return k.rates_jump; })) jumping_.push_back(made->number);
    made->ways = ways_to_base(numbers_->parent, d.wrenches);
    made->kept.assign(d.wrenches.size(), Vector6<S>::zero());
    join(d.poses, placed), join(d.twists, moved), join(d.wrenches, wrenched_);
    effects_.push_back(std::move(made));
  }
  std::sort(knots_.begin(), knots_.end());
  knots_.erase(std::unique(knots_.begin(), knots_.end()), knots_.end());
  const auto reach = [&](std::vector<int> more_placed, std::vector<int> all_moved) {
    join(placed, more_placed), join(all_moved, more_placed);
    return Reach{ways_to_base(numbers_->parent, more_placed), ways_to_base(numbers_->parent, all_moved)};
  };
  read_ = reach({}, moved);
  join(moved, counted);
  works_ = reach({}, counted), whole_ = reach(wrenched_, moved), whole_.gathered = true;
  tau_.assign(nv, S(0)), alone_tau_.assign(nv, S(0)), rest_.assign(nv, S(0));
  if (!wrenched_.empty()) wrench_.assign(numbers_->bodies, Vector6<S>::zero()), alone_wrench_ = wrench_;
  if (!whole_.placed.empty()) kinematics_.make_room();
  if (!moved.empty()) still_.assign(numbers_->bodies, Vector6<S>::zero());
  sum_ = {tau_.data(), wrench_.data()}, alone_ = {alone_tau_.data(), alone_wrench_.data()};
}

template <class S>
std::vector<double> SceneForces<S>::own_states() const {
  std::vector<double> all;
  for (const auto& e : effects_) {
    all.insert(all.end(), e->declared.states.begin(), e->declared.states.end());
    all.insert(all.end(), e->declared.held.begin(), e->declared.held.end());
  }
  return all;
}

template <class S>
void SceneForces<S>::start(const S& t, const S* q, const S* v, const S* own) {
  at_.t = t, at_.q = q, at_.v = v ? v : rest_.data(), own_states_ = own;
  at_.pose = kinematics_.poses(), at_.twist = v ? kinematics_.twists() : still_.data();
  std::fill_n(tau_.data(), forced_, S(0));
  for (int k : wrenched_) wrench_[k] = Vector6<S>::zero();
}

template <class S>
void SceneForces<S>::act_alone(Active<S>& effect) {
  for (int j : effect.declared.coordinates) alone_tau_[j] = S(0);
  for (int k : effect.declared.wrenches) alone_wrench_[k] = Vector6<S>::zero();
  effect.bound->forces(at_of(effect), alone_);
}

template <class S>
void SceneForces<S>::act_and_look(Active<S>& effect) {
  act_alone(effect);
  refuse_unless_finite(effect);
  for (int j : effect.declared.coordinates) tau_[j] += alone_tau_[j];
  for (int k : effect.declared.wrenches) wrench_[k] = wrench_[k] + alone_wrench_[k];
}

template <class S>
S SceneForces<S>::act_and_count(Active<S>& effect) {
  act_alone(effect);
  if (effect.declared.foreign) refuse_unless_finite(effect);
  S power = S(0);
  for (int j : effect.declared.coordinates) power += alone_tau_[j] * at_.v[j], tau_[j] += alone_tau_[j];
  for (int k : effect.declared.wrenches) power += dot(alone_wrench_[k], at_.twist[k]), wrench_[k] = wrench_[k] + alone_wrench_[k];
  return effect.bound->power(at_, power);
}

template <class S>
void SceneForces<S>::act_and_keep(Active<S>& effect, S* row) {
  act_alone(effect);
  refuse_unless_finite(effect);
  for (int j : effect.declared.coordinates) row[j] += alone_tau_[j], tau_[j] += alone_tau_[j];
  for (size_t i = 0; i < effect.kept.size(); ++i) {
    const int k = effect.declared.wrenches[i];
    effect.kept[i] = alone_wrench_[k], wrench_[k] = wrench_[k] + alone_wrench_[k];
  }
}

template <class S>
void SceneForces<S>::rates(S* out) {
  for (auto& e : effects_) {
    const Declaration& d = e->declared;
    if (!d.states.empty()) e->bound->rates(at_of(*e), out + e->first);
    for (size_t i = 0; i < d.states.size(); ++i)
      if (d.foreign && !finite(out[e->first + i])) blame(*e, "the rate of state " + std::to_string(i) + " is " + short_number(to_double(out[e->first + i])), at_.t);
    std::fill_n(out + e->first + d.states.size(), d.held.size(), S(0));
  }
}

template <class S>
void SceneForces<S>::generalized_forces(const S& t, const S* q, const S* v, const S* own, S* out) {
  start(t, q, v, own);
  place(whole_);
  if (v) move(whole_);
  std::fill_n(out, numbers_->nv, S(0));
  for (auto& e : effects_)
    if (e->acts()) act_and_keep(*e, out), gather_kept(*e, out);
}

template <class S>
void SceneForces<S>::prescribe(const S& t, S* q, S* v, S* vdot) {
  for (auto& e : effects_)
    if (!e->declared.prescribed.empty()) prescribe(*e, t, q, v, vdot);
}

template <class S>
void SceneForces<S>::sample(const S& t, bool first, const S* q, const S* v, S* own) {
  start(t, q, v, own);
  bool placed = false;
  for (auto& e : effects_) {
    const Declaration& d = e->declared;
    if (!(d.period > 0)) continue;
    const double now = to_double(t), nearest = std::round(now / d.period) * d.period;
    if (!first && std::abs(now - nearest) > 1e-9 * d.period) continue;
    if (!placed) place(read_), move(read_), placed = true;
    S* const held = own + e->first + d.states.size();
    e->bound->sample(at_of(*e), held);
    for (size_t i = 0; i < d.held.size(); ++i)
      if (!finite(held[i])) blame(*e, "number " + std::to_string(i) + " of its sample is " + short_number(to_double(held[i])), at_.t);
  }
}

template <class S>
double SceneForces<S>::next_stop(double t) const {
  double next = std::numeric_limits<double>::infinity();
  const auto look = [&](double T, double phase) {  // at all (k + phase) T
    if (!(T > 0)) return;
    double k = std::floor(t / T - phase) + 1;
    if ((k + phase) * T - t < 1e-9 * T) k += 1;  // t is that one, but for a rounding
    next = std::min(next, (k + phase) * T);
  };
  for (const auto& e : effects_) look(e->declared.period, 0), look(e->declared.impulse_period, 0.5);
  return next;
}

template <class S>
double SceneForces<S>::next_knot(double t) const {
  const auto next = std::upper_bound(knots_.begin(), knots_.end(), t);
  return next == knots_.end() ? std::numeric_limits<double>::infinity() : *next;
}

template <class S>
bool SceneForces<S>::is_knot(double t) const {
  return std::binary_search(knots_.begin(), knots_.end(), t);
}

template <class S>
std::vector<int> SceneForces<S>::jumping(double t) const {
  std::vector<int> found;
  for (int number : jumping_) {
    const std::vector<Knot>& knots = effects_[number]->declared.knots;
    const auto at = std::lower_bound(knots.begin(), knots.end(), t, [](const Knot& k, double t) { return k.t < t; });
    if (at != knots.end() && at->t == t && at->rates_jump) found.push_back(number);
  }
  return found;
}

template <class S>
std::vector<std::string> SceneForces<S>::event_names() const {
  std::vector<std::string> names;
  for (const auto& e : effects_) names.insert(names.end(), e->declared.events, e->name);
  return names;
}

template <class S>
void SceneForces<S>::events(const S& t, const S* q, const S* v, const S* own, S* out) {
  start(t, q, v, own);
  place(read_), move(read_);
  for (auto& e : effects_) {
    if (e->declared.events > 0) e->bound->events(at_of(*e), out);
    out += e->declared.events;
  }
}

template <class S>
void SceneForces<S>::event_rates(const S& t, const S* q, const S* v, const S* own, S* out) {
  start(t, q, v, own);
  place(read_), move(read_);
  for (auto& e : effects_) {
    if (e->declared.events > 0) e->bound->event_rates(at_of(*e), out);
    out += e->declared.events;
  }
}

template <class S>
void SceneForces<S>::blame(const Active<S>& effect, const std::string& what, const S& t) const {
  throw EvaluationError("effect '" + effect.name + "': " + what + " at t = " + short_number(to_double(t)) + " s");
}

template <class S>
void SceneForces<S>::refuse_unless_finite(const Active<S>& effect) const {
  for (int j : effect.declared.coordinates)
    if (!finite(alone_tau_[j])) blame(effect, "its force on coordinate '" + coordinate_names_[j] + "' is " + short_number(to_double(alone_tau_[j])), at_.t);
  for (int k : effect.declared.wrenches)
    for (int i = 0; i < 6; ++i)
      if (!finite(alone_wrench_[k][i]))
        blame(effect, std::string("its ") + (i < 3 ? "moment" : "force") + " on body '" + body_names_[k] + "' is " + short_number(to_double(alone_wrench_[k][i])), at_.t);
}

// Where forces are no numbers. Infinite ones are of states that have left their range, and integrators take care of them.
template <class S>
void SceneForces<S>::look_for_culprits() {
  for (auto& e : effects_) {
    if (!e->acts()) continue;
    act_alone(*e);
    const auto is_none = [](const S& x) { return std::isnan(to_double(x)); };
    bool none = false;
    for (int j : e->declared.coordinates) none |= is_none(alone_tau_[j]);
    for (int k : e->declared.wrenches)
      for (int i = 0; i < 6; ++i) none |= is_none(alone_wrench_[k][i]);
    if (none) refuse_unless_finite(*e);
  }
}

#define PYCRAFT_INSTANTIATE(S) template class SceneForces<S>;
PYCRAFT_FOR_EACH_EFFECT_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
