#include "recursions/loop_pairs.h"

#include <algorithm>

#include "model/recorded_model.h"
#include "model/unit_data.h"
#include "recursions/carried.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
void insert_motion(const CompiledModel<S>& model, const S* q, const InsertedMotion<S>& inserted, RelativeMotion<S>& m, HingeRows<S>& hinge) {
  const int k = inserted.body, first = model.first_subhinge[k];
  const S* at = q + model.q_offset[k];
  Pose<S> later = Pose<S>::identity();
  int before = 0;
  for (int i = first; i < model.first_subhinge[k + 1]; ++i) {
    const CompiledSubhinge<S>& h = model.subhinges[i];
    if (i - first >= inserted.position) later = later * subhinge_step(h, at);
    else before += record_of(h.kind).nv;
    at += record_of(h.kind).nq;
  }
  const Vector6<S> xi = motion_to_child(later, inserted.twist);
  for (int j = 0; j < before; ++j) hinge.rows[j] = hinge.rows[j] - cross_motion(xi, hinge.rows[j]);
  Matrix3<S> turned = m.X.R;
  for (int i = 0; i < 3; ++i) {
    const Vector3<S> turning = cross(row_of(m.X.R, i), xi.angular);
    for (int j = 0; j < 3; ++j) turned(i, j) += turning[j];
  }
  m.X.p = m.X.p + m.X.R * xi.linear, m.X.R = turned;
}

// The motion of a step. hinge: for its rows.
template <class S>
RelativeMotion<S> loop_step(const CompiledModel<S>& model, const FrameStep& step, const S* q, const S* v, MotionPart part, HingeRows<S>& hinge,
                            const LoopBuffers<S>& w) {
  if (step.pose) return {renormalised<S>(*step.pose)};
  RelativeMotion<S> m;
  hinge_pose(model, step.number, q, m, hinge);
  for (const InsertedMotion<S>& inserted : w.inserted)
    if (inserted.body == step.number) insert_motion(model, q, inserted, m, hinge);
  if (part == MotionPart::pose) return m;
  const S* const own = v + model.v_offset[step.number];
  hinge_velocity(model, step.number, own, m, hinge);
  if (part == MotionPart::acceleration) hinge_acceleration(own, w.at_rest.data(), m, hinge);
  return m;
}

template <class S>
void find_rows_at(const ResolvedLoop& loop, const RelativeMotion<S>& m, LoopBuffers<S>& w) {
  std::fill_n(w.rows, loop.rows, PairRow<S>());
  pair_rows(loop.loop->pair, m, w.rows);
}

}  // namespace

template <class S>
RelativeMotion<S> find_rows(const CompiledModel<S>& model, const ResolvedLoop& loop, const S* q, const S* v, MotionPart part, LoopBuffers<S>& w) {
  const auto m = along<S>(loop.path, part, [&](const FrameStep& step) { return loop_step(model, step, q, v, part, w.hinge, w); });
  find_rows_at(loop, m, w);
  return m;
}

template <class S>
Pose<S> find_rows_and_columns(const CompiledModel<S>& model, const ResolvedLoop& loop, const S* q, LoopBuffers<S>& w) {
  const S* const no_velocities = nullptr;
  w.columns.clear();
  const auto m = jacobian_along(
      model, loop.path, false, w.hinge,
      [&](const FrameStep& step, HingeRows<S>& hinge) { return loop_step(model, step, q, no_velocities, MotionPart::pose, hinge, w); },
      [&](int i, const Vector6<S>& J, const Vector6<S>&) { w.columns.emplace_back(i, J); });
  find_rows_at(loop, m, w);
  return m.X;
}

void refuse_on_tape(const ResolvedLoops& loops) {
  for (const ResolvedLoop& one : loops.loops) {
    const Loop& loop = *one.loop;
    const char* const why = loop.coupling.function ? "it is a function of Python's"
                            : loop.is_coupling() ? nullptr
                            : loop.pair.kind == PairKind::screw ? "a screw counts its turns"
                            : loop.pair.kind == PairKind::custom ? "the nearest place of its hinge is sought"
                            : loop.pair.kind == PairKind::curve ? "the nearest place of its curve is sought"
                                                                : nullptr;
    if (why) throw ModelError("loop '" + loop.name + "' cannot be compiled: " + why + "; the call itself, and expressions at(q), keep it");
  }
}

#define PYCRAFT_LOOP_PAIRS(S)                                                                                                                      \
  template RelativeMotion<S> find_rows(const CompiledModel<S>&, const ResolvedLoop&, const S*, const S*, MotionPart, LoopBuffers<S>&);             \
  template Pose<S> find_rows_and_columns(const CompiledModel<S>&, const ResolvedLoop&, const S*, LoopBuffers<S>&);
PYCRAFT_FOR_EACH_CARRIED(PYCRAFT_LOOP_PAIRS)
PYCRAFT_FOR_EACH_RECORDED(PYCRAFT_LOOP_PAIRS)

}  // namespace pycraft
