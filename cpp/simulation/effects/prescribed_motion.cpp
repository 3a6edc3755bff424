#include "simulation/effects/prescribed_motion.h"

#include <algorithm>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundPrescribedMotion : public BoundEffect<S> {
 public:
  explicit BoundPrescribedMotion(const PrescribedMotion& of) : parts_(of.parts), motion_(of.motion), value_(motion_->size()), rate_(value_.size()), second_(value_.size()) {}

  bool prescribe(const S& t, S* q, S* v, S* vdot) override {
    values_at(*motion_, t, value_.data(), rate_.data(), second_.data());
    S odd = S(0);
    for (size_t i = 0; i < value_.size(); ++i) odd += (value_[i] - value_[i]) + (rate_[i] - rate_[i]) + (second_[i] - second_[i]);
    if (!(odd == S(0))) return false;
    const S *x = value_.data(), *y = rate_.data(), *z = second_.data();
    for (const PrescribedMotion::Part& part : parts_) {  // a quaternion of length 0 has no direction
      const SubhingeRecord& record = record_of(part.kind);
      if (record.quaternion >= 0 && !(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3] > S(0))) return false;
      x += record.nq;
    }
    x = value_.data();
    for (const PrescribedMotion::Part& part : parts_) {
      const SubhingeRecord& record = record_of(part.kind);
      if (q) std::copy_n(x, record.nq, q + part.q);
      if (record.quaternion < 0) {
        if (v) v[part.v] = *y;
        if (vdot) vdot[part.v] = *z;
      } else {
        turn(part.kind == SubhingeKind::free, x, y, z, v ? v + part.v : nullptr, vdot ? vdot + part.v : nullptr);
      }
      x += record.nq, y += record.nq, z += record.nq;
    }
    return true;
  }

 private:
  static Vector3<S> vector_part(const S* q, const S* r) {  // of Q* R
    const Quaternion<S> product = Quaternion<S>{q[0], -q[1], -q[2], -q[3]} * Quaternion<S>{r[0], r[1], r[2], r[3]};
    return {product.x, product.y, product.z};
  }
  static void turn(bool free, const S* x, const S* y, const S* z, S* v, S* vdot) {
    S square = S(0), along = S(0);
    for (int i = 0; i < 4; ++i) square += x[i] * x[i], along += x[i] * y[i];
    const S k = S(2) / square;
    const Vector3<S> omega = k * vector_part(x, y), spin = k * vector_part(x, z) - (k * along) * omega;
    if (v) std::copy_n(omega.v, 3, v);
    if (vdot) std::copy_n(spin.v, 3, vdot);
    if (!free) return;
    const Matrix3<S> R = quaternion_rotation(Quaternion<S>{x[0], x[1], x[2], x[3]});
    const Vector3<S> u = transpose_times(R, Vector3<S>{y[4], y[5], y[6]}), rate = transpose_times(R, Vector3<S>{z[4], z[5], z[6]}) - cross(omega, u);
    if (v) std::copy_n(u.v, 3, v + 3);
    if (vdot) std::copy_n(rate.v, 3, vdot + 3);
  }
  std::vector<PrescribedMotion::Part> parts_;
  TimeFunction motion_;
  std::vector<S> value_, rate_, second_;
};

}  // namespace

PrescribedMotion::PrescribedMotion(const Multibody& model, const Names& hinges, TimeFunction given)
    : motion(std::move(given)), coordinates_(coordinates_named(model, hinges, "prescribed")) {
  const std::vector<std::string> names = model.structure().coordinate_names;
  if (coordinates_.empty()) throw ModelError("prescribed: the hinges named have no coordinates to prescribe");
  int numbers = 0;
  for (size_t i = 0; i < coordinates_.size();) {
    const SubhingePlace at = subhinge_of_coordinate(model, coordinates_[i]);
    const SubhingeRecord& record = record_of(at.kind);
    for (int k = 0; k < record.nv; ++k)
      if (i + k >= coordinates_.size() || coordinates_[i + k] != at.v + k)
        throw ModelError("prescribed: coordinate '" + names[coordinates_[i]] + "' is one of " + std::to_string(record.nv) + " of a " + record.name +
                         " subhinge, which are prescribed together: name the hinge");
    parts.push_back({at.kind, at.q, at.v});
    numbers += record.nq, i += record.nv;
  }
  if (motion->size() != numbers)
    throw ModelError("prescribed: the motion gives " + std::to_string(motion->size()) + " numbers; " + (numbers == 1 ? "coordinate" : "the coordinates from") + " '" +
                     names[coordinates_[0]] + "'" + (numbers == 1 ? " takes one" : " on take " + std::to_string(numbers) + ", as they have in q"));
  for (const Knot& knot : motion->knots())
    if (knot.values_jump)
      throw ModelError("prescribed: the motion of coordinate '" + names[coordinates_[0]] + "'" + (numbers == 1 ? "" : " and others") + " jumps at t = " + short_number(knot.t) +
                       " s, which no body can; velocities may jump, by an impulse: lead it from place to place (pc.effects.Table, Spline)");
}

Declaration PrescribedMotion::declaration() const {
  Declaration d;
  d.time = !motion->constant(), d.foreign = motion->foreign(), d.knots = motion->knots();
  d.prescribed = coordinates_;
  d.work = true;
  return d;
}

PYCRAFT_BIND_EFFECT(PrescribedMotion, BoundPrescribedMotion)

}  // namespace pycraft
