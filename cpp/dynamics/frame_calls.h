// Motions and Jacobians of one frame relative to another at given states, one or a batch, in any precision to quad: nothing is kept between them.
// Cost: the steps between the two frames, a state.
#pragma once

#include <memory>
#include <unordered_map>
#include <vector>

#include "dynamics/batches.h"
#include "model/frames.h"
#include "recursions/frame_motions.h"

namespace pycraft {

template <class S>
struct FrameWorkspace {
  explicit FrameWorkspace(const Multibody& model) : model(model.compiled<S>()) {}
  std::shared_ptr<const CompiledModel<S>> model;
  HingeRows<S> hinge;
  const S *q = nullptr, *v = nullptr, *vdot = nullptr;
  std::vector<S> numbers[3];                          // where the doubles that are given are converted to
};
template <>
inline constexpr bool available_at<FrameWorkspace, Digits50> = false;
template <>
inline constexpr bool available_at<FrameWorkspace, Digits100> = false;

// What is asked: of which frame, relative to which, in which axes.
struct FrameQuestion {
  FrameNumber frame = base_frame, other = base_frame;
  MotionAxes axes = MotionAxes::body;
  FrameNumber third = base_frame;                     // whose axes, of MotionAxes::other
};

// The motions of the moved frames on the ways of a question, evaluated at each time beforehand: their functions are a user's.
struct FrameTimes {
  std::vector<double> t;                              // one, or one a state
  std::unordered_map<FrameNumber, std::vector<FrameMotion>> motions;
  const FrameMotion& at(FrameNumber frame, int state) const {
    const auto& all = motions.at(frame);
    return all[all.size() == 1 ? 0 : state];
  }
};

class FrameCalls : public Batches<FrameWorkspace> {
 public:
  explicit FrameCalls(std::shared_ptr<FrameTree> frames) : Batches(frames->shared_model()), frames_(std::move(frames)) {}
  const FrameTree& frames() const { return *frames_; }

  // Calls what moves the frames on the ways of the question, at each time.
  FrameTimes times(const FrameQuestion& asked, std::vector<double> t) const;

  // out: X (4 x 4) a state; V, A (6) a state. v, vdot as far as the part needs them. classical: see acceleration_in_axes.
  void motion(const FrameQuestion& asked, MotionPart part, bool classical, Givens given, const FrameTimes& times, Precision precision, int states, double* out);
  // 𝒥, or 𝒥̇ where there is v, (6 x columns) a state: of these coordinates, or of all where there are none given.
  void jacobian(const FrameQuestion& asked, const std::vector<int>* coordinates, bool rates, Givens given, const FrameTimes& times, Precision precision,
                int states, double* out);

 private:
  std::shared_ptr<FrameTree> frames_;
};

}  // namespace pycraft
