// From a hinge's coordinates to its pose and the rows of H, for any sequence of subhinges.
//
//   X_PB = placement · step_1 · step_2 · ...;  row j of H is subhinge j's axis carried outboard: h_j' = φ*(later steps) h_j
//
// Cost: one pose product per subhinge; rows are carried only past the subhinges that follow.
#pragma once

#include <cmath>

#include "model/compiled_model.h"
#include "spatial/pose.h"

namespace pycraft {

// exp(h q) of one pin, slider or screw, by its axis and point (not by the general exponential: exact for large angles too).
template <class S>
inline Pose<S> subhinge_step(const CompiledSubhinge<S>& h, const S* q) {
  switch (h.kind) {
    case SubhingeKind::pin:
    case SubhingeKind::screw: {
      const Matrix3<S> R = axis_rotation(h.axis, q[0]);
      Vector3<S> p = h.point - R * h.point;
      if (h.kind == SubhingeKind::screw) p = p + (h.pitch * q[0]) * h.axis;
      return {R, p};
    }
    case SubhingeKind::slider: return {Matrix3<S>::identity(), q[0] * h.axis};
    case SubhingeKind::ball: {
      const Matrix3<S> R = quaternion_rotation(Quaternion<S>{q[0], q[1], q[2], q[3]});
      return {R, h.point - R * h.point};
    }
    case SubhingeKind::free: return {quaternion_rotation(Quaternion<S>{q[0], q[1], q[2], q[3]}), {q[4], q[5], q[6]}};
  }
  return Pose<S>::identity();
}

// Pose of body k in its parent, and its rows of H (one Vector6 per coordinate).
template <class S>
inline Pose<S> hinge_kinematics(const CompiledModel<S>& model, int k, const S* q, Vector6<S>* rows) {
  Pose<S> X = model.placement[k];
  const S* qk = q + model.q_offset[k];
  int made = 0;
  for (int i = model.first_subhinge[k]; i < model.first_subhinge[k + 1]; ++i) {
    const CompiledSubhinge<S>& h = model.subhinges[i];
    const Pose<S> step = subhinge_step(h, qk);
    for (int j = 0; j < made; ++j) rows[j] = motion_to_child(step, rows[j]);
    switch (h.kind) {
      case SubhingeKind::ball:
        for (int j = 0; j < 3; ++j) {
          Vector3<S> e = Vector3<S>::zero();
          e[j] = S(1);
          rows[made++] = {e, cross(h.point, e)};
        }
        qk += 4;
        break;
      case SubhingeKind::free:
        for (int j = 0; j < 6; ++j) {
          Vector6<S> e = Vector6<S>::zero();
          e[j] = S(1);
          rows[made++] = e;
        }
        qk += 7;
        break;
      default:
        rows[made++] = h.twist;
        ++qk;
    }
    X = X * step;
  }
  return X;
}

// Ḣ: row j times crf of the relative velocity of the subhinges after j. rows: H at this state; v: this hinge's velocities.
template <class S>
inline void hinge_map_rate(const CompiledModel<S>& model, int k, const Vector6<S>* rows, const S* v, Vector6<S>* rates) {
  Vector6<S> later = Vector6<S>::zero();
  int j = model.nv_of[k];
  for (int i = model.first_subhinge[k + 1] - 1; i >= model.first_subhinge[k]; --i) {
    const int n = coordinates(model.subhinges[i].kind);
    j -= n;
    // (h* crf(u))* = crf(u)* h = -crm(u) h
    for (int a = j; a < j + n; ++a) rates[a] = S(-1) * cross_motion(later, rows[a]);
    for (int a = j; a < j + n; ++a) later = later + v[a] * rows[a];
  }
}

}  // namespace pycraft
