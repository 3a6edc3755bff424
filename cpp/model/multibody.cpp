#include "model/multibody.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <mutex>

#include "model/checks.h"
#include "model/compiled_model.h"
#include "model/configuration.h"
#include "model/lumping.h"
#include "numerics/finite.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

Multibody::Multibody(std::string name, bool keep_welds, bool strict) : name_(std::move(name)), keep_welds_(keep_welds), strict_(strict) {
  q_offset_ = v_offset_ = {0};
  state_ = std::make_shared<StateData>();
}

Multibody::Edit::Edit(Multibody& model) {
  begin(model);
  model.with_parts(parts_);
  for (const auto& part : parts_) begin(*part);
}

void Multibody::Edit::end() {
  for (UseCount* use : edited_) use->end_edit();
  edited_.clear();
}

void Multibody::Edit::begin(Multibody& model) {
  if (model.use_.try_edit()) return edited_.push_back(&model.use_);
  end();
  throw ModelError("'" + model.name_ + "' is being evaluated, in another thread or by a call that this edit is made from: edit it when that is over");
}

// ------------------------------------------------------------------ structure

void Multibody::check_new_name(const std::string& name, const char* what) const {
  if (name.empty()) throw ModelError(std::string("a ") + what + " of '" + name_ + "' has no name");
  if (body_numbers_.count(name) || node_numbers_.count(name))
    throw ModelError(std::string("'") + name_ + "' has a body or node called '" + name + "' already; give every " + what + " a name of its own");
}

Node Multibody::find_frame(const std::string& name) const {
  if (name.empty()) return {"", -1, Pose<double>::identity()};
  if (const auto b = body_numbers_.find(name); b != body_numbers_.end()) return {name, b->second, Pose<double>::identity()};
  if (const auto n = node_numbers_.find(name); n != node_numbers_.end()) return nodes_[n->second];
  auto known = body_numbers_;
  known.insert(node_numbers_.begin(), node_numbers_.end());
  throw_unknown("body or node", name, name_, known);
}

void Multibody::add_body(Body body, const std::string& parent) {
  require_whole("add body '" + body.name + "'");
  const Edit edit(*this);
  check_new_name(body.name, "body");
  if (body.hinge.name.empty()) body.hinge.name = body.name;
  if (hinge_numbers_.count(body.hinge.name))
    throw ModelError("'" + name_ + "' has a hinge called '" + body.hinge.name + "' already; give every hinge a name of its own");
  const Node onto = find_frame(parent);
  body.hinge = checked_hinge(std::move(body.hinge));
  check_coordinate_names(body.hinge);
  note(body.name, check_mass_properties(body.name, body.mass, body.com, body.inertia));
  body.hinge.placement = placed_on(onto.pose, body.hinge.placement, "the placement of hinge '" + body.hinge.name + "'");
  body.parent = onto.body;
  if (body.hinge.subhinges.empty() && !keep_welds_) {
    lump(body, onto);
    return;
  }
  structure_changed("body '" + body.name + "' was added");
  body_numbers_[body.name] = bodies();
  hinge_numbers_[body.hinge.name] = bodies();
  bodies_.push_back(std::move(body));
}

// Coordinates are called "hinge", or "hinge[j]" where there are several: two hinges must not come to the same name.
void Multibody::check_coordinate_names(const Hinge& hinge) const {
  const auto refuse = [&](const std::string& other, const std::string& coordinate) {
    throw ModelError("a coordinate of hinge '" + hinge.name + "' would be called '" + coordinate + "', as one of hinge '" + other + "' is; rename one");
  };
  const auto count = [&](const std::string& name) {
    const auto found = hinge_numbers_.find(name);
    return found == hinge_numbers_.end() ? 0 : bodies_[found->second].hinge.nv();
  };
  const int nv = hinge.nv();
  for (int j = 0; nv > 1 && j < nv; ++j)
    if (const std::string name = hinge.name + "[" + std::to_string(j) + "]"; count(name) == 1) refuse(name, name);
  const size_t bracket = hinge.name.rfind('[');
  if (nv != 1 || bracket == std::string::npos) return;
  const std::string other = hinge.name.substr(0, bracket);
  const int coordinates = count(other);
  for (int j = 0; coordinates > 1 && j < coordinates; ++j)
    if (hinge.name == other + "[" + std::to_string(j) + "]") refuse(other, hinge.name);
}

// Says later what is legal but worth a word; in a strict model it is an error.
void Multibody::note(const std::string& body, const std::string& text) {
  if (text.empty()) return;
  if (strict_) throw ModelError(text);
  warnings_.emplace_back(body, text);
}

// A welded body becomes part of the body that moves it, and a node.
void Multibody::lump(const Body& body, const Node& onto) {
  const Pose<double> X = body.hinge.placement;  // in the body that moves it
  if (onto.body >= 0 && (body.mass != 0 || std::any_of(body.inertia.s, body.inertia.s + 6, [](double x) { return x != 0; }))) {
    bodies_[onto.body] = lumped(bodies_[onto.body], X, body);
    body_changed(onto.body);
  }
  node_added({body.name, onto.body, X});
}

void Multibody::remove_body(const std::string& name) {
  require_whole("remove body '" + name + "'");
  const Edit edit(*this);
  settle();
  const int first = body_index(name);
  structure_changed("body '" + name + "' was removed");
  int last = first + 1;  // depth first: the subtree is a run
  while (last < bodies() && bodies_[last].parent >= first) ++last;
  bodies_.erase(bodies_.begin() + first, bodies_.begin() + last);
  for (Body& b : bodies_)
    if (b.parent >= last) b.parent -= last - first;
  std::erase_if(nodes_, [&](const Node& n) { return n.body >= first && n.body < last; });
  for (Node& n : nodes_)
    if (n.body >= last) n.body -= last - first;
  settle();
}

void Multibody::add_node(const std::string& name, const std::string& body, const Pose<double>& pose) {
  if (part_) {
    const Node onto = (settled(), find_frame(body));
    if (onto.body >= 0) number_in_whole(onto.body);  // not on a moving base
    if (onto.body < 0 && !part_->has(-1))
      throw ModelError("the base of '" + name_ + "' is a body of '" + part_->whole->name() + "': put node '" + name + "' on '" + part_->whole->body(part_->carrier).name + "' there");
    return part_->whole->add_node(name, body, pose);
  }
  const Edit edit(*this);
  check_new_name(name, "node");
  const Node onto = find_frame(body);
  const Pose<double> placed = placed_on(onto.pose, pose, "node '" + name + "'");
  node_added({name, onto.body, placed});
}

void Multibody::structure_changed(const std::string& reason) {
  if (const auto source = operators_.lock()) source->invalidate(reason);
  operators_.reset();
  ++parameters_;
  for_each_part([&](Multibody& part) { part.whole_changed(reason); });
  parts_.clear();  // stale, they follow no more
  if (!settled_.load()) return;
  for (int k = 0; k < bodies(); ++k) {
    const double *q = state_->q.data(), *v = state_->v.data();
    carried_[bodies_[k].hinge.name] = {{q + q_offset_[k], q + q_offset_[k + 1]}, {v + v_offset_[k], v + v_offset_[k + 1]}};
  }
  settled_.store(false);
}

void Multibody::settle_once() const {
  std::lock_guard<Mutex> lock(mutex_);
  if (!settled_.load()) const_cast<Multibody*>(this)->settle();
}

namespace {

// Numbers of bodies, each before its children, and these in their order.
std::vector<int> depth_first(const std::vector<Body>& bodies) {
  const int n = static_cast<int>(bodies.size());
  std::vector<int> first(n + 1, -1), next(n, -1);  // the first child of each, the base's at the front, and the next one of the same parent
  for (int k = n - 1; k >= 0; --k) {
    int& child = first[bodies[k].parent + 1];
    next[k] = std::exchange(child, k);
  }
  std::vector<int> order, stack;
  const auto visit = [&](int k) {
    if (k >= 0) stack.push_back(k);
  };
  for (visit(first[0]); !stack.empty();) {
    const int k = stack.back();
    stack.pop_back();
    order.push_back(k);
    visit(next[k]), visit(first[k + 1]);
  }
  return order;
}

}  // namespace

void Multibody::settle() {
  if (settled_.load()) return;
  if (!stale_.empty()) throw StaleOperatorError(stale_);
  const int n = bodies();
  const std::vector<int> order = depth_first(bodies_);
  std::vector<int> place(n);
  for (int i = 0; i < n; ++i) place[order[i]] = i;
  std::vector<Body> sorted;
  sorted.reserve(n);
  for (int k : order) {
    sorted.push_back(std::move(bodies_[k]));
    if (sorted.back().parent >= 0) sorted.back().parent = place[sorted.back().parent];
  }
  bodies_ = std::move(sorted);
  for (Node& node : nodes_)
    if (node.body >= 0) node.body = place[node.body];
  node_numbers_.clear();
  q_offset_ = v_offset_ = {0};
  quaternions_.clear();
  std::vector<double> q, v;
  for (int k = 0; k < n; ++k) {
    const Hinge& h = bodies_[k].hinge;
    body_numbers_[bodies_[k].name] = k;
    hinge_numbers_[h.name] = k;
    for (int at = q_offset_.back(); const Subhinge& s : h.subhinges) {
      if (s.record().quaternion >= 0) quaternions_.push_back(at + s.record().quaternion);
      at += s.nq();
    }
    q_offset_.push_back(q_offset_.back() + h.nq());
    v_offset_.push_back(v_offset_.back() + h.nv());
    const auto old = carried_.find(h.name);
    if (old != carried_.end() && static_cast<int>(old->second.first.size()) == h.nq()) {
      q.insert(q.end(), old->second.first.begin(), old->second.first.end());
      v.insert(v.end(), old->second.second.begin(), old->second.second.end());
    } else {
      append_zero(h, q);
      v.resize(v.size() + h.nv(), 0.0);
    }
  }
  // Names that are there keep their entries; where there are more entries than bodies, some are of bodies that are gone.
  const auto forget = [&](std::unordered_map<std::string, int>& numbers, auto name) {
    if (static_cast<int>(numbers.size()) > n)
      std::erase_if(numbers, [&](const auto& entry) { return entry.second >= n || name(bodies_[entry.second]) != entry.first; });
  };
  forget(body_numbers_, [](const Body& b) -> const std::string& { return b.name; });
  forget(hinge_numbers_, [](const Body& b) -> const std::string& { return b.hinge.name; });
  for (size_t i = 0; i < nodes_.size(); ++i) node_numbers_[nodes_[i].name] = static_cast<int>(i);
  carried_.clear();
  state_ = std::make_shared<StateData>(StateData{std::move(q), std::move(v)});
  settled_.store(true, std::memory_order_release);
}

int Multibody::body_index(const std::string& name) const {
  settled();
  const auto found = body_numbers_.find(name);
  if (found != body_numbers_.end()) return found->second;
  const auto node = node_numbers_.find(name);
  if (node != node_numbers_.end() && nodes_[node->second].body >= 0)
    throw ModelError("'" + name + "' is welded to body '" + bodies_[nodes_[node->second].body].name + "' and is a node of it; load with welds=\"keep\" to have it as a body, or split it off where it was coalesced");
  throw_unknown("body", name, name_, body_numbers_);
}
int Multibody::hinge_index(const std::string& name) const {
  settled();
  const auto found = hinge_numbers_.find(name);
  if (found == hinge_numbers_.end()) throw_unknown("hinge", name, name_, hinge_numbers_);
  return found->second;
}
int Multibody::node_index(const std::string& name) const {
  settled();
  if (const auto n = node_numbers_.find(name); n != node_numbers_.end()) return n->second;
  if (const auto b = body_numbers_.find(name); b != body_numbers_.end()) return static_cast<int>(nodes_.size()) + b->second;
  auto known = body_numbers_;
  known.insert(node_numbers_.begin(), node_numbers_.end());
  throw_unknown("node or body", name, name_, known);
}
Node Multibody::node(int index) const {
  settled();
  if (index < static_cast<int>(nodes_.size())) return nodes_[index];
  const int k = index - static_cast<int>(nodes_.size());
  return {bodies_[k].name, k, Pose<double>::identity()};
}

SkoStructure Multibody::structure() const {
  settled();
  SkoStructure s;
  for (const Body& b : bodies_) {
    s.parent.push_back(b.parent);
    s.size.push_back(6);
    s.dof.push_back(b.hinge.nv());
    s.body_names.push_back(b.name);
    s.hinge_names.push_back(b.hinge.name);
  }
  s.finish();
  return s;
}

// ------------------------------------------------------------------ parameters

void Multibody::set_mass_properties(int k, double mass, const Vector3<double>& com, const Symmetric3<double>& inertia) {
  if (part_) return part_->whole->set_mass_properties(number_in_whole(k), mass, com, inertia);
  const Edit edit(*this);
  note(body(k).name, check_mass_properties(body(k).name, mass, com, inertia));
  bodies_[k].mass = mass;
  bodies_[k].com = com;
  bodies_[k].inertia = inertia;
  body_changed(k);
}
void Multibody::set_placement(int k, const Pose<double>& placement) {
  if (part_) return part_->whole->set_placement(number_in_whole(k), placement);
  const Edit edit(*this);
  const Pose<double> checked = checked_pose(placement, "the placement of hinge '" + body(k).hinge.name + "'");
  bodies_[k].hinge.placement = checked;
  body_changed(k);
}
void Multibody::set_rotor_inertia(int k, const std::vector<double>& values) {
  if (part_) return part_->whole->set_rotor_inertia(number_in_whole(k), values);
  const Edit edit(*this);
  std::vector<double> checked = checked_rotor_inertia(body(k).hinge, values);
  bodies_[k].hinge.rotor_inertia = std::move(checked);
  body_changed(k);
}
void Multibody::set_limits(int k, const std::vector<double>& lower, const std::vector<double>& upper) {
  if (part_) return part_->whole->set_limits(number_in_whole(k), lower, upper);
  const Edit edit(*this);
  check_limits(body(k).hinge, lower, upper);
  bodies_[k].hinge.lower = lower, bodies_[k].hinge.upper = upper;
  body_changed(k);
}
void Multibody::set_gravity(const Vector3<double>& g) {
  if (part_) return part_->whole->set_gravity(g);
  const Edit edit(*this);
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(g[i])) throw ModelError("gravity of '" + name_ + "' has an entry that is " + short_number(g[i]));
  gravity_changed(g);
}
bool Multibody::has_rotor_inertia() const {
  settled();
  return std::any_of(bodies_.begin(), bodies_.end(), [](const Body& b) {
    return std::any_of(b.hinge.rotor_inertia.begin(), b.hinge.rotor_inertia.end(), [](double j) { return j != 0; });
  });
}

std::vector<std::pair<std::string, std::string>> Multibody::take_warnings() {
  settled();
  if (part_) return part_->whole->take_warnings();
  auto all = std::move(warnings_);
  warnings_.clear();
  for (const Body& b : bodies_)
    if (b.hinge.nv() > 0 && b.mass == 0 && std::all_of(b.inertia.s, b.inertia.s + 6, [](double x) { return x == 0; }) && said_massless_.insert(b.name).second)
      all.emplace_back(b.name, "body '" + b.name + "' on hinge '" + b.hinge.name +
                    "' has no mass: what needs D⁻¹ (forward dynamics, ℳ⁻¹) works only where the bodies outboard give the hinge inertia");
  return all;
}

// ------------------------------------------------------------------ flat arrays

template <class S>
std::shared_ptr<const CompiledModel<S>> Multibody::compiled() const {
  const ModelInUse use(*this);  // settled once, it stays so: what follows takes no lock of its own
  settled();
  auto& kept = std::get<std::shared_ptr<const CompiledModel<S>>>(compiled_);
  {
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(compiled_);
    if (kept && kept->parameters == parameters_) return kept;
  }
  // Outside the lock: a signal's handler, called in between, may ask for the same. Nobody edits the model meanwhile.
  const std::shared_ptr<const CompiledModel<S>> made = compile_model<S>(*this);
  std::lock_guard<Mutex> lock(mutex_);
  if (!kept || kept->parameters != made->parameters) kept = made;
  return kept;
}
#define PYCRAFT_INSTANTIATE(S) template std::shared_ptr<const CompiledModel<S>> Multibody::compiled<S>() const;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

std::shared_ptr<SkoSource> Multibody::operators() const {
  std::lock_guard<Mutex> lock(mutex_);
  return operators_.lock();
}
void Multibody::keep_operators(const std::shared_ptr<SkoSource>& source) {
  std::lock_guard<Mutex> lock(mutex_);
  operators_ = source;
}

}  // namespace pycraft
