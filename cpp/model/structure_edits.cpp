#include "model/structure_edits.h"

#include <algorithm>
#include <unordered_set>
#include <utility>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

std::string onto_text(const std::string& parent) { return parent.empty() ? "the base" : "'" + parent + "'"; }

// Up to a dozen names.
std::string listed(const std::vector<std::string>& names) {
  constexpr size_t most = 12;
  std::string text;
  for (size_t i = 0; i < std::min(names.size(), most); ++i) text += (i ? ", '" : "'") + names[i] + "'";
  return names.size() > most ? text + ", ... (" + std::to_string(names.size()) + " in all)" : text;
}

// Of a body against one that it hangs on, over any number of hinges, -1: the base. They are compiled as a model of their own.
StructureEdits::Motion motion_along(const Multibody& model, int body, int inboard) {
  std::vector<int> way;
  for (int k = body; k != inboard; k = model.body(k).parent) way.push_back(k);
  if (way.empty()) return {};
  const auto state = model.state();
  Multibody hinges("way", true);
  std::vector<double> q, v;
  std::string on;
  std::for_each(way.rbegin(), way.rend(), [&](int k) {
    const Body& b = model.body(k);
    hinges.add_body(b, on);
    on = b.name;
    q.insert(q.end(), state->q.data() + model.q_offset(k), state->q.data() + model.q_offset(k) + b.hinge.nq());
    v.insert(v.end(), state->v.data() + model.v_offset(k), state->v.data() + model.v_offset(k) + b.hinge.nv());
  });
  double pose[7], velocity[6];
  motion_of_body(hinges, static_cast<int>(way.size()) - 1, StateData{std::move(q), std::move(v)}, pose, velocity);
  return {{quaternion_rotation(Quaternion<double>{pose[0], pose[1], pose[2], pose[3]}), {pose[4], pose[5], pose[6]}},
          {{velocity[0], velocity[1], velocity[2]}, {velocity[3], velocity[4], velocity[5]}}};
}

}  // namespace

std::optional<std::string> StructureEdits::body_of(const Multibody& model, const std::string& frame) {
  if (model.part_) model.settled();  // stale ones say so
  if (model.body_numbers_.count(frame)) return frame;
  const auto node = model.node_numbers_.find(frame);
  if (node == model.node_numbers_.end()) return std::nullopt;
  const int body = model.nodes_[node->second].body;
  return body < 0 ? std::string() : model.bodies_[body].name;
}

StructureEdits::Motion StructureEdits::relative_motion(const Multibody& model, const std::string& body, const std::string& frame) {
  const ModelInUse use(model);
  const int k = model.body_index(body);
  const Node onto = model.find_frame(frame);
  int a = k, b = onto.body;
  while (a != b) {
    int& outer = a > b ? a : b;  // a parent's number is lower
    outer = model.body(outer).parent;
  }
  const Motion one = motion_along(model, k, a), other = motion_along(model, onto.body, a);
  const Pose<double> X = inverse(other.pose) * one.pose;
  return {inverse(onto.pose) * X, one.velocity - motion_to_child(X, other.velocity)};
}

void StructureEdits::rehang(Multibody& model, const std::string& body, const std::string& parent, Hinge hinge, const std::vector<double>& q,
                            const std::vector<double>& v) {
  model.require_whole("hang body '" + body + "' elsewhere");
  const Multibody::Edit edit(model);
  model.settle();
  const int k = model.body_index(body);
  const std::string before = model.bodies_[k].hinge.name;
  if (hinge.name.empty()) throw ModelError("the hinge of body '" + body + "' has no name");
  if (hinge.name != before && model.hinge_numbers_.count(hinge.name))
    throw ModelError("'" + model.name_ + "' has a hinge called '" + hinge.name + "' already; give every hinge a name of its own");
  const Node onto = model.find_frame(parent);
  for (int j = onto.body; j >= 0; j = model.bodies_[j].parent)
    if (j == k)
      throw ModelError("body '" + body + "' cannot hang on '" + parent + "', which " + (onto.body == k ? "is on the body itself" : "is outboard of it"));
  hinge = checked_hinge(std::move(hinge));
  hinge.placement = placed_on(onto.pose, hinge.placement, "the placement of hinge '" + hinge.name + "'");
  model.hinge_numbers_.erase(before);
  try {
    model.check_coordinate_names(hinge);
    if (static_cast<int>(q.size()) != hinge.nq() || static_cast<int>(v.size()) != hinge.nv())
      throw ModelError("hinge '" + hinge.name + "' takes " + std::to_string(hinge.nq()) + " coordinates and " + std::to_string(hinge.nv()) + " velocities");
    check_configuration(hinge, q.data());
    check_rates(hinge, v.data(), "v");
  } catch (...) {
    model.hinge_numbers_[before] = k;
    throw;
  }
  model.structure_changed("body '" + body + "' was hung on " + onto_text(parent) + " by hinge '" + hinge.name + "'");
  model.carried_.erase(before);
  model.carried_[hinge.name] = {q, v};
  std::vector<Body>& bodies = model.bodies_;
  bodies[k].hinge = std::move(hinge);
  if (bodies[k].parent != onto.body) {  // the last one on its new parent
    bodies[k].parent = onto.body;
    std::rotate(bodies.begin() + k, bodies.begin() + k + 1, bodies.end());
    const int last = static_cast<int>(bodies.size()) - 1;
    const auto moved = [&](int& j) { j = j == k ? last : j - (j > k); };
    for (Body& b : bodies) moved(b.parent);
    for (Node& n : model.nodes_) moved(n.body);
  }
  model.settle();
}

// ------------------------------------------------------------------ copies

StructureEdits::Branch StructureEdits::branch(const Multibody& model, int root) {
  Branch found{std::max(root, 0), root < 0 ? model.bodies() : root + 1, {}};
  while (root >= 0 && found.last < model.bodies() && model.body(found.last).parent >= root) ++found.last;  // depth first: it is a run
  const std::vector<Node>& nodes = model.nodes();
  for (size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].body < 0 ? root < 0 : nodes[i].body >= found.first && nodes[i].body < found.last) found.nodes.push_back(static_cast<int>(i));
  return found;
}

namespace {

// All that is copied, before anything is changed: the source may be the model.
struct Copies {
  std::vector<Body> bodies;
  std::vector<Node> nodes;
  std::vector<std::pair<std::vector<double>, std::vector<double>>> coordinates;
};

// `first` is the number of the first copy in the model.
Copies copies_of(const Multibody& source, const StructureEdits::Branch& from, int first, const Node& onto, const Pose<double>& X, bool places_hinge,
                 const StructureEdits::Names& names) {
  Copies made;
  const auto state = source.state();
  for (int k = from.first; k < from.last; ++k) {
    Body copy = source.body(k);
    copy.name = names.bodies[k - from.first], copy.hinge.name = names.hinges[k - from.first];
    if (copy.parent >= from.first) {
      copy.parent += first - from.first;
    } else {
      const std::string what = "the placement of hinge '" + copy.hinge.name + "'";
      copy.parent = onto.body;
      copy.hinge.placement = placed_on(onto.pose, places_hinge ? X : placed_on(X, copy.hinge.placement, what), what);
    }
    const double *q = state->q.data() + source.q_offset(k), *v = state->v.data() + source.v_offset(k);
    made.coordinates.push_back({{q, q + copy.hinge.nq()}, {v, v + copy.hinge.nv()}});
    made.bodies.push_back(std::move(copy));
  }
  for (size_t i = 0; i < from.nodes.size(); ++i) {
    Node copy = source.nodes()[from.nodes[i]];
    copy.name = names.nodes[i];
    if (copy.body < 0) copy.pose = placed_on(onto.pose, placed_on(X, copy.pose, "node '" + copy.name + "'"), "node '" + copy.name + "'");
    copy.body = copy.body < 0 ? onto.body : copy.body + first - from.first;
    made.nodes.push_back(std::move(copy));
  }
  return made;
}

}  // namespace

void StructureEdits::require_new(const Multibody& model, const Names& names, const std::vector<std::string>& frames, const std::vector<std::string>& loose) {
  std::vector<std::string> taken;
  std::unordered_set<std::string> standing(loose.begin(), loose.end()), hinges;
  model.settled();
  const auto look = [&](const std::string& name, bool there, std::unordered_set<std::string>& among) {
    if (name.empty()) throw ModelError("a body, hinge, node or frame of the copy in '" + model.name_ + "' has no name");
    if (there || !among.insert(name).second) taken.push_back(name);
  };
  for (const auto* called : {&names.bodies, &names.nodes, &frames})
    for (const std::string& name : *called) look(name, model.body_numbers_.count(name) || model.node_numbers_.count(name), standing);
  for (const std::string& name : names.hinges) look(name, model.hinge_numbers_.count(name), hinges);
  if (taken.empty()) return;
  std::sort(taken.begin(), taken.end());
  taken.erase(std::unique(taken.begin(), taken.end()), taken.end());
  throw ModelError("'" + model.name_ + "' would have two of " + listed(taken) + "; give the copies names of their own by prefix, suffix or rename");
}

void StructureEdits::graft(Multibody& model, const Multibody& source, int root, const std::string& parent, const Pose<double>& X, bool places_hinge,
                           const Names& names) {
  model.require_whole("add bodies to it");
  const Branch from = branch(source, root);
  const size_t size = from.last - from.first;
  if (names.bodies.size() != size || names.hinges.size() != size || names.nodes.size() != from.nodes.size())
    throw ModelError("a copy of " + std::to_string(size) + " bodies and " + std::to_string(from.nodes.size()) + " nodes takes a name for each, and for each hinge");
  model.settle();
  require_new(model, names, {}, {});
  const int before = model.bodies();
  Copies made = copies_of(source, from, before, model.find_frame(parent), X, places_hinge, names);
  const Multibody::Edit edit(model);

  const auto enter = [&] {
    for (Body& copy : made.bodies) {
      model.hinge_numbers_[copy.hinge.name] = static_cast<int>(model.bodies_.size());
      model.bodies_.push_back(std::move(copy));
    }
  };
  const auto leave = [&] {
    std::move(model.bodies_.begin() + before, model.bodies_.end(), made.bodies.begin());
    model.bodies_.resize(before);
    for (const Body& copy : made.bodies) model.hinge_numbers_.erase(copy.hinge.name);
  };
  enter();  // coordinates' names are looked at with the copies in their places, which they leave where two are the same
  try {
    for (size_t k = before; k < before + size; ++k) model.check_coordinate_names(model.bodies_[k].hinge);
  } catch (...) {
    leave();
    throw;
  }
  leave();
  model.structure_changed(std::to_string(size) + " bodies were added, copies of those of '" + source.name() + "'");
  for (size_t i = 0; i < size; ++i) model.carried_[made.bodies[i].hinge.name] = std::move(made.coordinates[i]);
  enter();
  model.nodes_.insert(model.nodes_.end(), made.nodes.begin(), made.nodes.end());
  model.settle();
}

// ------------------------------------------------------------------ another root

namespace {

// A hinge seen from its other side. X = P S₁ ⋯ Sₙ carries outboard to inboard; turned round it is
//
//   X⁻¹ = Sₙ⁻¹ ⋯ S₁⁻¹ P⁻¹ = P⁻¹ (P Sₙ⁻¹ P⁻¹) ⋯ (P S₁⁻¹ P⁻¹)
//
// so that P⁻¹ is its placement and its subhinges are the conjugates, in the other order. Those of an axis: exp(-ξ q) conjugated, the axis
// turned and reversed, at the point carried by P, with the same q and v, limits and rotors. Of a ball the rotation P R* P*; of ball and free
// S' = P S⁻¹ P⁻¹ moves with S'⁻¹Ṡ' = -Ad(P S) V. What a cylindrical hinge does along and about its one axis may stay in its order.
struct TurnedHinge {
  Hinge hinge;
  std::vector<double> q, v, rates;
};

Quaternion<double> conjugated(const Matrix3<double>& R, const double* q) {
  const Vector3<double> turned = R * Vector3<double>{q[1], q[2], q[3]};
  return {q[0], -turned[0], -turned[1], -turned[2]};
}

// -Ad(X) of a ball's or a free subhinge's rates.
void carried_back(const Pose<double>& X, int count, const double* rates, std::vector<double>& out) {
  const Vector3<double> w = X.R * Vector3<double>{rates[0], rates[1], rates[2]};
  for (int i = 0; i < 3; ++i) out.push_back(-w[i]);
  if (count < 6) return;
  const Vector3<double> v = X.R * Vector3<double>{rates[3], rates[4], rates[5]} + cross(X.p, w);
  for (int i = 0; i < 3; ++i) out.push_back(-v[i]);
}

void require_same_rotors(const Hinge& hinge, const Subhinge& s, int first) {
  const double* J = hinge.rotor_inertia.data() + first;
  const bool same = s.nv() == 1 || (std::all_of(J, J + s.nv(), [&](double j) { return j == J[0]; }) && (s.kind == SubhingeKind::ball || J[0] == 0));
  if (!same)
    throw ModelError("hinge '" + hinge.name + "' has rotors about axes of one of its bodies (" + s.record().name +
                     "), which seen from the other turn with it: give its rotor inertias the same value, or zero, before the root is moved over it");
}

Subhinge turned_subhinge(const Subhinge& s, const Pose<double>& P, const std::string& hinge) {
  const Vector3<double> axis = P.R * s.axis, zero = Vector3<double>::zero();
  return subhinge_of(s.kind, s.record().axis ? zero - axis : s.axis, s.record().point ? P.R * s.point + P.p : s.point, s.pitch, hinge);
}

TurnedHinge turned(const Hinge& hinge, const double* q, const double* v, const double* rates) {
  const Pose<double>& P = hinge.placement;
  TurnedHinge to{hinge, {}, {}, {}};
  to.hinge.placement = inverse(P);
  to.hinge.subhinges.clear(), to.hinge.rotor_inertia.clear(), to.hinge.lower.clear(), to.hinge.upper.clear();
  const int n = static_cast<int>(hinge.subhinges.size());
  std::vector<int> q_at{0}, v_at{0};
  for (const Subhinge& s : hinge.subhinges) q_at.push_back(q_at.back() + s.nq()), v_at.push_back(v_at.back() + s.nv());
  for (int i = 0; i < n; ++i) {
    const int k = hinge.kind == HingeKind::cylindrical ? i : n - 1 - i;
    const Subhinge& s = hinge.subhinges[k];
    require_same_rotors(hinge, s, v_at[k]);
    to.hinge.subhinges.push_back(turned_subhinge(s, P, hinge.name));
    to.hinge.rotor_inertia.insert(to.hinge.rotor_inertia.end(), hinge.rotor_inertia.begin() + v_at[k], hinge.rotor_inertia.begin() + v_at[k + 1]);
    if (!hinge.lower.empty()) to.hinge.lower.push_back(hinge.lower[k]), to.hinge.upper.push_back(hinge.upper[k]);
    const double *own = q + q_at[k], *rate = v + v_at[k], *more = rates + v_at[k];
    if (s.nv() == 1) {
      to.q.push_back(own[0]), to.v.push_back(rate[0]), to.rates.push_back(more[0]);
      continue;
    }
    const Matrix3<double> R = quaternion_rotation(Quaternion<double>{own[0], own[1], own[2], own[3]});
    const Quaternion<double> back = conjugated(P.R, own);
    to.q.insert(to.q.end(), {back.w, back.x, back.y, back.z});
    Pose<double> S{R, Vector3<double>::zero()};
    if (s.kind == SubhingeKind::free) {
      S.p = {own[4], own[5], own[6]};
      const Vector3<double> p = (P * inverse(S) * inverse(P)).p;
      to.q.insert(to.q.end(), {p[0], p[1], p[2]});
    }
    carried_back(P * S, s.nv(), rate, to.v);
    carried_back(P * S, s.nv(), more, to.rates);
  }
  std::vector<SubhingeKind> wanted, given;
  for (const auto& [kind, axis] : record_of(hinge.kind).subhinges) wanted.push_back(kind);
  for (const Subhinge& s : to.hinge.subhinges) given.push_back(s.kind);
  if (given != wanted) to.hinge.kind = HingeKind::custom;
  to.hinge = checked_hinge(std::move(to.hinge));
  return to;
}

}  // namespace

const Hinge& StructureEdits::hinge_of_root(const Multibody& model, const std::vector<int>& way) {
  const std::string &root = model.bodies_[way.back()].name, &body = model.bodies_[way.front()].name;
  const Hinge& base = model.bodies_[way.back()].hinge;
  if (base.subhinges.size() != 1 || base.subhinges[0].kind != SubhingeKind::free)
    throw ModelError("body '" + root + "', the root that carries '" + body + "', hangs on the base by hinge '" + base.name + "' of kind '" +
                     record_of(base.kind).name + "': a root that moves elsewhere is free; detach('" + root + "') first");
  if (std::any_of(base.rotor_inertia.begin(), base.rotor_inertia.end(), [](double j) { return j != 0; }))
    throw ModelError("hinge '" + base.name + "' has rotors against the base, which would act on '" + body + "' instead of '" + root +
                     "'; set its rotor inertia to zero first");
  return base;
}

std::vector<std::pair<std::string, std::vector<double>>> StructureEdits::reroot(Multibody& model, const std::string& body,
                                                                                const std::vector<double>& rates) {
  model.require_whole("move the root to body '" + body + "'");
  // The body's motion as the free hinge's: X_WB = P S, hence S = P⁻¹ X_WB; its twist is the hinge's velocity.
  const int k = model.body_index(body);
  const auto state = model.state();
  const Motion motion = motion_along(model, k, -1);
  const Multibody::Edit edit(model);
  std::vector<int> way{k};  // to the root
  while (model.bodies_[way.back()].parent >= 0) way.push_back(model.bodies_[way.back()].parent);
  const Hinge base = hinge_of_root(model, way);
  std::vector<TurnedHinge> hinges;
  for (size_t i = 0; i + 1 < way.size(); ++i) {
    const int j = way[i];
    hinges.push_back(turned(model.bodies_[j].hinge, state->q.data() + model.q_offset_[j], state->v.data() + model.v_offset_[j],
                            rates.data() + model.v_offset_[j]));
  }
  std::vector<std::pair<std::string, std::vector<double>>> turned_rates;
  if (hinges.empty()) return turned_rates;
  model.structure_changed("the root was moved to body '" + body + "'");
  const Pose<double> S = inverse(base.placement) * motion.pose;
  const std::vector<double> twist{motion.velocity[0], motion.velocity[1], motion.velocity[2], motion.velocity[3], motion.velocity[4], motion.velocity[5]};
  const Quaternion<double> turn = rotation_quaternion(S.R);
  for (size_t i = 0; i < hinges.size(); ++i) {
    TurnedHinge& to = hinges[i];
    model.carried_[to.hinge.name] = {std::move(to.q), std::move(to.v)};
    turned_rates.emplace_back(to.hinge.name, std::move(to.rates));
    Body& inboard = model.bodies_[way[i + 1]];
    inboard.parent = way[i];
    inboard.hinge = std::move(to.hinge);
  }
  model.carried_[base.name] = {{turn.w, turn.x, turn.y, turn.z, S.p[0], S.p[1], S.p[2]}, twist};
  model.bodies_[k].parent = -1;
  model.bodies_[k].hinge = base;
  model.settle();
  return turned_rates;
}

}  // namespace pycraft
