#include "simulation/effects/nose_hoover.h"

#include <algorithm>
#include <optional>

#include "recursions/momenta.h"
#include "runtime/errors.h"
#include "simulation/effects/model_with_rotors.h"

namespace pycraft {

namespace {

template <class S>
class BoundNoseHoover : public BoundEffect<S> {
 public:
  explicit BoundNoseHoover(const NoseHoover& of) : of_(of), chain_(of.chain), kT_(of.kT), slow_(S(of.time_constant) * S(of.time_constant)), p_(of.model.nv()) {}
  void begin(const HingeTerms& terms) override {
    for (const int j : of_.coordinates)
      if (!terms.is_prescribed(j)) coordinates_.push_back(j);
    if (coordinates_.empty()) throw ModelError("nose_hoover: there is no coordinate of '" + of_.model.name() + "' for it that moves freely");
    n_ = S(static_cast<double>(coordinates_.size()));
    numbers_ = model_with_rotors<S>(of_.model, terms);
    momenta_.emplace(*numbers_);
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    momenta_->momentum(at.q, at.v, numbers_->rotor_inertia.data(), p_.data());
    twice_ = S(0);
    for (const int j : coordinates_) out.generalized[j] -= at.own[0] * p_[j], twice_ += at.v[j] * p_[j];
  }
  // After forces() at the same state.
  void rates(const At<S>& at, S* out) override {
    const S* const xi = at.own;
    for (int i = 0; i < chain_; ++i) {
      const S driven = i == 0 ? twice_ / (n_ * kT_ * slow_) : (i == 1 ? n_ : S(1)) * xi[i - 1] * xi[i - 1];
      out[i] = driven - S(1) / slow_ - (i + 1 < chain_ ? S(xi[i] * xi[i + 1]) : S(0));
      out[chain_ + i] = xi[i];
    }
  }
  S potential(const At<S>& at) override {
    const S *const xi = at.own, *const eta = xi + chain_;
    S sum = S(0);
    for (int i = 0; i < chain_; ++i) sum += (i == 0 ? n_ : S(1)) * (slow_ * xi[i] * xi[i] / S(2) + eta[i]);
    return kT_ * sum;
  }

 private:
  const NoseHoover& of_;
  std::vector<int> coordinates_;
  int chain_;
  S kT_, slow_, n_ = S(0), twice_ = S(0);  // slow: τ²; twice: Σ v p of the state
  std::vector<S> p_;
  std::shared_ptr<const CompiledModel<S>> numbers_;
  std::optional<Momenta<S>> momenta_;
};

}  // namespace

NoseHoover::NoseHoover(const Multibody& of, const Names& hinges, double energy, double slow, int links)
    : model(of), coordinates(coordinates_named(of, hinges, "nose_hoover")), kT(energy), time_constant(slow), chain(links) {}

Declaration NoseHoover::declaration() const {
  Declaration d;
  d.velocities = d.only_in_motion = d.potential = d.of_trees = true;
  d.coordinates = coordinates;
  d.states.assign(2 * static_cast<size_t>(chain), 0.0);
  return d;
}

PYCRAFT_BIND_EFFECT(NoseHoover, BoundNoseHoover)

}  // namespace pycraft
