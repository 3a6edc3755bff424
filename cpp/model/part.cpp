#include "model/part.h"

#include <algorithm>
#include <mutex>

#include "model/checks.h"
#include "model/hinge_kinematics.h"
#include "model/multibody.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

std::string listed(const Multibody& model, const std::vector<int>& bodies) {
  constexpr size_t most = 6;
  std::string text;
  for (size_t i = 0; i < std::min(bodies.size(), most); ++i) text += (i ? ", '" : "'") + model.body(bodies[i]).name + "'";
  return bodies.size() > most ? text + " and " + std::to_string(bodies.size() - most) + " more" : text;
}

// Runs of coordinates that follow one another, bodies in ascending order.
template <class First, class Size>
std::vector<std::pair<int, int>> runs_of(const std::vector<int>& bodies, First first, Size size) {
  std::vector<std::pair<int, int>> runs;
  for (int k : bodies) {
    if (size(k) == 0) continue;
    if (!runs.empty() && runs.back().first + runs.back().second == first(k))
      runs.back().second += size(k);
    else
      runs.emplace_back(first(k), size(k));
  }
  return runs;
}

SharedNumbers taken(const SharedNumbers& from, const std::vector<std::pair<int, int>>& runs, const std::vector<double>& base) {
  if (base.empty() && runs.size() == 1) return from.run(runs[0].first, runs[0].second);
  std::vector<double> numbers = base;
  for (const auto& [first, size] : runs) numbers.insert(numbers.end(), from.begin() + first, from.begin() + first + size);
  return numbers;
}

// The roots hang together: every body between one of them and the first is in the set. ModelError that names those that are missing.
void require_connected(const Multibody& model, const std::vector<int>& bodies) {
  const auto in = [&](int k) { return std::binary_search(bodies.begin(), bodies.end(), k); };
  int first = -1;
  for (int k : bodies) {
    if (in(model.body(k).parent)) continue;
    if (first < 0) first = k;
    std::vector<int> missing = path_between(model, first, k);
    std::erase_if(missing, in);
    if (!missing.empty())
      throw ModelError("a part of '" + model.name() + "' hangs together: between '" + model.body(first).name + "' and '" + model.body(k).name + "' there is " +
                       listed(model, missing) + ", which is not among the bodies; add what is between them, or take two parts");
  }
}

Body base_body(const std::string& name) {
  Body base;
  base.name = base.hinge.name = name;
  base.hinge.kind = HingeKind::free;
  base.hinge.subhinges = subhinges_of(HingeKind::free, {}, Vector3<double>::zero(), 0, name);
  base.hinge.rotor_inertia.assign(6, 0.0);
  return base;
}

}  // namespace

bool PartOf::has(int body_of_whole) const { return body_of_whole < 0 ? moving_base || carrier < 0 : number(body_of_whole) >= 0; }

int PartOf::number(int body_of_whole) const {
  const auto found = std::lower_bound(bodies.begin(), bodies.end(), body_of_whole);
  return found == bodies.end() || *found != body_of_whole ? -1 : static_cast<int>(found - bodies.begin()) + (moving_base ? 1 : 0);
}

std::vector<int> outboard_of(const Multibody& model, int root, const std::vector<int>& without) {
  const auto end_of = [&](int k) {  // depth first: a subtree is a run
    int end = k + 1;
    while (end < model.bodies() && model.body(end).parent >= k) ++end;
    return end;
  };
  const int first = std::max(root, 0), end = root < 0 ? model.bodies() : end_of(root);
  std::vector<int> found;
  for (int k : without)
    if (k < first || k >= end)
      throw ModelError("without '" + model.body(k).name + "': it is not outboard of '" + model.body(root).name + "'");
  for (int k = first; k < end;) {
    if (std::find(without.begin(), without.end(), k) != without.end())
      k = end_of(k);
    else
      found.push_back(k++);
  }
  if (found.empty()) throw ModelError("a part of '" + model.name() + "' has a body at least; nothing is left of it here");
  return found;
}

std::vector<int> path_between(const Multibody& model, int a, int b) {
  std::vector<int> found;
  while (a != b) {
    int& outer = a > b ? a : b;  // a parent's number is lower
    found.push_back(outer);
    outer = model.body(outer).parent;
  }
  if (a >= 0) found.push_back(a);
  std::sort(found.begin(), found.end());
  return found;
}

void motion_of_body(const Multibody& model, int body, const StateData& at, double* pose, double* velocity) {
  const auto compiled = model.compiled<double>();
  std::vector<int> path = path_between(model, -1, body);
  Pose<double> X = Pose<double>::identity();
  Vector6<double> V = Vector6<double>::zero();
  std::vector<Vector6<double>> rows;
  for (int k : path) {
    rows.resize(compiled->nv_of[k]);
    const Pose<double> step = hinge_kinematics(*compiled, k, at.q.data(), rows.data());
    V = motion_to_child(step, V);
    for (size_t j = 0; j < rows.size(); ++j) V = V + at.v.data()[compiled->v_offset[k] + j] * rows[j];
    X = X * step;
  }
  const Quaternion<double> turn = rotation_quaternion(X.R);
  pose[0] = turn.w, pose[1] = turn.x, pose[2] = turn.y, pose[3] = turn.z;
  for (int i = 0; i < 3; ++i) pose[4 + i] = X.p[i];
  for (int i = 0; i < 6; ++i) velocity[i] = V[i];
}

// ------------------------------------------------------------------ of a model

std::shared_ptr<Multibody> Multibody::part_of(const std::shared_ptr<Multibody>& whole, const std::string& name, std::vector<int> bodies, bool moving_base) {
  const ModelInUse use(*whole);
  std::sort(bodies.begin(), bodies.end());
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  if (bodies.empty()) throw ModelError("a part of '" + whole->name() + "' has a body at least; none was given");
  require_connected(*whole, bodies);
  auto part = std::make_shared<Multibody>(name, whole->keep_welds_, whole->strict_);
  const int carrier = whole->body(bodies.front()).parent;
  PartOf of{whole, std::move(bodies), moving_base, carrier, {}, {}};
  of.q_runs = runs_of(of.bodies, [&](int k) { return whole->q_offset(k); }, [&](int k) { return whole->body(k).hinge.nq(); });
  of.v_runs = runs_of(of.bodies, [&](int k) { return whole->v_offset(k); }, [&](int k) { return whole->body(k).hinge.nv(); });
  if (moving_base) {
    std::string base = "base";
    const auto is_taken = [&](const std::string& x) { return whole->body_numbers_.count(x) || whole->hinge_numbers_.count(x) || whole->node_numbers_.count(x); };
    while (is_taken(base)) base = "moving " + base;
    part->bodies_.push_back(base_body(base));
  }
  for (int k : of.bodies) {
    Body body = whole->body(k);
    body.parent = std::max(of.number(body.parent), moving_base ? 0 : -1);
    part->bodies_.push_back(std::move(body));
  }
  for (const Node& node : whole->nodes_)
    if (of.has(node.body)) part->nodes_.push_back({node.name, of.number(node.body), node.pose});
  part->gravity_ = whole->gravity_;
  part->part_ = std::make_unique<const PartOf>(std::move(of));
  part->settled_.store(false);
  part->settle();
  std::lock_guard<Mutex> lock(whole->mutex_);
  std::erase_if(whole->parts_, [](const auto& known) { return known.expired(); });
  whole->parts_.push_back(part);
  return part;
}

void Multibody::with_parts(std::vector<std::shared_ptr<Multibody>>& all) const {
  std::vector<std::shared_ptr<Multibody>> own;
  {
    std::lock_guard<Mutex> lock(mutex_);
    for (const auto& known : parts_)
      if (auto part = known.lock()) own.push_back(std::move(part));
  }
  for (const auto& part : own) {
    all.push_back(part);
    part->with_parts(all);
  }
}

int Multibody::number_in_whole(int k) const {
  if (const int own = k - (part_->moving_base ? 1 : 0); own >= 0) return part_->bodies[own];
  throw ModelError("'" + body(k).name + "' is the moving base of '" + name_ + "', which stands for what carries the part: it has no parameters of its own");
}

void Multibody::require_whole(const std::string& edit) const {
  if (part_) throw ModelError("'" + name_ + "' is a part of '" + part_->whole->name() + "': " + edit + " there, and take the part anew");
}

void Multibody::body_changed(int k) {
  ++parameters_;
  for_each_part([&](Multibody& part) {
    const int own = part.part_->number(k);
    if (own < 0) return;
    const Body& of = bodies_[k];
    Body& to = part.bodies_[own];
    to.mass = of.mass, to.com = of.com, to.inertia = of.inertia;
    to.hinge = of.hinge;
    part.body_changed(own);
  });
}

void Multibody::node_added(const Node& node) {
  node_numbers_[node.name] = static_cast<int>(nodes_.size());
  nodes_.push_back(node);
  for_each_part([&](Multibody& part) {
    if (part.part_->has(node.body)) part.node_added({node.name, part.part_->number(node.body), node.pose});
  });
}

void Multibody::gravity_changed(const Vector3<double>& g) {
  gravity_ = g;
  ++parameters_;
  for_each_part([&](Multibody& part) { part.gravity_changed(g); });
}

// The whole's structure is another one: whatever is asked of the part from here on says so.
void Multibody::whole_changed(const std::string& reason) {
  stale_ = "'" + name_ + "' is a part of '" + part_->whole->name() + "', which has changed since (" + reason + "); take the part anew from '" + part_->whole->name() + "'";
  structure_changed(reason);
}

// ------------------------------------------------------------------ its state

std::shared_ptr<const StateData> Multibody::state_of_part() const {
  const std::shared_ptr<const StateData> of_whole = part_->whole->state();
  const std::uint64_t version = part_->moving_base ? part_->whole->parameters() : 0;
  std::vector<double> base_q, base_v;
  std::uint64_t given;
  {
    std::lock_guard<Mutex> lock(mutex_);
    if (whole_state_ == of_whole && whole_version_ == version) return state_;
    base_q = base_q_, base_v = base_v_, given = base_given_;
  }
  if (part_->moving_base) {
    double pose[7], velocity[6];
    motion_of_body(*part_->whole, part_->carrier, *of_whole, pose, velocity);
    if (base_q.empty()) base_q.assign(pose, pose + 7);
    if (base_v.empty()) base_v.assign(velocity, velocity + 6);
  }
  auto made = std::make_shared<StateData>();
  made->q = taken(of_whole->q, part_->q_runs, base_q);
  made->v = taken(of_whole->v, part_->v_runs, base_v);
  std::lock_guard<Mutex> lock(mutex_);
  if (given == base_given_) state_ = made, whole_state_ = of_whole, whole_version_ = version;
  return made;
}

void Multibody::set_in_whole(const std::vector<double>& numbers, bool of_q) {
  std::vector<double>& base = of_q ? base_q_ : base_v_;
  const auto state = part_->whole->state();
  std::vector<double> all = (of_q ? state->q : state->v).copy();
  size_t at = part_->moving_base ? (of_q ? 7 : 6) : 0;
  {
    std::lock_guard<Mutex> lock(mutex_);
    base.assign(numbers.begin(), numbers.begin() + at);
    ++base_given_, whole_state_ = nullptr;
  }
  for (const auto& [first, size] : of_q ? part_->q_runs : part_->v_runs) {
    std::copy_n(numbers.begin() + at, size, all.begin() + first);
    at += size;
  }
  of_q ? part_->whole->set_q(all) : part_->whole->set_v(all);
}

void Multibody::follow_base() {
  std::lock_guard<Mutex> lock(mutex_);
  base_q_.clear(), base_v_.clear();
  ++base_given_, whole_state_ = nullptr;
}

}  // namespace pycraft
