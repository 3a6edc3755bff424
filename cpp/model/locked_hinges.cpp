#include "model/locked_hinges.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

using Wide = long double;

// S(q), all subhinges one after the other.
Pose<Wide> steps(const Hinge& hinge, const double* q) {
  Pose<Wide> X = Pose<Wide>::identity();
  Wide own[7];
  for (const Subhinge& s : hinge.subhinges) {
    const Vector3<Wide> axis = cast<Wide>(s.axis);
    std::copy_n(q, s.nq(), own);
    q += s.nq();
    const CompiledSubhinge<Wide> h{s.kind, Vector6<Wide>::zero(), (1 / norm(axis)) * axis, cast<Wide>(s.point), static_cast<Wide>(s.pitch)};
    X = X * with_subhinge(s.kind, [&](auto row) { return row.step(h, own); });
  }
  return X;
}

bool same(const Pose<double>& X, const Pose<double>& Y) { return std::equal(X.R.m, X.R.m + 9, Y.R.m) && std::equal(X.p.v, X.p.v + 3, Y.p.v); }

std::string placement_of(const Hinge& hinge) { return "the placement of hinge '" + hinge.name + "'"; }

}  // namespace

void StructureEdits::LockedHinges::exchanged(Multibody& model, const std::vector<Exchanged>& hinges, const double* v, const char* what) {
  const std::string& first = hinges.front().before.name;
  model.settled_.store(false);  // nothing is carried over by name
  model.structure_changed("hinge '" + first + "'" + (hinges.size() > 1 ? " and " + std::to_string(hinges.size() - 1) + " more were " : " was ") + what);
  std::unordered_map<int, const Exchanged*> changed;
  for (const Exchanged& one : hinges) changed[one.body] = &one;
  const double* q = model.state_->q.data();
  std::vector<double> all_q, all_v;
  const std::vector<int> q_from = std::exchange(model.q_offset_, {0}), v_from = std::exchange(model.v_offset_, {0});
  model.quaternions_.clear();
  for (int k = 0; k < static_cast<int>(model.bodies_.size()); ++k) {
    const Hinge& hinge = model.bodies_[k].hinge;
    int at = model.q_offset_.back();
    for (const Subhinge& s : hinge.subhinges) {
      if (s.record().quaternion >= 0) model.quaternions_.push_back(at + s.record().quaternion);
      at += s.nq();
    }
    model.q_offset_.push_back(at);
    model.v_offset_.push_back(model.v_offset_.back() + hinge.nv());
    if (const auto found = changed.find(k); found != changed.end()) {
      all_q.insert(all_q.end(), found->second->q.begin(), found->second->q.end());
      all_v.resize(model.v_offset_.back(), 0.0);
    } else {
      all_q.insert(all_q.end(), q + q_from[k], q + q_from[k + 1]);
      all_v.insert(all_v.end(), v + v_from[k], v + v_from[k + 1]);
    }
  }
  model.state_ = std::make_shared<StateData>(StateData{std::move(all_q), std::move(all_v)});
  model.settled_.store(true, std::memory_order_release);
}

void StructureEdits::LockedHinges::lock(Multibody& model, const std::vector<int>& bodies, const std::vector<double>& v) {
  model.require_whole("lock hinges");
  if (bodies.empty()) return;
  const Multibody::Edit edit(model);
  model.settle();
  std::vector<Exchanged> locked;
  for (int k : bodies) {
    const Hinge& hinge = model.bodies_[k].hinge;
    const Pose<Wide> X = cast<Wide>(hinge.placement) * steps(hinge, model.state_->q.data() + model.q_offset_[k]);
    locked.push_back({k, {hinge.name, HingeKind::weld, checked_pose(cast<double>(X), placement_of(hinge)), {}, {}, {}, {}}, {}});
  }
  for (Exchanged& one : locked) std::swap(model.bodies_[one.body].hinge, one.before);
  exchanged(model, locked, v.data(), "locked");
}

void StructureEdits::LockedHinges::unlock(Multibody& model, std::vector<Unlocked> hinges) {
  model.require_whole("unlock hinges");
  if (hinges.empty()) return;
  const Multibody::Edit edit(model);
  model.settle();
  std::vector<Exchanged> unlocked;
  try {
    for (Unlocked& one : hinges) {
      const int k = model.hinge_index(one.hinge.name);
      const Pose<double>& now = model.bodies_[k].hinge.placement;
      if (!same(now, one.welded)) {
        const Pose<Wide> P = cast<Wide>(now) * inverse(steps(one.hinge, one.q.data()));
        one.hinge.placement = checked_pose(cast<double>(P), placement_of(one.hinge));
      }
      Hinge hinge = checked_hinge(std::move(one.hinge));
      check_configuration(hinge, one.q.data());
      model.check_coordinate_names(hinge);
      unlocked.push_back({k, std::exchange(model.bodies_[k].hinge, std::move(hinge)), std::move(one.q)});
    }
  } catch (...) {
    for (Exchanged& one : unlocked) model.bodies_[one.body].hinge = std::move(one.before);
    throw;
  }
  exchanged(model, unlocked, model.state_->v.data(), "unlocked");
}

}  // namespace pycraft
