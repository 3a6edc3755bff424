// A model's state: coordinates and velocities as a whole, checked, moved and compared.
#include <algorithm>
#include <mutex>

#include "model/checks.h"
#include "model/compiled_model.h"
#include "model/configuration.h"
#include "model/multibody.h"
#include "numerics/finite.h"
#include "runtime/errors.h"

namespace pycraft {

std::shared_ptr<const StateData> Multibody::state() const {
  settled();
  if (part_) return state_of_part();
  std::lock_guard<Mutex> lock(mutex_);
  return state_;
}

void Multibody::check_q(const double* q, size_t size) const {
  if (static_cast<int>(size) != nq())
    throw ModelError("q of '" + name_ + "' takes " + std::to_string(nq()) + " numbers (" + std::to_string(bodies()) + " hinges), not " + std::to_string(size));
  const auto directed = [q](int at) { return q[at] * q[at] + q[at + 1] * q[at + 1] + q[at + 2] * q[at + 2] + q[at + 3] * q[at + 3] > 1e-12; };
  if (all_finite(q, size) && std::all_of(quaternions_.begin(), quaternions_.end(), directed)) return;  // the rule; else hinge by hinge
  for (int k = 0; k < bodies(); ++k)
    check_configuration(bodies_[k].hinge, q + q_offset_[k]);
}

void Multibody::check_v(const double* v, size_t size, const char* what) const {
  if (static_cast<int>(size) != nv())
    throw ModelError(std::string(what) + " of '" + name_ + "' takes " + std::to_string(nv()) + " numbers, not " + std::to_string(size));
  if (all_finite(v, size)) return;
  for (int k = 0; k < bodies(); ++k)
    check_rates(bodies_[k].hinge, v + v_offset_[k], what);
}

void Multibody::set_q(const std::vector<double>& q) {
  check_q(q.data(), q.size());
  if (part_) return set_in_whole(q, true);
  auto next = std::make_shared<StateData>();
  next->q = q;
  std::lock_guard<Mutex> lock(mutex_);
  next->v = state_->v;
  state_ = next;
}
void Multibody::set_v(const std::vector<double>& v) {
  check_v(v.data(), v.size(), "v");
  if (part_) return set_in_whole(v, false);
  auto next = std::make_shared<StateData>();
  next->v = v;
  std::lock_guard<Mutex> lock(mutex_);
  next->q = state_->q;
  state_ = next;
}

std::vector<double> Multibody::zero_q() const {
  settled();
  std::vector<double> q;
  for (const Body& b : bodies_) append_zero(b.hinge, q);
  return q;
}

void Multibody::integrate(const double* q, const double* dv, double* out) const {
  const auto model = compiled<double>();
  // A product of quaternions keeps the length up to rounding; over many steps that would walk, so it is set to what it was.
  std::vector<double> lengths(model->subhinges.size());
  quaternion_lengths(*model, q, lengths.data());
  move_configuration(*model, q, dv, out);
  scale_quaternions<double>(*model, lengths.data(), out);
}

void Multibody::difference(const double* q0, const double* q1, double* out) const { configuration_difference(*compiled<double>(), q0, q1, out); }

}  // namespace pycraft
