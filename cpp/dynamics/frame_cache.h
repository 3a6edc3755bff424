// Motions of frames at the model's present state, computed when they are asked for and kept until they are no longer current.
//
// Kept are the motions of steps, a hinge or a moved frame each, as long as their own coordinates, velocities and accelerations, or the time, are the
// same numbers; and those of pairs of frames, as long as no step between them has changed. A question costs the steps between its two frames, one
// that is asked again at the same state a look-up, and a state that is set and not asked about nothing. Of edits of the model (masses, placements,
// structure) all is forgotten; of a loose frame that was edited, what goes over it.
//
// The present state is the model's q and v, with accelerations and a time that are kept here, both zero until they are set.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "model/frames.h"
#include "recursions/frame_motions.h"
#include "runtime/mutex.h"

namespace pycraft {

class FrameCache {
 public:
  explicit FrameCache(std::shared_ptr<FrameTree> frames) : frames_(std::move(frames)) {}
  const FrameTree& frames() const { return *frames_; }

  // The motion of a frame relative to another one. ModelError as FramePath and functions of time have them.
  RelativeMotion<double> motion(FrameNumber frame, FrameNumber other, MotionPart part);

  double time() const { return time_; }
  void set_time(double t);
  std::vector<double> accelerations();             // (nv), carried over by hinge name when the structure changes
  void set_accelerations(std::vector<double> vdot);

  // How often each part of the motion of a step was computed so far, and how often one of two frames was made of them.
  struct Counts {
    std::array<std::uint64_t, 3> steps{};
    std::uint64_t pairs = 0;
  };
  Counts counts() const;

 private:
  struct Step {
    std::uint64_t looked_at = 0;                    // when it was last found to be current
    std::array<std::uint64_t, 3> changed{};         // when each part was computed
    int parts = 0;                                  // how many of them are there
    RelativeMotion<double> motion;
    // of a hinge
    HingeRows<double> hinge;
    std::vector<double> q, v, vdot;
    // of a moved frame
    FrameMotion given;
    double time = 0;
    std::uint64_t edited = 0;
  };
  struct Pair {
    std::array<std::uint64_t, 3> looked_at{};
    std::uint64_t made = 0, edits = 0;
    int parts = 0;
    RelativeMotion<double> motion;
  };
  std::shared_ptr<const StateData> look();          // the present state; whether it is another one since
  bool kept(FrameNumber frame, FrameNumber other, MotionPart part, RelativeMotion<double>& out) const;
  const Step& hinge(int body, MotionPart part, const StateData& state);
  const Step& moved(const FrameStep& step, MotionPart part);
  bool has_motion(const FrameStep& step);
  void carry_accelerations();
  void name_hinges();

  std::shared_ptr<FrameTree> frames_;
  mutable Mutex mutex_;
  std::shared_ptr<const CompiledModel<double>> model_;
  std::weak_ptr<const StateData> seen_;             // the state that was looked at, which is not kept from going
  std::uint64_t parameters_ = 0, now_ = 0, seen_edits_ = 0;
  double time_ = 0;
  bool own_state_changed_ = true;                   // time or accelerations
  std::vector<double> vdot_;                        // empty: zeros
  std::vector<std::pair<std::string, int>> vdot_hinges_;  // whose they are, name and size, in the model that had these parameters
  std::uint64_t vdot_parameters_ = 0;
  std::unordered_map<FrameNumber, Step> steps_;     // by body, or by moved frame
  std::unordered_map<std::uint64_t, Pair> pairs_;
  Counts counts_;
};

}  // namespace pycraft
