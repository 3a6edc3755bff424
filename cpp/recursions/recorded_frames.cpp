#include "recursions/recorded_frames.h"

#include <vector>

#include "model/hinge_kinematics.h"
#include "model/recorded_model.h"
#include "model/unit_data.h"
#include "numerics/recorded_tape.h"

namespace pycraft {

namespace {

// From the frame to the base: column(i, 𝒥_i) of every coordinate on the way. Returns the frame's pose.
template <class F>
Pose<Recorded> to_base(const Multibody& model, const Node& frame, Recording& recording, F column) {
  const auto numbers = model.compiled<Recorded>();
  const StateData at = generic_state(model);
  const std::vector<double> values = at.q.copy();
  std::vector<Recorded> q;
  for (int i = 0; i < model.nq(); ++i) q.push_back(recording.input(values[i], 0, i));
  Pose<Recorded> X = renormalised<Recorded>(frame.pose);
  for (int k = frame.body; k >= 0; k = numbers->parent[k]) {
    std::vector<Vector6<Recorded>> rows(numbers->nv_of[k]);
    const Pose<Recorded> own = hinge_kinematics(*numbers, k, q.data(), rows.data());
    for (size_t j = 0; j < rows.size(); ++j) column(numbers->v_offset[k] + static_cast<int>(j), motion_to_child(X, rows[j]));
    X = own * X;
  }
  return X;
}

}  // namespace

kernels::Tape recorded_pose(const Multibody& model, const Node& frame, size_t most) {
  return recorded_tape("the pose of '" + frame.name + "'", most, "pose() takes models of any size", [&](Recording& recording) {
    const Pose<Recorded> X = to_base(model, frame, recording, [](int, const Vector6<Recorded>&) {});
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) recording.result(4 * i + j, i == 3 ? Recorded(j == 3) : j == 3 ? X.p[i] : X.R(i, j));
  });
}

kernels::Tape recorded_jacobian(const Multibody& model, const Node& frame, size_t most) {
  return recorded_tape("the Jacobian of '" + frame.name + "'", most, "jacobian() takes models of any size", [&](Recording& recording) {
    const int n = model.nv();
    std::vector<Recorded> J(size_t(6) * n, Recorded(0));
    to_base(model, frame, recording, [&](int i, const Vector6<Recorded>& column) {
      for (int c = 0; c < 6; ++c) J[size_t(c) * n + i] = column[c];
    });
    for (size_t i = 0; i < J.size(); ++i) recording.result(static_cast<int>(i), J[i]);
  });
}

}  // namespace pycraft
