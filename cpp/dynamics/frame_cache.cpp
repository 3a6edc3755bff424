#include "dynamics/frame_cache.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr size_t most_pairs = 65536;  // kept; then all are forgotten, as no one asks for so many again and again

std::uint64_t key(FrameNumber a, FrameNumber b) { return std::uint64_t(std::uint32_t(a)) << 32 | std::uint32_t(b); }
int index(MotionPart part) { return static_cast<int>(part); }

bool same(const std::vector<double>& kept, const double* now) { return std::equal(kept.begin(), kept.end(), now); }

}  // namespace

// ------------------------------------------------------------------ the present state

void FrameCache::set_time(double t) {
  if (!std::isfinite(t)) throw ModelError("the time of the frames of '" + frames_->model().name() + "' is not a finite number");
  std::lock_guard<Mutex> lock(mutex_);
  time_ = t;
  own_state_changed_ = true;
}

void FrameCache::set_accelerations(std::vector<double> vdot) {
  const Multibody& model = frames_->model();
  model.check_v(vdot.data(), vdot.size(), "vdot");
  std::lock_guard<Mutex> lock(mutex_);
  vdot_ = std::move(vdot);
  if (vdot_parameters_ != model.parameters()) name_hinges();
  own_state_changed_ = true;
}

// Whose the accelerations are.
void FrameCache::name_hinges() {
  const Multibody& model = frames_->model();
  vdot_hinges_.clear();
  for (int k = 0; k < model.bodies(); ++k) vdot_hinges_.emplace_back(model.body(k).hinge.name, model.body(k).hinge.nv());
  vdot_parameters_ = model.parameters();
}

std::vector<double> FrameCache::accelerations() {
  std::lock_guard<Mutex> lock(mutex_);
  carry_accelerations();
  return vdot_.empty() ? std::vector<double>(frames_->model().nv(), 0.0) : vdot_;
}

// By hinge name, as the model carries q and v.
void FrameCache::carry_accelerations() {
  const Multibody& model = frames_->model();
  if (vdot_.empty() || vdot_parameters_ == model.parameters()) return;
  std::unordered_map<std::string, std::vector<double>> old;
  size_t at = 0;
  for (const auto& [name, size] : vdot_hinges_) {
    old[name].assign(vdot_.begin() + at, vdot_.begin() + at + size);
    at += size;
  }
  vdot_.clear();
  for (int k = 0; k < model.bodies(); ++k) {
    const Hinge& hinge = model.body(k).hinge;
    std::vector<double>& kept = old[hinge.name];
    if (static_cast<int>(kept.size()) != hinge.nv()) kept.assign(hinge.nv(), 0.0);
    vdot_.insert(vdot_.end(), kept.begin(), kept.end());
  }
  name_hinges();
}

FrameCache::Counts FrameCache::counts() const {
  std::lock_guard<Mutex> lock(mutex_);
  return counts_;
}

std::shared_ptr<const StateData> FrameCache::look() {
  const Multibody& model = frames_->model();
  if (mutex_.abandoned()) {
    leave_behind(steps_, pairs_);
    parameters_ = 0;
  }
  bool other = own_state_changed_;
  if (parameters_ != model.parameters()) {
    model_ = model.compiled<double>();
    steps_.clear(), pairs_.clear();
    carry_accelerations();
    parameters_ = model_->parameters;
    other = true;
  }
  std::shared_ptr<const StateData> state = model.state();
  if (seen_.owner_before(state) || state.owner_before(seen_)) {
    seen_ = state;
    other = true;
  }
  if (seen_edits_ != frames_->edits()) {
    seen_edits_ = frames_->edits();
    other = true;
  }
  own_state_changed_ = false;
  if (other) ++now_;
  return state;
}

// ------------------------------------------------------------------ steps

const FrameCache::Step& FrameCache::hinge(int body, MotionPart part, const StateData& state) {
  Step& s = steps_[body];
  const double *q = state.q.data() + model_->q_offset[body], *v = state.v.data() + model_->v_offset[body];
  if (s.looked_at != now_) {
    if (s.parts > 0 && !same(s.q, q)) s.parts = 0;
    if (s.parts > 1 && !same(s.v, v)) s.parts = 1;
    if (s.parts > 2 && !(vdot_.empty() ? std::all_of(s.vdot.begin(), s.vdot.end(), [](double x) { return x == 0; }) : same(s.vdot, vdot_.data() + model_->v_offset[body])))
      s.parts = 2;
    s.looked_at = now_;
  }
  for (; s.parts <= index(part); ++s.parts) {
    if (s.parts == 0) {
      s.q.assign(q, q + (body + 1 < model_->bodies ? model_->q_offset[body + 1] : model_->nq) - model_->q_offset[body]);
      hinge_pose(*model_, body, state.q.data(), s.motion, s.hinge);
    } else if (s.parts == 1) {
      s.v.assign(v, v + model_->nv_of[body]);
      hinge_velocity(*model_, body, v, s.motion, s.hinge);
    } else {
      if (vdot_.empty())
        s.vdot.assign(model_->nv_of[body], 0.0);
      else
        s.vdot.assign(vdot_.begin() + model_->v_offset[body], vdot_.begin() + model_->v_offset[body] + model_->nv_of[body]);
      hinge_acceleration(s.v.data(), s.vdot.data(), s.motion, s.hinge);
    }
    s.changed[s.parts] = now_;
    ++counts_.steps[s.parts];
  }
  return s;
}

// Whether the function of a moved frame need not be asked.
bool FrameCache::has_motion(const FrameStep& step) {
  const auto found = steps_.find(step.number);
  return found != steps_.end() && found->second.parts > 0 && found->second.time == time_ && found->second.edited == step.edited;
}

const FrameCache::Step& FrameCache::moved(const FrameStep& step, MotionPart part) {
  Step& s = steps_[step.number];
  const LooseFrame& frame = frames_->loose(step.number);
  require_part(frame, s.given, part);
  for (; s.parts <= index(part); ++s.parts) {
    s.motion = motion_of<double>(frame, s.given, static_cast<MotionPart>(s.parts));
    s.changed[s.parts] = now_;
    ++counts_.steps[s.parts];
  }
  return s;
}

// ------------------------------------------------------------------ pairs

bool FrameCache::kept(FrameNumber frame, FrameNumber other, MotionPart part, RelativeMotion<double>& out) const {
  const auto found = pairs_.find(key(frame, other));
  if (found == pairs_.end() || found->second.parts <= index(part) || found->second.looked_at[index(part)] != now_) return false;
  out = found->second.motion;
  return true;
}

RelativeMotion<double> FrameCache::motion(FrameNumber frame, FrameNumber other, MotionPart part) {
  const FrameTree::InUse use(*frames_);
  RelativeMotion<double> result;
  {
    std::lock_guard<Mutex> lock(mutex_);
    look();
    if (kept(frame, other, part, result)) return result;
  }
  const FramePath path = frames_->path(frame, other);
  // Functions of time are a user's, who may ask for other frames in them: not under the lock.
  for (const auto* steps : {&path.up, &path.down})
    for (const FrameStep& step : *steps) {
      if (step.kind != FrameStep::Kind::moved) continue;
      double t;
      {
        std::lock_guard<Mutex> lock(mutex_);
        if (has_motion(step)) continue;
        t = time_;
      }
      FrameMotion given = frames_->loose(step.number).motion(t);
      std::lock_guard<Mutex> lock(mutex_);
      Step& s = steps_[step.number];
      s.given = std::move(given), s.time = t, s.edited = step.edited, s.parts = 0;
      s.motion = motion_of<double>(frames_->loose(step.number), s.given, MotionPart::pose);
      s.changed[0] = ++now_;
      s.parts = 1;
      ++counts_.steps[0];
    }
  std::lock_guard<Mutex> lock(mutex_);
  const auto state = look();
  if (pairs_.size() >= most_pairs) pairs_.clear();
  Pair& pair = pairs_[key(frame, other)];
  bool changed = pair.parts <= index(part);
  const auto see = [&](const FrameStep& step) {
    if (step.edited > pair.edits) changed = true;
    if (step.kind == FrameStep::Kind::fixed) return;
    const Step& s = step.kind == FrameStep::Kind::hinge ? hinge(step.number, part, *state) : moved(step, part);
    for (int i = 0; i <= index(part); ++i) changed |= s.changed[i] > pair.made;
  };
  for (const FrameStep& step : path.up) see(step);
  for (const FrameStep& step : path.down) see(step);
  if (changed) {
    pair.motion = along<double>(path, part, [&](const FrameStep& step) {
      return step.kind == FrameStep::Kind::fixed ? RelativeMotion<double>{*step.pose} : steps_[step.number].motion;
    });
    pair.parts = index(part) + 1;
    pair.made = now_, pair.edits = seen_edits_;
    ++counts_.pairs;
  }
  for (int i = 0; i <= index(part); ++i) pair.looked_at[i] = now_;
  return pair.motion;
}

}  // namespace pycraft
