// Accelerations of a scene on the loops that its effects keep, and states taken onto them:
//
//   (ℳ + J) θ̈ + 𝒞 = T + Q*λ,   Q θ̈ + Q̇θ̇ = 0,   θ̈(j) = motion(j) of every prescribed coordinate
//
// by tree augmentation, or without multipliers on the tree that the loops are embedded in (dynamics/embedded_dynamics.h). What loops and prescribed
// motion ask of one motion, differently, is refused by the names of rows.
#pragma once

#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "dynamics/constrained_dynamics.h"
#include "dynamics/embedded_dynamics.h"
#include "model/checks.h"
#include "runtime/errors.h"
#include "simulation/scene_forces.h"
#include "simulation/taken_loops.h"

namespace pycraft {

template <class S>
class SceneLoops {
 public:
  SceneLoops(const Multibody& model, const HingeTerms& terms, const Solving& how, const std::vector<std::unique_ptr<Active<S>>>& effects)
      : how_(how), workspace_(model, free_terms(terms)), zeros_(model.nv(), S(0)), load_(zeros_) {
    auto loops = std::make_shared<ResolvedLoops>();
    const Active<S>*embeds = nullptr, *augments = nullptr;
    for (const auto& e : effects) {
      if (e->declared.loops) (e->declared.loops->embedded ? embeds : augments) = e.get();
      first_.push_back(loops->rows);
      if (e->declared.loops) take(*e->declared.loops, *loops);
    }
    first_.push_back(loops->rows);
    const std::vector<std::string> names = model.structure().coordinate_names;
    for (int j = 0; j < model.nv(); ++j)
      if (terms.is_prescribed(j)) hold(j, names[j], *loops);
    driven_.assign(loops->rows, S(0)), rates_ = driven_;
    loops_ = std::move(loops);
    if (!embeds) return;
    if (augments) throw EvaluationError("effect '" + embeds->name + "' embeds its loops and effect '" + augments->name + "' augments: a scene keeps all of its loops by one method");
    if (how.form != Form::fast || how.refinement.wider() || how.refinement.gathers_wider())
      throw EvaluationError("effect '" + embeds->name + "' embeds its loops, by form 'fast' and residuals of the same precision: take those, or method='augment'");
    embedded_ = std::make_unique<EmbeddedWorkspace<S>>(model, free_terms(terms));
  }

  // (ℳ + J) Δv = Q*λ + Σ p, Q Δv = 0, Δv(j) as given at every prescribed coordinate: Δv of all, and the impulses p that prescribed motion needs.
  void change_velocities(const S& t, const S* q, const S* given, S* needed, S* change) {
    const bool drawn = std::exchange(drawn_, false);
    const Applied<S> none{Vector3<S>::zero()};
    try {
      accelerate(t, q, nullptr, nullptr, none, given, needed, change);
    } catch (...) {
      drawn_ = drawn;
      throw;
    }
    drawn_ = drawn;
  }
  // q, v, tau (null: none), what acts on bodies, θ̈ of prescribed coordinates by coordinate: θ̈ of all, and what their motion needs beside tau.
  void accelerate(const S& t, const S* q, const S* v, const S* tau, const Applied<S>& applied, const S* motion, S* needed, S* vdot) {
    if (!v) v = zeros_.data();
    std::copy_n(tau ? tau : zeros_.data(), zeros_.size(), load_.data());
    for (size_t i = 0; i < held_.size(); ++i) driven_[first_.back() + i] = motion[held_[i]];
    typename ConstrainedWorkspace<S>::Asked asked{q, v, load_.data()};
    asked.applied = &applied, asked.form = how_.form, asked.refinement = how_.refinement, asked.driven = driven_.data();
    if (drawn_) asked.gains = &gains_;
    const auto by = [&](auto& workspace) {
      telling_time(t, [&] { workspace.accelerate(loops_, asked); });
      std::copy_n(workspace.result().data(), zeros_.size(), vdot);
      for (size_t i = 0; i < held_.size(); ++i) needed[held_[i]] = workspace.multipliers()[first_.back() + i], vdot[held_[i]] = motion[held_[i]];
    };
    if (embedded_)
      by(*embedded_);
    else
      by(workspace_);
  }
  void add_to_hinges(const S* inertia) {
    if (embedded_)
      embedded_->add_to_hinges(inertia);
    else
      workspace_.add_to_hinges(inertia);
  }
  // Q*λ of an effect's loops at the last state, added.
  void add_forces(int effect, S* out) const {
    if (embedded_)
      embedded_->add_forces(first_[effect], first_[effect + 1], out);
    else
      workspace_.add_forces(first_[effect], first_[effect + 1], out);
  }
  bool embeds() const { return embedded_ != nullptr; }
  // At the last state, as the workspace has it.
  const ResolvedLoops& kept() const { return *loops_; }
  Vector6<S> force(int loop, bool on_a) const { return embedded_ ? embedded_->force(loop, on_a) : workspace_.force(loop, on_a); }
  // Whether states are taken onto the rows: not where all of them are drawn there by Baumgarte's gains.
  bool settles() const { return kept_; }
  void take_onto(const S& t, S* q, S* v) {
    set_rates(v);
    telling_time(t, [&] {
      if (embedded_)
        embedded_->take_onto(loops_, q, v, rates_.data());
      else
        workspace_.take_onto(loops_, q, v, rates_.data(), how_.form);
    });
  }
  // Loops that close on a state: positions within what steps reach, velocities any, taken onto them by the loops' impulse, which takes the least
  // kinetic energy there is to take. By the tree's factors, whatever the method.
  void close(const S& t, S* q, S* v) {
    set_rates(v);
    telling_time(t, [&] { workspace_.take_onto(loops_, q, v, rates_.data(), how_.form); });
  }
  // A state of a step, taken there as far as that is sure: accelerations there are a smooth function of the states about the loops. Off them they are
  // none near singular states, where what a state is off by is divided by the square of the way to those.
  void bring(S* q, S* v) {
    set_rates(v);
    if (embedded_)
      embedded_->bring(loops_, q, v, rates_.data());
    else
      workspace_.bring(loops_, q, v, rates_.data(), how_.form);
  }
  // ModelError that names the row where a state is off the loops, or moves off them: by more than steps are off.
  void check_start(const S* q, const S* v) {
    std::vector<S> positions, velocities;
    set_rates(v);
    workspace_.find_off(loops_, q, v, rates_.data(), positions, velocities);
    refuse(positions, "is off", "its rows are kept from a state that is on them");
    S fastest = held_.empty() ? S(stopped / far) : S(slow);
    for (size_t i = 0; i < zeros_.size(); ++i) fastest = maximum(fastest, S(v[i] < S(0) ? -v[i] : v[i]));
    for (S& off : velocities) off /= fastest;
    refuse(velocities, "moves off", "Q v = 0 holds of a velocity");
  }

 private:
  static constexpr double far = 1e-6;   // as mobility has it: larger residuals are no state on the loops
  static constexpr double slow = 1e-3;  // motions of values alone have rates by differences, at rest ε |q| over their step: some 1e-12, of 1e-6 · slow

  template <class F>
  void telling_time(const S& t, F f) const {
    try {
      f();
    } catch (const EvaluationError& e) {
      std::string said = e.what();
      said += held_.empty() ? "," : prescribed();
      said.append(" at t = ").append(short_number(to_double(t))).append(" s");
      throw EvaluationError(said);
    }
  }
  static HingeTerms free_terms(HingeTerms terms) {
    terms.prescribed.clear();
    return terms;
  }
  // A prescribed coordinate is a row more, θ̈ as its motion says, and its multiplier what that needs.
  void hold(int j, const std::string& name, ResolvedLoops& to) {
    auto row = std::make_shared<Loop>();
    row->name = "prescribed: " + name;
    row->coupling.coordinates.push_back({name, 0, {0.0, 1.0}});
    to.names.push_back(row->name), to.of_positions.push_back(false);
    to.loops.push_back({row, to.rows++, 1, {}, {0}, {j}});
    gains_.resize(to.rows);
    held_.push_back(j);
  }
  void set_rates(const S* v) {
    for (size_t i = 0; i < held_.size(); ++i) rates_[first_.back() + i] = v[held_[i]];
  }
  void take(const KeptLoops& kept, ResolvedLoops& to) {
    const size_t before = to.loops.size();
    whole_.push_back(take_loops(*kept.set, kept.kept(), to));
    gains_.resize(to.rows, {kept.alpha, kept.beta});
    if (to.loops.size() > before) (kept.alpha != 0 || kept.beta != 0 ? drawn_ : kept_) = true;
  }
  void refuse(const std::vector<S>& off, const std::string& how, const std::string& rule) const {
    for (int r = 0; r < loops_->rows; ++r)
      if (!(to_double(off[r]) <= far))
        throw ModelError("the state given" + prescribed() + " " + how + " row '" + loops_->names[r] + "' by " + short_number(to_double(off[r])) + ": " + rule +
                         "; model.assemble(q, v, fix=[...]) finds one");
  }

  // What was put where its motion has it, before the state was looked at.
  std::string prescribed() const {
    std::string names;
    for (size_t i = 0; i < held_.size(); ++i)
      names += (i ? ", '" : "'") + loops_->names[first_.back() + i].substr(std::string("prescribed: ").size()) + "'";
    return names.empty() ? names : ", with " + names + " as prescribed,";
  }

  Solving how_;
  ConstrainedWorkspace<S> workspace_;
  std::unique_ptr<EmbeddedWorkspace<S>> embedded_;           // null: by augmentation
  std::shared_ptr<const ResolvedLoops> loops_;
  std::vector<std::shared_ptr<const ResolvedLoops>> whole_;  // poses that paths point to
  std::vector<int> first_;                                   // rows of effects
  std::vector<Baumgarte> gains_;
  std::vector<int> held_;                                    // prescribed coordinates, of rows after those of effects
  bool drawn_ = false, kept_ = false;                        // drawn_: some rows are, by gains; kept_: some are not
  std::vector<S> zeros_, load_, driven_, rates_;
};

}  // namespace pycraft
