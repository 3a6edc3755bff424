#include "simulation/compiled_scene.h"

#include <algorithm>
#include <cmath>

#include "model/rotor_forces.h"
#include "numerics/finite.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

std::string plural(size_t n, const char* one, const char* several) { return std::to_string(n) + " " + (n == 1 ? one : several); }

template <class S>
bool all_are_finite(const S* x, int n) {
  return std::all_of(x, x + n, [](const S& y) { return std::isfinite(to_double(y)); });
}

// c(v) of the rotors that an effect brings (model/rotor_forces.h).
template <class S>
void subtract_rotor_forces(const CompiledModel<S>& model, const std::vector<HingeTerm>& terms, const S* v, S* row) {
  if (std::all_of(terms.begin(), terms.end(), [](const HingeTerm& h) { return h.inertia == 0; })) return;
  std::vector<S> J(model.nv, S(0)), c(model.nv, S(0));
  for (const HingeTerm& h : terms) J[h.coordinate] += S(h.inertia);
  for (int k = 0; k < model.bodies; ++k) rotor_forces(model, k, J.data(), v, c.data());
  for (int j = 0; j < model.nv; ++j) row[j] -= c[j];
}

}  // namespace

template <class S>
CompiledScene<S>::CompiledScene(const Scene& scene, const Solving& how)
    : scene_(scene), how_(how), nv_(scene.model().nv()), forces_(scene_, scene.model().compiled<S>()), lists_(5), solving_(5), motion_(nv_), needed_(nv_), inertia_(nv_, S(0)), zeros_(nv_, S(0)), work_(nv_), change_(nv_) {
  for (const auto& e : forces_.effects()) {
    if (e->declared.uniform_gravity) gravity_ = gravity_ + e->declared.gravity;
    prescribed_.insert(prescribed_.end(), e->declared.prescribed.begin(), e->declared.prescribed.end());
  }
  if (forces_.forced() || !prescribed_.empty()) u_ = forces_.tau();
  if (!forces_.wrenched().empty()) wrenches_ = forces_.wrenches();
  solver_ = std::make_unique<HybridDynamics<S>>(scene.model(), hinge_terms(scene), how, gravity_, forces_.wrenched());
  if (std::any_of(forces_.effects().begin(), forces_.effects().end(), [](const auto& e) { return e->declared.loops != nullptr; }))
    loops_ = std::make_unique<SceneLoops<S>>(scene.model(), hinge_terms(scene), how, forces_.effects());
  for (const auto& e : forces_.effects()) {
    if (!(e->declared.impulse_period > 0) || nv_ == 0) continue;
    HingeTerms terms = hinge_terms(scene);
    terms.inertia.resize(nv_, 0.0), terms.driven.resize(nv_, 0);
    for (const HingeTerm& h : e->declared.resists) terms.inertia[h.coordinate] += h.damping;
    impulsive_.push_back({e.get(), std::make_unique<HybridDynamics<S>>(scene.model(), terms, how, Vector3<double>{0, 0, 0})});
  }
  if (!forces_.jumping().empty() && !loops_) jumping_ = std::make_unique<HybridDynamics<S>>(scene.model(), hinge_terms(scene), how, Vector3<double>{0, 0, 0});
  for (int list = 0; list < static_cast<int>(lists_.size()); ++list) plan(static_cast<SceneList>(list));
}

// ------------------------------------------------------------------ the lists

template <class S>
std::string CompiledScene<S>::described(const Active<S>& effect) const {
  const Declaration& d = effect.declared;
  std::string text;
  if (!d.coordinates.empty()) text = "forces on " + plural(d.coordinates.size(), "coordinate", "coordinates");
  if (!d.wrenches.empty()) text += (text.empty() ? "wrenches on " : ", wrenches on ") + plural(d.wrenches.size(), "body", "bodies");
  if (!d.prescribed.empty()) text += (text.empty() ? "accelerations of " : ", accelerations of ") + plural(d.prescribed.size(), "coordinate", "coordinates");
  return text;
}

template <class S>
void CompiledScene<S>::add_reach(std::vector<Pass>& passes, const Reach& reach, bool moving, bool works) {
  std::vector<std::string> readers, movers;
  for (const auto& e : forces_.effects()) {
    const bool of_work = works && e->declared.work && !e->declared.wrenches.empty();
    if (!e->declared.poses.empty() || !e->declared.twists.empty() || of_work) readers.push_back(e->name);
    if (!e->declared.twists.empty() || of_work) movers.push_back(e->name);
  }
  if (!reach.placed.empty()) passes.push_back({works ? place<true> : place<false>, nullptr, {"poses", plural(reach.placed.size(), "body", "bodies"), readers}});
  if (moving && !reach.moved.empty()) passes.push_back({works ? move<true> : move<false>, nullptr, {"twists", plural(reach.moved.size(), "body", "bodies"), movers}});
}

template <class S>
void CompiledScene<S>::add_accelerations(std::vector<Pass>& passes, bool works) {
  std::vector<std::string> because;
  for (const auto& e : forces_.effects())
    if (e->declared.uniform_gravity || !e->declared.hinges.empty() || !e->declared.prescribed.empty() || e->declared.loops) because.push_back(e->name);
  const bool hybrid = !prescribed_.empty(), all = hybrid && static_cast<int>(prescribed_.size()) == nv_;
  const std::string what = std::string(all ? "inverse" : hybrid ? "hybrid" : "forward") + " dynamics" + (loops_ ? loops_->embeds() ? " on embedded loops" : " on loops" : "") + ", " + (by_kernels() ? "by kernels" : "by recursions");
  passes.push_back({loops_ ? accelerate_on_loops : hybrid ? accelerate_and_prescribe : accelerate, nullptr, {"accelerations", what, because}});
  for (const auto& e : forces_.effects())
    if (works && e->worker >= 0 && !e->declared.prescribed.empty()) passes.push_back({count_prescribed, e.get(), {e->name + " work", "its power", {e->name}}});
}

template <class S>
void CompiledScene<S>::plan(SceneList list) {
  std::vector<Pass>& passes = lists_[static_cast<int>(list)];
  const bool works = list == SceneList::works, moving = list != SceneList::rest && list != SceneList::apart_at_rest;
  const bool apart = list == SceneList::apart || list == SceneList::apart_at_rest;
  add_reach(passes, works ? forces_.works() : forces_.read(), moving, works);
  for (const auto& e : forces_.effects()) {
    if (!e->acts() || (!moving && e->declared.only_in_motion)) continue;
    passes.push_back({apart ? act_and_keep : works && e->worker >= 0 ? act_and_count : e->declared.foreign ? act_and_look : act, e.get(), {e->name, described(*e), {e->name}}});
  }
  for (const auto& e : forces_.effects())
    if (!e->declared.prescribed.empty()) passes.push_back({prescribe, e.get(), {e->name, described(*e), {e->name}}});
  solving_[static_cast<int>(list)] = passes.size();
  add_accelerations(passes, works);
}

template <class S>
std::vector<PassRecord> CompiledScene<S>::passes(SceneList list) const {
  std::vector<PassRecord> records;
  for (const Pass& pass : lists_[static_cast<int>(list)]) records.push_back(pass.record);
  return records;
}

template <class S>
std::string CompiledScene<S>::alone() const {
  for (const auto& e : forces_.effects())
    if (e->declared.foreign) return "effect '" + e->name + "' is written in Python";
  if (loops_) return "accelerations on loops are found one by one";
  if constexpr (std::is_same_v<S, double>) return solver_->links() ? solver_->links()->alone() : "accelerations are found by the general recursions";
  return "packs are of states in double precision";
}

// ------------------------------------------------------------------ at a state

template <class S>
void CompiledScene<S>::start(SceneList list, const S& t, const S* q, const S* v, const S* own, S* vdot) {
  forces_.start(t, q, v, own);
  list_ = list, v_ = v, vdot_ = vdot;
}

template <class S>
bool CompiledScene<S>::finish() {
  if (!finite_ && all_are_finite(forces_.at().q, numbers().nq) && (!v_ || all_are_finite(v_, nv_))) forces_.look_for_culprits();
  return finite_;
}

template <class S>
PreparedLinks* CompiledScene<S>::ask(const S& t, const S* q, const S* v, const S* own, S* vdot, S* powers) {
  if (powers) powers_ = powers, std::fill_n(powers, forces_.workers().size(), S(0));
  start(powers ? SceneList::works : SceneList::motion, t, q, v, own, vdot);
  run(0, solving());
  give_prescribed();
  return solver_->ask(q, v_, u_, wrenches_, vdot_);
}

template <class S>
bool CompiledScene<S>::answer(bool sound) {
  std::vector<Pass>& passes = lists_[static_cast<int>(list_)];
  finite_ = solver_->answer(sound, forces_.at().q, v_, u_, wrenches_, vdot_);
  take_prescribed();
  ++passes[solving()].record.times;
  run(solving() + 1, passes.size());
  return finish();
}

template <class S>
bool CompiledScene<S>::accelerations_and_powers(const S& t, const S* q, const S* v, const S* own, S* vdot, S* powers) {
  powers_ = powers;
  std::fill_n(powers, forces_.workers().size(), S(0));  // of those whose work is by impulses alone
  return run(SceneList::works, t, q, v, own, vdot);
}

template <class S>
bool CompiledScene<S>::accelerations_and_forces(const S& t, const S* q, const S* v, const S* own, S* vdot, S* rows) {
  std::fill_n(rows, forces_.effects().size() * nv_, S(0));
  rows_ = rows;
  const bool finite = run(v ? SceneList::apart : SceneList::apart_at_rest, t, q, v, own, vdot);
  forces_.place(forces_.whole());
  for (const auto& e : forces_.effects())
    if (!e->declared.wrenches.empty() && (v || !e->declared.only_in_motion)) forces_.gather_kept(*e, rows + size_t(e->number) * nv_);
  add_structural_forces(q, vdot, rows);
  return finite;
}

// Of what is no force that was added: gravity, what hinge terms take, what prescribed motion needs.
template <class S>
void CompiledScene<S>::add_structural_forces(const S* q, const S* vdot, S* rows) {
  for (const auto& e : forces_.effects()) {
    const Declaration& d = e->declared;
    S* const row = rows + size_t(e->number) * nv_;
    if (d.uniform_gravity) {
      const Applied<S> field{cast<S>(d.gravity)};
      whole_model().inverse_dynamics(q, zeros_.data(), nullptr, work_.data(), &field);
      for (int j = 0; j < nv_; ++j) row[j] -= work_[j];
    }
    if (v_) subtract_rotor_forces(numbers(), d.hinges, v_, row);
    for (const HingeTerm& h : d.hinges) row[h.coordinate] -= (S(h.inertia) + step_ * (S(h.damping) + step_ * S(h.stiffness))) * vdot[h.coordinate];
    for (int j : d.prescribed) row[j] += needed_[j];
    if (d.loops) loops_->add_forces(e->number, row);
  }
}

template <class S>
void CompiledScene<S>::give_prescribed() {
  S* const u = forces_.tau();
  for (int j : prescribed_) needed_[j] = forces_.forced() ? u[j] : S(0), u[j] = motion_[j];
}
template <class S>
void CompiledScene<S>::take_prescribed() {
  for (int j : prescribed_) needed_[j] = vdot_[j] - needed_[j], vdot_[j] = motion_[j];
}

template <class S>
void CompiledScene<S>::count_prescribed(CompiledScene& s, Active<S>* e) {
  S power = e->acts() ? s.powers_[e->worker] : S(0);
  for (int j : e->declared.prescribed) power += s.needed_[j] * s.v_[j];
  s.powers_[e->worker] = power;
}

template <class S>
RigidDynamics<S>& CompiledScene<S>::whole_model() {
  if (!whole_model_) whole_model_ = std::make_unique<RigidDynamics<S>>(scene_.model());
  return *whole_model_;
}

template <class S>
void CompiledScene<S>::energies(const S& t, const S* q, const S* v, const S* own, S* kinetic, S* potential) {
  const S* const moving = v ? v : zeros_.data();
  forces_.start(t, q, v, own);
  forces_.place(forces_.read());
  if (v) forces_.move(forces_.read());
  *kinetic = whole_model().kinetic_energy(q, moving);
  for (const auto& e : forces_.effects()) {
    const Declaration& d = e->declared;
    for (const HingeTerm& h : d.hinges) *kinetic += S(h.inertia) * moving[h.coordinate] * moving[h.coordinate] / S(2);
    const Vector3<S> field = cast<S>(d.gravity);
    potential[e->number] = d.potential ? forces_.potential(*e) : S(0);
    if (d.uniform_gravity) potential[e->number] += whole_model().potential_energy(q, Vector3<S>::zero(), &field);
  }
}

template <class S>
bool CompiledScene<S>::steps_implicitly() const {
  return std::any_of(forces_.effects().begin(), forces_.effects().end(), [](const auto& e) {
    return std::any_of(e->declared.hinges.begin(), e->declared.hinges.end(), [](const HingeTerm& h) { return h.damping != 0 || h.stiffness != 0; });
  });
}

template <class S>
void CompiledScene<S>::set_step(const S& h) {
  if (h == step_) return;
  step_ = h;
  forces_.set_step(h);
  if (!steps_implicitly()) return;
  std::fill(inertia_.begin(), inertia_.end(), S(0));
  for (const auto& e : forces_.effects())
    for (const HingeTerm& term : e->declared.hinges) inertia_[term.coordinate] += h * (S(term.damping) + h * S(term.stiffness));
  solver_->add_to_hinges(inertia_.data());
  if (loops_) loops_->add_to_hinges(inertia_.data());
}

// The work of an impulse is that of what acted, p - C Δv, at the mean of the velocities before and after.
template <class S>
void CompiledScene<S>::give_impulses(const S& t, const S* q, S* v, const S* own, S* gained) {
  std::fill_n(gained, forces_.workers().size(), S(0));
  for (size_t place = 0; place < impulsive_.size(); ++place) {
    const Impulsive& each = impulsive_[place];
    const Active<S>& e = *each.effect;
    const double T = e.declared.impulse_period, before = std::round(to_double(t) / T - 0.5);
    if (!(std::abs(to_double(t) - (before + 0.5) * T) < 1e-9 * T)) continue;
    std::fill(work_.begin(), work_.end(), S(0));
    forces_.start(t, q, v, own);
    // No number is that of another effect: their noise is independent where their seeds are the same, too.
    forces_.impulses(*each.effect, static_cast<std::uint64_t>(static_cast<std::int64_t>(before)) ^ (static_cast<std::uint64_t>(place) << 54), work_.data());
    for (int j : prescribed_) work_[j] = S(0);
    each.solver->run(q, nullptr, work_.data(), nullptr, change_.data());
    for (const auto& other : forces_.effects())  // impulses that keep what is prescribed as it is
      for (int j : other->declared.prescribed) {
        if (other->worker >= 0) gained[other->worker] += change_[j] * v[j];
        change_[j] = S(0);
      }
    for (const HingeTerm& h : e.declared.resists) work_[h.coordinate] -= S(h.damping) * change_[h.coordinate];
    S energy = S(0);
    for (int j = 0; j < nv_; ++j) energy += work_[j] * (v[j] + change_[j] / S(2)), v[j] += change_[j];
    if (e.worker >= 0) gained[e.worker] += energy;
  }
}

template <class S>
void CompiledScene<S>::change_velocities(const S& t, const S* q, S* v, const S* wanted, S* gained) {
  std::fill_n(gained, forces_.workers().size(), S(0));
  std::fill(work_.begin(), work_.end(), S(0));
  for (int j : prescribed_) work_[j] = wanted[j] - v[j];
  if (loops_) {
    loops_->change_velocities(t, q, work_.data(), needed_.data(), change_.data());
  } else {
    jumping_->run(q, nullptr, work_.data(), nullptr, change_.data());
    for (int j : prescribed_) needed_[j] = change_[j], change_[j] = work_[j];
  }
  for (const auto& e : forces_.effects())
    for (int j : e->declared.prescribed)
      if (e->worker >= 0) gained[e->worker] += needed_[j] * (S(2) * v[j] + change_[j]) / S(2);
  for (int j = 0; j < nv_; ++j) v[j] += change_[j];
  for (int j : prescribed_) v[j] = wanted[j];
}

#define PYCRAFT_INSTANTIATE(S) template class CompiledScene<S>;
PYCRAFT_FOR_EACH_SCENE_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
