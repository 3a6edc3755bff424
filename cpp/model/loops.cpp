#include "model/loops.h"

#include <algorithm>
#include <cmath>

#include "model/checks.h"
#include "model/hinge_kinematics.h"
#include "model/spanned_twists.h"
#include "model/structure_edits.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

std::string called(const std::string& frame) { return frame.empty() ? "the base" : "'" + frame + "'"; }

// The frame with z along a unit axis through a point: turned the short way, so that of z itself it is not turned at all.
Pose<double> frame_along(const Vector3<double>& axis, const Vector3<double>& point) {
  // R = 1 + v~ + v~²/(1 + c), v = s z × axis, c = s z·axis, from the one of z and -z that is near; -z is z turned about x.
  const double s = axis[2] < 0 ? -1 : 1, c = s * axis[2];
  const Vector3<double> v{-s * axis[1], s * axis[0], 0};
  const Matrix3<double> V{0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0};
  Matrix3<double> R = Matrix3<double>::identity();
  const Matrix3<double> square = V * V;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) R(i, j) += V(i, j) + square(i, j) / (1 + c);
  const Matrix3<double> turned{1, 0, 0, 0, s, 0, 0, 0, s};
  return {R * turned, point};
}

// The kind of the pair that a hinge closes. ModelError for hinges that have none.
PairKind kind_of(const Hinge& hinge, const std::string& loop) {
  const auto across = [&](int i, int j) { return std::abs(dot(hinge.subhinges[i].axis, hinge.subhinges[j].axis)) < 1e-9; };
  switch (hinge.kind) {
    case HingeKind::weld: return PairKind::weld;
    case HingeKind::pin: return PairKind::pin;
    case HingeKind::slider: return PairKind::slider;
    case HingeKind::screw: return PairKind::screw;
    case HingeKind::cylindrical: return PairKind::cylindrical;
    case HingeKind::planar: return PairKind::planar;
    case HingeKind::ball: return PairKind::ball;
    case HingeKind::free: return PairKind::free;
    case HingeKind::universal:
      if (norm(cross(hinge.subhinges[0].axis, hinge.subhinges[1].axis)) > 1e-6) return PairKind::universal;
      throw ModelError("loop '" + loop + "': the axes of its universal hinge are parallel, and it moves as a pin alone; give a pin, or axes that are not");
    case HingeKind::gimbal: return across(0, 1) && across(1, 2) ? PairKind::ball : PairKind::custom;
    case HingeKind::custom: break;
  }
  return PairKind::custom;
}

// One body on a hinge that has no rows by its kind. ModelError where some of its subhinges move nothing that others do not, wherever it stands.
std::shared_ptr<const Multibody> permitted_by(Hinge hinge, const std::string& loop) {
  const int freedoms = hinge.nv();
  for (const Subhinge& s : hinge.subhinges)
    if (s.kind == SubhingeKind::free) throw ModelError("loop '" + loop + "': a free subhinge of its custom hinge leaves nothing to close");
  hinge.placement = Pose<double>::identity();
  const auto made = std::make_shared<Multibody>("loop " + loop, true);
  made->add_body({loop, -1, 0, {0, 0, 0}, {0, 0, 0, 0, 0, 0}, hinge}, "");
  const auto model = made->compiled<double>();
  std::vector<double> q;
  append_zero(hinge, q);
  std::vector<Vector6<double>> rows(freedoms);
  for (size_t i = 0; i < q.size(); ++i) q[i] += 0.7 + 0.4 * double(i);  // no place of its own
  hinge_kinematics(*model, 0, q.data(), rows.data());
  const int rank = orthonormal(rows);
  const std::string count = std::to_string(freedoms);
  if (rank < freedoms)
    throw ModelError("loop '" + loop + "': of the " + count + " freedoms of its " + record_of(hinge.kind).name + " hinge only " + std::to_string(rank) +
                     " move it differently; leave out subhinges that move it as others do");
  if (rank == 6) throw ModelError("loop '" + loop + "': the 6 freedoms of its custom hinge leave nothing to close");
  return made;
}

}  // namespace

const PairRecord& record_of(PairKind kind) {
  static const PairRecord records[] = {
      {"weld", {"about x", "about y", "about z", "along x", "along y", "along z"}},
      {"pin", {"about x", "about y", "along x", "along y", "along z"}},
      {"slider", {"about x", "about y", "about z", "along x", "along y"}},
      {"screw", {"about x", "about y", "along x", "along y", "along and about z"}},
      {"universal", {"between the axes", "along x", "along y", "along z"}},
      {"cylindrical", {"about x", "about y", "along x", "along y"}},
      {"planar", {"about x", "about y", "along z"}},
      {"ball", {"along x", "along y", "along z"}},
      {"free", {}},
      {"custom", {"about x", "about y", "about z", "along x", "along y", "along z"}},
      {"blade", {"sideways"}, 1},
      {"wheel", {"contact", "rolling", "sideways"}, 2},
      {"rolling ball", {"contact", "rolling along x", "rolling along y"}, 2},
      {"surface", {"across"}},
      {"curve", {"across 1", "across 2"}},
  };
  return records[static_cast<int>(kind)];
}

// ------------------------------------------------------------------ edits

std::string LoopSet::body_of(const std::string& frame) const {
  if (frame.empty()) return frame;
  if (const auto body = StructureEdits::body_of(model(), frame)) return *body;
  frames_.find(frame);  // names of the base; else it says which there are
  return {};
}

void LoopSet::check_new(const std::string& name) const {
  if (name.empty()) throw ModelError("a loop of '" + model().name() + "' has no name");
  if (by_name_.count(name)) throw ModelError("'" + model().name() + "' has a loop called '" + name + "' already; give every loop a name of its own");
}

void LoopSet::keep(Loop loop) {
  std::lock_guard<Mutex> lock(mutex_);
  loops_.push_back(std::make_shared<const Loop>(std::move(loop)));
  by_name_[loops_.back()->name] = loops_.back();
  ++edits_;
}

void LoopSet::add_hinge(const std::string& name, const std::string& a, const std::string& b, const Hinge& given) {
  const Hinge hinge = checked_hinge(given);
  const Pose<double> placement = checked_pose(hinge.placement, "the placement of loop '" + name + "'");
  FramePair pair{a, b, kind_of(hinge, name)};
  Pose<double> in_a = Pose<double>::identity(), in_b = in_a;
  switch (pair.kind) {
    case PairKind::weld: case PairKind::free: break;
    case PairKind::custom: pair.permitted = permitted_by(hinge, name); break;
    case PairKind::ball: in_a.p = in_b.p = hinge.subhinges[0].point; break;
    case PairKind::universal:
      in_a = frame_along(hinge.subhinges[0].axis, hinge.subhinges[0].point), in_b = frame_along(hinge.subhinges[1].axis, hinge.subhinges[1].point);
      pair.number = dot(hinge.subhinges[0].axis, hinge.subhinges[1].axis);
      break;
    case PairKind::planar: in_a = in_b = frame_along(hinge.subhinges[2].axis, hinge.subhinges[2].point); break;
    default: in_a = in_b = frame_along(hinge.subhinges[0].axis, hinge.subhinges[0].point);
  }
  if (pair.kind == PairKind::screw) pair.number = hinge.subhinges[0].pitch;
  pair.end_a = placement * in_a, pair.end_b = in_b;
  add_pair(name, pair);
}

void LoopSet::add_pair(const std::string& name, FramePair pair) {
  check_new(name);
  const std::string what = "loop '" + name + "'";
  pair.end_a = checked_pose(pair.end_a, "the frame of " + what + " on " + called(pair.a));
  pair.end_b = checked_pose(pair.end_b, "the frame of " + what + " on " + called(pair.b));
  const bool rolls = pair.kind == PairKind::wheel || pair.kind == PairKind::rolling_ball;
  if (!std::isfinite(pair.number) || (rolls && pair.number <= 0))
    throw ModelError(what + ": " + (rolls ? "a radius is a positive number (m), not " : "a number that is not finite: ") + short_number(pair.number));
  if (pair.kind == PairKind::surface) {
    double sum = std::abs(pair.surface.c), slopes = 0;
    for (int i = 0; i < 3; ++i) {
      slopes += std::abs(pair.surface.b[i]);
      for (int j = 0; j < 3; ++j) slopes += std::abs(pair.surface.A(i, j));
    }
    if (!std::isfinite(sum + slopes)) throw ModelError(what + ": its surface has a number that is not finite");
    if (slopes == 0) throw ModelError(what + ": p·A p + b·p + c with A and b zero is no surface");
  }
  if (pair.kind == PairKind::curve && !pair.curve) throw ModelError(what + ": a point on a curve has no curve");
  const std::string body = body_of(pair.a);
  if (body == body_of(pair.b))
    throw ModelError(what + " is of " + called(body) + " with itself: " + called(pair.a) + " and " + called(pair.b) +
                     " stand on it both; close a chain between two bodies, or a body and the base");
  keep({name, std::move(pair), {}});
}

void LoopSet::add_coupling(const std::string& name, Coupling coupling) {
  check_new(name);
  const std::string what = "coupling '" + name + "'";
  if (coupling.coordinates.empty()) throw ModelError(what + " is of no coordinate; name those that it couples");
  bool moves = static_cast<bool>(coupling.function);
  for (const CoupledCoordinate& of : coupling.coordinates) {
    const Hinge& hinge = model().body(model().hinge_index(of.hinge)).hinge;
    if (hinge.nq() != hinge.nv() || of.coordinate < 0 || of.coordinate >= hinge.nv())
      throw ModelError(what + ": hinge '" + of.hinge + "' of kind '" + record_of(hinge.kind).name + "' has no coordinate " + std::to_string(of.coordinate) +
                       " that is one number in q; couple pins, sliders and screws");
    for (const double c : of.coefficients)
      if (!std::isfinite(c)) throw ModelError(what + " has a coefficient of '" + of.hinge + "' that is not a finite number");
    for (size_t i = 1; i < of.coefficients.size(); ++i) moves |= of.coefficients[i] != 0;
  }
  if (!std::isfinite(coupling.constant)) throw ModelError(what + " has a constant that is not a finite number");
  if (!moves) throw ModelError(what + " has no coefficient but zeros, and couples nothing");
  keep({name, {}, std::move(coupling)});
}

void LoopSet::remove(const std::string& name) {
  loop(name);
  std::lock_guard<Mutex> lock(mutex_);
  std::erase_if(loops_, [&](const auto& known) { return known->name == name; });
  by_name_.erase(name);
  ++edits_;
}

const Loop& LoopSet::loop(const std::string& name) const {
  if (const auto known = by_name_.find(name); known != by_name_.end()) return *known->second;
  std::string all;
  for (const auto& known : loops_) all += (all.empty() ? "'" : ", '") + known->name + "'";
  throw ModelError("'" + model().name() + "' has no loop called '" + name + "'; " + (all.empty() ? "it has none" : "there are " + all));
}

std::vector<std::string> LoopSet::names() const {
  std::vector<std::string> all;
  for (const auto& loop : loops_) all.push_back(loop->name);
  return all;
}

// ------------------------------------------------------------------ as the structure is now

ResolvedLoop LoopSet::resolve(const std::shared_ptr<const Loop>& loop, std::deque<Pose<double>>& poses) const {
  ResolvedLoop made{loop, 0, 1, {}, {}, {}};
  if (loop->is_coupling()) {
    for (const CoupledCoordinate& of : loop->coupling.coordinates) {
      const int k = model().hinge_index(of.hinge);
      const Hinge& hinge = model().body(k).hinge;
      if (hinge.nq() != hinge.nv() || of.coordinate >= hinge.nv()) throw ModelError("hinge '" + of.hinge + "' has no coordinate " + std::to_string(of.coordinate) + " any more");
      made.q.push_back(model().q_offset(k) + of.coordinate), made.v.push_back(model().v_offset(k) + of.coordinate);
    }
    return made;
  }
  const FramePair& pair = loop->pair;
  made.rows = static_cast<int>(record_of(pair.kind).rows.size());
  const FramePath way = frames_.path(frames_.find(pair.b), frames_.find(pair.a));
  const auto fixed = [&](std::vector<FrameStep>& steps, const Pose<double>& pose) {
    poses.push_back(pose);
    steps.push_back({FrameStep::Kind::fixed, 0, &poses.back(), 0});
  };
  const auto append = [&](std::vector<FrameStep>& steps, const FrameStep& step) { step.pose ? fixed(steps, *step.pose) : steps.push_back(step); };
  fixed(made.path.up, pair.end_b);
  for (const FrameStep& step : way.up) append(made.path.up, step);
  for (const FrameStep& step : way.down) append(made.path.down, step);
  fixed(made.path.down, pair.end_a);
  if (std::none_of(way.up.begin(), way.up.end(), [](const FrameStep& s) { return s.kind == FrameStep::Kind::hinge; }) &&
      std::none_of(way.down.begin(), way.down.end(), [](const FrameStep& s) { return s.kind == FrameStep::Kind::hinge; }))
    throw ModelError(called(pair.a) + " and " + called(pair.b) + " are of one body now");
  return made;
}

std::shared_ptr<const ResolvedLoops> LoopSet::resolved() const {
  std::lock_guard<Mutex> lock(mutex_);
  const std::uint64_t parameters = model().parameters();
  const size_t nodes = model().nodes().size();
  if (resolved_ && parameters_ == parameters && nodes_ == nodes && seen_edits_ == edits_) return resolved_;
  auto made = std::make_shared<ResolvedLoops>();
  for (const auto& loop : loops_) {
    ResolvedLoop one;
    try {
      one = resolve(loop, made->poses);
    } catch (const ModelError& error) {
      throw ModelError(std::string(loop->is_coupling() ? "coupling '" : "loop '") + loop->name + "' of '" + model().name() +
                       "' has lost what it was declared on: " + error.what() + "; remove it, or declare it anew");
    }
    one.first_row = made->rows;
    made->rows += one.rows;
    for (int i = 0; i < one.rows; ++i) {
      const PairRecord* const record = loop->is_coupling() ? nullptr : &record_of(loop->pair.kind);
      made->names.push_back(record ? loop->name + ": " + record->rows[i] : loop->name);
      made->of_positions.push_back(!record || i < one.rows - record->of_velocities);
    }
    made->loops.push_back(std::move(one));
  }
  resolved_ = made, parameters_ = parameters, nodes_ = nodes, seen_edits_ = edits_;
  return made;
}

}  // namespace pycraft
