// From a hinge's coordinates to its pose and the rows of H, for any sequence of subhinges.
//
//   X_PB = placement · step_1 · step_2 · ...;  row j of H is subhinge j's axis carried outboard: h_j' = φ*(later steps) h_j
//
// Cost: one pose product per subhinge; rows are carried only past the subhinges that follow.
#pragma once

#include "model/compiled_model.h"
#include "spatial/pose.h"

namespace pycraft {

template <class S>
inline Pose<S> subhinge_step(const CompiledSubhinge<S>& h, const S* q) {
  return with_subhinge(h.kind, [&](auto row) { return row.step(h, q); });
}

// Pose of body k in its parent, and its rows of H (one Vector6 per coordinate).
template <class S>
inline Pose<S> hinge_kinematics(const CompiledModel<S>& model, int k, const S* q, Vector6<S>* rows) {
  Pose<S> X = model.placement[k];
  const S* qk = q + model.q_offset[k];
  int made = 0;
  for (int i = model.first_subhinge[k]; i < model.first_subhinge[k + 1]; ++i) {
    const CompiledSubhinge<S>& h = model.subhinges[i];
    with_subhinge(h.kind, [&](auto row) {
      const Pose<S> step = row.step(h, qk);
      for (int j = 0; j < made; ++j) rows[j] = motion_to_child(step, rows[j]);
      row.rows(h, rows + made);
      made += row.nv, qk += row.nq;
      X = X * step;
    });
  }
  return X;
}

// Ḣ: row j times crf of the relative velocity of the subhinges after j. rows: H at this state; v: this hinge's velocities.
template <class S>
inline void hinge_map_rate(const CompiledModel<S>& model, int k, const Vector6<S>* rows, const S* v, Vector6<S>* rates) {
  Vector6<S> later = Vector6<S>::zero();
  int j = model.nv_of[k];
  for (int i = model.first_subhinge[k + 1] - 1; i >= model.first_subhinge[k]; --i) {
    const int n = record_of(model.subhinges[i].kind).nv;
    j -= n;
    // (h* crf(u))* = crf(u)* h = -crm(u) h
    for (int a = j; a < j + n; ++a) rates[a] = S(-1) * cross_motion(later, rows[a]);
    for (int a = j; a < j + n; ++a) later = later + v[a] * rows[a];
  }
}

}  // namespace pycraft
