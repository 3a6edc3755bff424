#include "dynamics/frame_calls.h"

#include <algorithm>
#include <type_traits>

#include "model/unit_data.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

using enum FrameStep::Kind;

// The states' numbers in the workspace's scalar: q, and v and vdot where they are given.
template <class S>
void read(FrameWorkspace<S>& w, Givens given, int b) {
  const S** const to[] = {&w.q, &w.v, &w.vdot};
  for (size_t i = 0; i < given.size(); ++i) {
    const double* const from = given[i].at(b);
    if constexpr (std::is_same_v<S, double>) {
      *to[i] = from;
    } else {
      w.numbers[i].assign(from, from + given[i].width);
      *to[i] = w.numbers[i].data();
    }
  }
}

// The motion of one step in a state that was read, with the rows of a hinge in `hinge`.
template <class S>
RelativeMotion<S> step_motion(FrameWorkspace<S>& w, const FrameTree& frames, const FrameTimes& times, int b, const FrameStep& step, MotionPart part,
                              HingeRows<S>& hinge) {
  if (step.kind == fixed) return {renormalised<S>(*step.pose)};
  if (step.kind == moved) return motion_of<S>(frames.loose(step.number), times.at(step.number, b), part);
  const CompiledModel<S>& model = *w.model;
  const int at = model.v_offset[step.number];
  RelativeMotion<S> m;
  hinge_pose(model, step.number, w.q, m, hinge);
  if (part >= MotionPart::velocity) hinge_velocity(model, step.number, w.v + at, m, hinge);
  if (part == MotionPart::acceleration) hinge_acceleration(w.v + at, w.vdot + at, m, hinge);
  return m;
}

template <class S>
void write(const Vector6<S>& V, double* out, int stride = 1) {
  for (int i = 0; i < 6; ++i) out[i * stride] = to_double(V[i]);
}

// f(workspace, state) at the precision, with the states checked and the errors naming theirs.
template <class F>
void each_state(FrameCalls& calls, Givens given, Precision precision, int states, F f) {
  check_given(calls.model(), given);
  at_precision(precision, [&]<class S>(S) {
    if constexpr (!available_at<FrameWorkspace, S>)
      throw EvaluationError(to_quad);
    else
      calls.each<S>(0, states, states, [&](FrameWorkspace<S>& w, int b) {
        read(w, given, b);
        f(w, b);
      });
  });
}

}  // namespace

FrameTimes FrameCalls::times(const FrameQuestion& asked, std::vector<double> t) const {
  const FrameTree::InUse use(*frames_);
  FrameTimes times{std::move(t), {}};
  const auto see = [&](const FramePath& path) {
    for (const auto* steps : {&path.up, &path.down})
      for (const FrameStep& step : *steps) {
        if (step.kind != moved || times.motions.count(step.number)) continue;
        std::vector<FrameMotion> all;
        for (const double at : times.t) all.push_back(frames_->loose(step.number).motion(at));
        times.motions[step.number] = std::move(all);
      }
  };
  see(frames_->path(asked.frame, asked.other));
  if (asked.axes == MotionAxes::other) see(frames_->path(asked.frame, asked.third));
  return times;
}

void FrameCalls::motion(const FrameQuestion& asked, MotionPart part, bool classical, Givens given, const FrameTimes& times, Precision precision, int states,
                        double* out) {
  const FrameTree::InUse use(*frames_);
  const FramePath path = frames_->path(asked.frame, asked.other), aside = asked.axes == MotionAxes::other ? frames_->path(asked.frame, asked.third) : FramePath{};
  const int size = part == MotionPart::pose ? 16 : 6;
  each_state(*this, given, precision, states, [&]<class S>(FrameWorkspace<S>& w, int b) {
    const auto motions = [&](MotionPart of) { return [&, of](const FrameStep& step) { return step_motion(w, *frames_, times, b, step, of, w.hinge); }; };
    const RelativeMotion<S> m = along<S>(path, part, motions(part));
    double* const to = out + size_t(b) * size;
    if (part == MotionPart::pose) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) to[4 * i + j] = to_double(m.X.R(i, j));
        to[4 * i + 3] = to_double(m.X.p[i]);
        to[12 + i] = 0;
      }
      to[15] = 1;
    } else {
      const Matrix3<S> R = along<S>(aside, MotionPart::pose, motions(MotionPart::pose)).X.R;
      write(part == MotionPart::velocity ? in_axes(asked.axes, m, R, m.V) : acceleration_in_axes(asked.axes, m, R, classical), to);
    }
    require_finite(to, size, model());
  });
}

void FrameCalls::jacobian(const FrameQuestion& asked, const std::vector<int>* coordinates, bool rates, Givens given, const FrameTimes& times,
                          Precision precision, int states, double* out) {
  const FrameTree::InUse use(*frames_);
  const FramePath path = frames_->path(asked.frame, asked.other), aside = asked.axes == MotionAxes::other ? frames_->path(asked.frame, asked.third) : FramePath{};
  const int columns = coordinates ? static_cast<int>(coordinates->size()) : model().nv(), size = 6 * columns;
  std::unordered_map<int, int> column_of;
  if (coordinates)
    for (int c = 0; c < columns; ++c) column_of[(*coordinates)[c]] = c;
  const MotionPart part = rates ? MotionPart::velocity : MotionPart::pose;
  each_state(*this, given, precision, states, [&]<class S>(FrameWorkspace<S>& w, int b) {
    struct Column {
      int at;
      Vector6<S> J, rate;
    };
    std::vector<Column> made;  // of the coordinates on the way; the axes are known at its end
    const RelativeMotion<S> m = jacobian_along(
        *w.model, path, rates, w.hinge, [&](const FrameStep& step, HingeRows<S>& hinge) { return step_motion(w, *frames_, times, b, step, part, hinge); },
        [&](int i, const Vector6<S>& J, const Vector6<S>& rate) {
          if (!coordinates) return made.push_back({i, J, rate});
          if (const auto found = column_of.find(i); found != column_of.end()) made.push_back({found->second, J, rate});
        });
    const RelativeMotion<S> turn = along<S>(aside, part, [&](const FrameStep& step) { return step_motion(w, *frames_, times, b, step, part, w.hinge); });
    double* const to = out + size_t(b) * size;
    std::fill_n(to, size, 0.0);
    for (const Column& c : made)
      write(rates ? rate_in_axes(asked.axes, m, turn.X.R, turn.V.angular, c.J, c.rate) : in_axes(asked.axes, m, turn.X.R, c.J), to + c.at, columns);
    require_finite(to, size, model());
  });
}

}  // namespace pycraft
