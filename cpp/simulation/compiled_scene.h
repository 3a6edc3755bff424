// A scene compiled: an ordered list of passes, decided by structure alone.
//
//   poses          X_WB of the bodies that somebody reads, along their ways to the base and no others, with the rows of H there
//   twists         V of the bodies whose velocities somebody reads, likewise
//   <effect>       forces, wrenches or prescribed accelerations of one effect
//   accelerations  forward dynamics, hybrid where coordinates are prescribed, on loops where some are kept; a uniform gravity is a number in it, and rotors are in its D
//
// A pass is there because of an effect that is on; what is off or absent leaves no pass, no branch and no memory. A state at rest has a list of
// its own, without what needs velocities, and so has a run that keeps account of the work of each effect. Every pass counts how often it ran.
//
// One thread works with one compiled scene: it holds the numbers of the state that it was asked for last. No allocation after the first state.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "dynamics/hybrid_dynamics.h"
#include "simulation/scene_forces.h"
#include "simulation/scene_loops.h"

namespace pycraft {

struct PassRecord {
  std::string name, what;             // what it does, in words
  std::vector<std::string> because;   // the effects that it is there for
  long times = 0;
};

// Which list of passes: of a motion; of a state at rest; of a motion whose works are counted; of either with the forces of each effect kept apart.
enum class SceneList { motion, rest, works, apart, apart_at_rest };

template <class S>
class CompiledScene {
 public:
  CompiledScene(const Scene& scene, const Solving& how);
  CompiledScene(const CompiledScene&) = delete;

  // v̇ (nv) at a state, v null where it is at rest; own: the effects' states (SceneForces::own_states). EvaluationError names the effect and the
  // time where one gives what is not finite; SingularHingeError as forward dynamics. False where v̇ is not finite though the forces are.
  bool accelerations(const S& t, const S* q, const S* v, const S* own, S* vdot) { return run(v ? SceneList::motion : SceneList::rest, t, q, v, own, vdot); }
  // The same with the power of each effect that does work, in their order (SceneForces::workers).
  bool accelerations_and_powers(const S& t, const S* q, const S* v, const S* own, S* vdot, S* powers);
  // The same with generalized forces (nv) of every effect that is on, row by row: their sum is ℳ v̇ + 𝒞 of the model without gravity.
  bool accelerations_and_forces(const S& t, const S* q, const S* v, const S* own, S* vdot, S* rows);
  // Kinetic energy, rotors included; then the potential energy of every effect that is on, zero where it has none.
  void energies(const S& t, const S* q, const S* v, const S* own, S* kinetic, S* potential);

  // Accelerations of implicit steps of size h from now on (0: plain ones): D has h C + h² K in addition.
  void set_step(const S& h);
  // Impulses that fall on t change v; gained: the kinetic energy that each effect which does work gave by them. SingularHingeError as above.
  void give_impulses(const S& t, const S* q, S* v, const S* own, S* gained);
  // Prescribed velocities become those of `wanted` (nv), all others what the impulse of that makes of them:
  //   (ℳ + J)_ff Δv_f = -(ℳ + J)_fp Δv_p,   p = (ℳ + J)_pf Δv_f + (ℳ + J)_pp Δv_p,
  // on loops with their impulse Q*λ. gained: by effects that do work, Σ p (v + v⁺)/2, which is the change of the kinetic energy.
  void change_velocities(const S& t, const S* q, S* v, const S* wanted, S* gained);
  // Where effects keep loops: a start that is off them is refused, what drifts off them is taken back.
  SceneLoops<S>* loops() { return loops_.get(); }
  bool gives_impulses() const { return !impulsive_.empty(); }
  bool steps_implicitly() const;

  const Scene& scene() const { return scene_; }
  const Solving& how() const { return how_; }
  SceneForces<S>& effects() { return forces_; }
  const SceneForces<S>& effects() const { return forces_; }
  const CompiledModel<S>& numbers() const { return forces_.numbers(); }
  const std::vector<int>& prescribed() const { return prescribed_; }
  bool by_kernels() const { return !loops_ && solver_->by_kernels(); }
  // Accelerations wait in a fiber for those of other runs, from now on; null: no more (dynamics/states_together.h).
  void wait_for(StatesTogether* others) { solver_->wait_for(others); }
  StatesTogether* others() const { return solver_->others(); }
  // Accelerations in two halves, between them the kernels answer what is asked; powers null where they are not counted.
  PreparedLinks* ask(const S& t, const S* q, const S* v, const S* own, S* vdot, S* powers);
  bool answer(bool sound);
  // Why they cannot, in words; empty: they can.
  std::string alone() const;
  long in_packs() const { return solver_->links() ? solver_->links()->in_packs() : 0; }  // how many of them came from packs
  std::vector<PassRecord> passes(SceneList list) const;  // with how often they ran
  // One pass of a list again, uncounted, at the state where the list ran last: for measuring it, its results are none.
  void repeat(SceneList list, size_t pass) {
    const Pass& again = lists_[static_cast<int>(list)][pass];
    again.run(*this, again.of);
  }

 private:
  struct Pass {
    void (*run)(CompiledScene&, Active<S>*);
    Active<S>* of;
    PassRecord record;
  };
  void plan(SceneList list);
  void add_reach(std::vector<Pass>& passes, const Reach& reach, bool moving, bool works);
  void add_accelerations(std::vector<Pass>& passes, bool works);
  std::string described(const Active<S>& effect) const;
  void start(SceneList list, const S& t, const S* q, const S* v, const S* own, S* vdot);
  void run(size_t from, size_t to) {
    std::vector<Pass>& passes = lists_[static_cast<int>(list_)];
    for (size_t i = from; i < to; ++i) {
      passes[i].run(*this, passes[i].of);
      ++passes[i].record.times;
    }
  }
  bool finish();
  bool run(SceneList list, const S& t, const S* q, const S* v, const S* own, S* vdot) {
    start(list, t, q, v, own, vdot);
    run(0, lists_[static_cast<int>(list)].size());
    return finish();
  }
  size_t solving() const { return solving_[static_cast<int>(list_)]; }
  void add_structural_forces(const S* q, const S* vdot, S* rows);
  RigidDynamics<S>& whole_model();

  // ---- passes
  template <bool works>
  static void place(CompiledScene& s, Active<S>*) { s.forces_.place(works ? s.forces_.works() : s.forces_.read()); }
  template <bool works>
  static void move(CompiledScene& s, Active<S>*) { s.forces_.move(works ? s.forces_.works() : s.forces_.read()); }
  static void act(CompiledScene& s, Active<S>* e) { s.forces_.act(*e); }
  static void act_and_look(CompiledScene& s, Active<S>* e) { s.forces_.act_and_look(*e); }
  static void act_and_count(CompiledScene& s, Active<S>* e) { s.powers_[e->worker] = s.forces_.act_and_count(*e); }
  static void act_and_keep(CompiledScene& s, Active<S>* e) { s.forces_.act_and_keep(*e, s.rows_ + size_t(e->number) * s.nv_); }
  static void prescribe(CompiledScene& s, Active<S>* e) { s.forces_.prescribe(*e, s.forces_.at().t, nullptr, nullptr, s.motion_.data()); }
  static void accelerate(CompiledScene& s, Active<S>*) { s.finite_ = s.solver_->run(s.forces_.at().q, s.v_, s.u_, s.wrenches_, s.vdot_); }
  static void accelerate_on_loops(CompiledScene& s, Active<S>*) {
    s.loops_->accelerate(s.forces_.at().t, s.forces_.at().q, s.v_, s.u_, {cast<S>(s.gravity_), s.wrenches_}, s.motion_.data(), s.needed_.data(), s.vdot_);
    s.finite_ = std::all_of(s.vdot_, s.vdot_ + s.nv_, [](const S& x) { return std::isfinite(to_double(x)); });
  }
  static void accelerate_and_prescribe(CompiledScene& s, Active<S>*) {
    s.give_prescribed();
    s.finite_ = s.solver_->run(s.forces_.at().q, s.v_, s.u_, s.wrenches_, s.vdot_);
    s.take_prescribed();
  }
  void give_prescribed();  // accelerations to the solver, and forces from it
  void take_prescribed();
  static void count_prescribed(CompiledScene& s, Active<S>* e);

  Scene scene_;  // as it was
  Solving how_;
  int nv_;
  SceneForces<S> forces_;
  std::vector<int> prescribed_;
  Vector3<double> gravity_{0, 0, 0};
  std::vector<std::vector<Pass>> lists_;
  std::vector<size_t> solving_;  // where accelerations are in each list
  std::unique_ptr<HybridDynamics<S>> solver_;
  std::unique_ptr<SceneLoops<S>> loops_;  // null: no effect keeps any
  std::unique_ptr<RigidDynamics<S>> whole_model_;  // made where it is first needed
  struct Impulsive {
    Active<S>* effect;
    std::unique_ptr<HybridDynamics<S>> solver;  // of ℳ + J + C
  };
  std::vector<Impulsive> impulsive_;
  std::unique_ptr<HybridDynamics<S>> jumping_;  // of ℳ + J; null: no prescribed velocity jumps
  // ---- of the state that is being worked at
  const S *v_ = nullptr, *u_ = nullptr;  // u: what the solver is given; null, as wrenches, where no effect gives any
  const Vector6<S>* wrenches_ = nullptr;
  S *vdot_ = nullptr, *powers_ = nullptr, *rows_ = nullptr;
  bool finite_ = true;
  SceneList list_ = SceneList::motion;
  S step_ = S(0);
  std::vector<S> motion_, needed_, inertia_, zeros_, work_, change_;  // of prescribed coordinates: θ̈, and the forces that they need; J; a model's forces; Δv
};

#define PYCRAFT_EXTERN(S) extern template class CompiledScene<S>;
PYCRAFT_FOR_EACH_SCENE_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
