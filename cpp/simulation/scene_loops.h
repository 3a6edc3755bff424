// Accelerations of a scene on the loops that its effects keep, and states taken onto them.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dynamics/constrained_dynamics.h"
#include "runtime/errors.h"
#include "simulation/scene_forces.h"

namespace pycraft {

template <class S>
class SceneLoops {
 public:
  SceneLoops(const Multibody& model, const HingeTerms& terms, const Solving& how, const std::vector<std::unique_ptr<Active<S>>>& effects)
      : how_(how), workspace_(model, terms), zeros_(model.nv(), S(0)) {
    auto loops = std::make_shared<ResolvedLoops>();
    for (const auto& e : effects) {
      first_.push_back(loops->rows);
      if (e->declared.loops) take(*e->declared.loops, *loops);
    }
    first_.push_back(loops->rows);
    loops_ = std::move(loops);
  }

  // q, v, tau (null: none), what acts on bodies: θ̈.
  void accelerate(const S* q, const S* v, const S* tau, const Applied<S>& applied, S* vdot) {
    typename ConstrainedWorkspace<S>::Asked asked;
    asked.q = q, asked.v = v ? v : zeros_.data(), asked.tau = tau ? tau : zeros_.data();
    asked.applied = &applied, asked.form = how_.form, asked.refinement = how_.refinement, asked.near = true;
    if (drawn_) asked.gains = &gains_;
    workspace_.accelerate(loops_, asked);
    std::copy_n(workspace_.result().data(), zeros_.size(), vdot);
  }
  // Q*λ of an effect's loops at the last state, added.
  void add_forces(int effect, S* out) const { workspace_.add_forces(first_[effect], first_[effect + 1], out); }
  void take_onto(S* q, S* v) { workspace_.take_onto(loops_, q, v, how_.form); }
  // ModelError that names the row where a state is off the loops, or moves off them: by more than steps are off.
  void check_start(const S* q, const S* v) {
    std::vector<S> positions, velocities;
    workspace_.find_off(loops_, q, v, positions, velocities);
    refuse(positions, "is off", "its rows are kept from a state that is on them");
    S fastest = S(0);
    for (size_t i = 0; i < zeros_.size(); ++i) fastest = maximum(fastest, S(v[i] < S(0) ? -v[i] : v[i]));
    for (S& off : velocities) off = fastest > S(0) ? S(off / fastest) : S(0);
    refuse(velocities, "moves off", "Q v = 0 holds at a start");
  }

 private:
  static constexpr double far = 1e-6;  // as mobility has it: larger residuals are no state on the loops

  void take(const KeptLoops& kept, ResolvedLoops& to) {
    const std::shared_ptr<const ResolvedLoops> all = kept.set->resolved();
    whole_.push_back(all);
    for (const std::string& name : kept.kept())
      for (const ResolvedLoop& loop : all->loops) {
        if (loop.loop->name != name) continue;
        ResolvedLoop own = loop;
        own.first_row = to.rows;
        for (int r = loop.first_row; r < loop.first_row + loop.rows; ++r) to.names.push_back(all->names[r]), to.of_positions.push_back(all->of_positions[r]);
        to.rows += loop.rows;
        gains_.resize(to.rows, {kept.alpha, kept.beta});
        drawn_ |= kept.alpha != 0 || kept.beta != 0;
        to.loops.push_back(std::move(own));
      }
  }
  void refuse(const std::vector<S>& off, const std::string& how, const std::string& rule) const {
    for (int r = 0; r < loops_->rows; ++r)
      if (!(to_double(off[r]) <= far))
        throw ModelError("a run's start " + how + " row '" + loops_->names[r] + "' by " + short_number(to_double(off[r])) + ": " + rule + "; model.assemble(q, v) finds one");
  }

  Solving how_;
  ConstrainedWorkspace<S> workspace_;
  std::shared_ptr<const ResolvedLoops> loops_;
  std::vector<std::shared_ptr<const ResolvedLoops>> whole_;  // poses that paths point to
  std::vector<int> first_;                                   // rows of effects
  std::vector<Baumgarte> gains_;
  bool drawn_ = false;
  std::vector<S> zeros_;
};

}  // namespace pycraft
