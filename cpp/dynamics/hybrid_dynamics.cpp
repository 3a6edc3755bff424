#include "dynamics/hybrid_dynamics.h"

#include <algorithm>
#include <cmath>

#include "dynamics/link_dynamics.h"
#include "dynamics/states_together.h"
#include "numerics/finite.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

int prescribed_in(const HingeTerms& terms) { return static_cast<int>(std::count_if(terms.prescribed.begin(), terms.prescribed.end(), [](char p) { return p != 0; })); }
bool all_prescribed(const Multibody& model, const HingeTerms& terms) { return model.nv() > 0 && prescribed_in(terms) == model.nv(); }

HingeTerms without_prescribed(HingeTerms terms) {
  terms.prescribed.clear();
  return terms;
}

}  // namespace

PreparedLinks::PreparedLinks(const Multibody& model, const HingeTerms& terms, const Solving& how, const Vector3<double>& gravity, const std::vector<int>& wrenched)
    : of_(model), terms_(terms), model_(kernels::LinkModel<double>::of(model, terms)), nv_(model.nv()), wrenched_(wrenched) {
  using kernels::Call;
  const bool inverse = all_prescribed(model, terms);  // nothing is solved for: in any form
  const bool regular = how.on_singular == OnSingular::raise && !how.refinement.wider();
  const Call solving = forward_dynamics_call(how.form, how.refinement);
  if (!model_ || !(inverse || (regular && (solving == Call::forward_dynamics || !terms.prescribes())))) return;
  const Call call = inverse ? Call::inverse_dynamics : solving;
  kernel_ = kernels::instruction_set().one[call], call_ = call;
  if (!kernel_.run) return;
  if (call >= Call::forward_dynamics_ud) model_->find_factors();
  std::copy_n(gravity.v, 3, gravity_);
  work_.reset(static_cast<double*>(::operator new((kernel_.work(model_->links(), 0) + 8) * sizeof(double), std::align_val_t(64))));
  if (call != Call::forward_dynamics) no_forces_.assign(nv_, 0.0);  // they do not ask whether there are any
  if (!wrenched_.empty()) on_links_.assign(size_t(6) * model_->links().count, 0.0);
  states_.states = 1;
  states_.gravity = gravity_;
  states_.wrenches = wrenched_.empty() ? nullptr : on_links_.data();
  states_.interrupt = check_interrupt;
  states_.steps = how.refinement.steps == Refinement::automatic ? most_corrections : how.refinement.steps;
}

void PreparedLinks::carry(const Vector6<double>* wrenches) {
  for (int k : wrenched_)
    if (const int link = model_->link_carrying(k); link >= 0) std::fill_n(on_links_.data() + size_t(6) * link, 6, 0.0);
  for (int k : wrenched_) {
    const int link = model_->link_carrying(k);
    if (link < 0) continue;
    const Vector6<double> moved = model_->on_its_link(k, wrenches[k]);
    for (int i = 0; i < 6; ++i) on_links_[size_t(6) * link + i] += moved[i];
  }
}

void PreparedLinks::add_to_hinges(const double* inertia) {
  added_.assign(inertia, inertia + nv_);
  model_->add_to_hinges(inertia);
}

void PreparedLinks::ask(const double* q, const double* v, const double* u, const Vector6<double>* wrenches, double* out) {
  states_.q = q, states_.v = v, out_ = out;
  states_.u = u || no_forces_.empty() ? u : no_forces_.data();
  if (!wrenched_.empty()) carry(wrenches);
}

bool PreparedLinks::answer() { return (kernel_.run(model_->links(), states_, out_, nv_, work_.get()) & 1) && all_finite(out_, nv_); }

bool PreparedLinks::fits(const PreparedLinks& other) const {
  return &of_ == &other.of_ && call_ == other.call_ && states_.steps == other.states_.steps && !states_.v == !other.states_.v && !states_.u == !other.states_.u &&
         !states_.wrenches == !other.states_.wrenches && terms_.inertia == other.terms_.inertia && terms_.driven == other.terms_.driven && terms_.prescribed == other.terms_.prescribed &&
         added_ == other.added_ && (call_ == kernels::Call::forward_dynamics || std::equal(gravity_, gravity_ + 3, other.gravity_));
}

std::string PreparedLinks::alone() const {
  if (!kernels::instruction_set().pack[call_].run) return "there is no kernel for packs of states";
  if (call_ != kernels::Call::forward_dynamics && states_.wrenches) return "effects push bodies, and in another form than 'fast', refined, or with all coordinates prescribed packs have one wrench for all states";
  return {};
}

template <class S>
HybridDynamics<S>::HybridDynamics(const Multibody& model, const HingeTerms& terms, const Solving& how, const Vector3<double>& gravity, const std::vector<int>& wrenched)
    : model_(model), terms_(terms), how_(how), applied_{cast<S>(gravity)}, wrenched_(wrenched) {
  given_ = !terms.prescribes() ? Given::forces : all_prescribed(model, terms) ? Given::accelerations : Given::both;
  if constexpr (std::is_same_v<S, double>) {
    links_ = std::make_unique<PreparedLinks>(model, terms, how, gravity, wrenched);
    if (!links_->there()) links_.reset();
  }
  for (int j = 0; j < model.nv(); ++j)
    if (!terms.is_prescribed(j)) free_.push_back(j);
  none_.assign(model.nv(), S(0)), forces_.resize(free_.size()), results_.resize(free_.size());
  if (!wrenched_.empty()) all_wrenches_.assign(model.bodies(), Vector6<S>::zero());
}

template <class S>
bool HybridDynamics<S>::run(const S* q, const S* v, const S* u, const Vector6<S>* wrenches, S* out) {
  if constexpr (std::is_same_v<S, double>)
    if (links_ && (others_ ? others_->run(*links_, q, v, u, wrenches, out) : links_->run(q, v, u, wrenches, out))) return true;
  return generally(q, v, u, wrenches, out);
}

template <class S>
void HybridDynamics<S>::add_to_hinges(const S* inertia) {
  added_.assign(inertia, inertia + model_.nv());
  if constexpr (std::is_same_v<S, double>)
    if (links_) links_->add_to_hinges(inertia);
  if (general_) general_->add_to_hinges(inertia);
}

template <class S>
bool HybridDynamics<S>::generally(const S* q, const S* v, const S* u, const Vector6<S>* wrenches, S* out) {
  if (!general_) {
    general_ = std::make_unique<RigidDynamics<S>>(model_, given_ == Given::accelerations ? without_prescribed(terms_) : terms_);
    if (!added_.empty()) general_->add_to_hinges(added_.data());
  }
  if (!v) v = none_.data();
  if (!u) u = none_.data();
  for (int k : wrenched_) all_wrenches_[k] = wrenches[k];
  applied_.wrenches = wrenched_.empty() ? nullptr : all_wrenches_.data();
  switch (given_) {
    case Given::forces: general_->forward_dynamics(q, v, u, out, how_, &applied_); break;
    case Given::accelerations: general_->inverse_dynamics(q, v, u, out, &applied_); break;
    case Given::both:
      for (size_t i = 0; i < free_.size(); ++i) forces_[i] = u[free_[i]];
      general_->prescribe(u);
      general_->forward_dynamics(q, v, forces_.data(), results_.data(), how_, &applied_);
      general_->give_all(results_.data(), out);
  }
  return std::all_of(out, out + model_.nv(), [](const S& x) { return std::isfinite(to_double(x)); });
}

template class HybridDynamics<double>;
template class HybridDynamics<Extended>;
template class HybridDynamics<Quad>;

}  // namespace pycraft
