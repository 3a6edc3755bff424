// The effects of a scene at a state, all but accelerations: where the bodies that they read are, what forces they give, their energies, states and
// samples. In any scalar, numbers with derivatives among them (∂ forces/∂q, ∂v exactly).
//
// One thread works with it: it holds the numbers of the state that it was asked for last. No allocation after the first state.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "simulation/effect.h"
#include "simulation/scene.h"
#include "simulation/scene_kinematics.h"

namespace pycraft {

// An effect that is on, in the scalar of the scene.
template <class S>
struct Active {
  std::string name;
  Declaration declared;
  std::unique_ptr<BoundEffect<S>> bound;
  int first;                        // of its own states
  int number;                       // among the effects that are on
  int worker;                       // among those that do work, -1: none
  std::vector<int> ways;            // from the bodies that it pushes to the base
  std::vector<Vector6<S>> kept;     // what it pushed them with, where that is kept
  bool acts() const { return !declared.coordinates.empty() || !declared.wrenches.empty(); }
};

template <class S>
class SceneForces {
 public:
  SceneForces(const Scene& scene, std::shared_ptr<const CompiledModel<S>> numbers);
  SceneForces(const SceneForces&) = delete;

  const CompiledModel<S>& numbers() const { return *numbers_; }
  const std::vector<std::unique_ptr<Active<S>>>& effects() const { return effects_; }
  const std::vector<int>& workers() const { return workers_; }         // numbers of effects that do work
  const std::vector<int>& wrenched() const { return wrenched_; }       // bodies that may carry wrenches
  bool forced() const { return forced_ > 0; }                          // whether some effect gives generalized forces
  int own() const { return own_; }
  std::vector<double> own_states() const;                              // what they are at first
  // The bodies that effects read; works: with those whose velocities make powers of forces; whole: with all that forces reach.
  const Reach& read() const { return read_; }
  const Reach& works() const { return works_; }
  const Reach& whole() const { return whole_; }

  // ---- a state: start, then what is to be done at it
  void start(const S& t, const S* q, const S* v, const S* own);        // v null: at rest
  void set_step(const S& h) { at_.step = h; }
  const At<S>& at() const { return at_; }
  void place(const Reach& reach) { reach.poses_alone() ? kinematics_.place_alone(reach.placed, at_.q) : kinematics_.place(reach.placed, at_.q); }
  void move(const Reach& reach) { kinematics_.move(reach.moved, at_.v); }
  void act(Active<S>& effect) { effect.bound->forces(at_of(effect), sum_); }
  void act_and_look(Active<S>& effect);                 // at what comes from outside
  S act_and_count(Active<S>& effect);                   // its power
  void act_and_keep(Active<S>& effect, S* row);         // its generalized forces (nv) added to a row, its wrenches kept
  void gather_kept(Active<S>& effect, S* row) { kinematics_.gather(effect.ways, effect.declared.wrenches, effect.kept.data(), row); }
  void impulses(Active<S>& effect, std::uint64_t number, S* out) { effect.bound->impulses(at_of(effect), number, out); }
  std::optional<Edge> edge(Active<S>& effect) { return effect.bound->edge(at_of(effect)); }
  S potential(Active<S>& effect) { return effect.bound->potential(at_of(effect)); }
  S* tau() { return tau_.data(); }
  const Vector6<S>* wrenches() const { return wrench_.data(); }

  // Of the last state: rates of the effects' own states.
  void rates(S* out);
  // What all effects' forces sum up to, of gravity and prescribed motion nothing.
  void generalized_forces(const S& t, const S* q, const S* v, const S* own, S* out);
  // Positions, velocities and accelerations of prescribed coordinates at t; what is null is not asked for. EvaluationError names the effect where
  // they are not finite.
  void prescribe(const S& t, S* q, S* v, S* vdot);
  void prescribe(Active<S>& effect, const S& t, S* q, S* v, S* vdot) {
    if (!effect.bound->prescribe(t, q, v, vdot)) blame(effect, "its motion is not finite (or is a quaternion of length 0)", t);
  }
  // Controllers whose sample falls on t (all of them where `first`): what they hold, in place in `own`.
  void sample(const S& t, bool first, const S* q, const S* v, S* own);
  // The first knot of a function of time after t; infinite where there is none. Whether there is one at t; numbers of the effects whose prescribed
  // velocities jump at t, and of all whose do anywhere.
  double next_knot(double t) const;
  bool is_knot(double t) const;
  std::vector<int> jumping(double t) const;
  const std::vector<int>& jumping() const { return jumping_; }
  // The first sample or impulse after t, no earlier than a rounding of it; infinite where there is none.
  double next_stop(double t) const;
  // The functions whose zeros say where effects are others: one after another, and the names of the effects that they are of.
  std::vector<std::string> event_names() const;
  void events(const S& t, const S* q, const S* v, const S* own, S* out);
  void event_rates(const S& t, const S* q, const S* v, const S* own, S* out);
  // EvaluationError that names the effect of forces that are not finite and the time; nothing where there is none.
  void look_for_culprits();

 private:
  [[noreturn]] void blame(const Active<S>& effect, const std::string& what, const S& t) const;
  const At<S>& at_of(const Active<S>& effect) {
    at_.own = own_states_ + effect.first;
    return at_;
  }
  void act_alone(Active<S>& effect);
  void refuse_unless_finite(const Active<S>& effect) const;

  std::shared_ptr<const CompiledModel<S>> numbers_;
  std::vector<std::string> coordinate_names_, body_names_;
  std::vector<std::unique_ptr<Active<S>>> effects_;
  std::vector<int> workers_, wrenched_, jumping_;
  std::vector<double> knots_;                           // of all effects, rising
  SceneKinematics<S> kinematics_;
  Reach read_, works_, whole_;
  int own_ = 0;
  size_t forced_ = 0;                                   // : how many generalized forces are cleared, none or all
  At<S> at_{};
  const S* own_states_ = nullptr;
  Forces<S> sum_{}, alone_{};
  std::vector<S> tau_, alone_tau_, rest_;
  std::vector<Vector6<S>> wrench_, alone_wrench_, still_;
};

#define PYCRAFT_EXTERN(S) extern template class SceneForces<S>;
PYCRAFT_FOR_EACH_EFFECT_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
