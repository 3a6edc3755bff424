#include "model/coalescing.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "model/checks.h"
#include "model/lumping.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

MassProperties mass_of(const Body& body) { return {body.mass, body.com, body.inertia}; }

bool massless(const Body& body) {
  return body.mass == 0 && std::all_of(body.inertia.s, body.inertia.s + 6, [](double x) { return x == 0; });
}

std::string happened(const std::string& first, size_t count, const char* what) {
  return "body '" + first + "'" + (count > 1 ? " and " + std::to_string(count - 1) + " more were " : " was ") + what;
}

// Who hangs on whom: a body's children and nodes by number, and which of its parent's children comes next, -1 for none.
struct Carried {
  std::vector<std::vector<int>> children, nodes;
  std::vector<int> next;
};
Carried carried_by(const std::vector<Body>& bodies, const std::vector<Node>& nodes) {
  const int n = static_cast<int>(bodies.size());
  Carried all{std::vector<std::vector<int>>(n), std::vector<std::vector<int>>(n), std::vector<int>(n, -1)};
  std::vector<int> latest(n + 1, -1);
  for (int k = n - 1; k >= 0; --k) all.next[k] = std::exchange(latest[bodies[k].parent + 1], k);
  for (int k = 0; k < n; ++k)
    if (bodies[k].parent >= 0) all.children[bodies[k].parent].push_back(k);
  for (size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].body >= 0) all.nodes[nodes[i].body].push_back(static_cast<int>(i));
  return all;
}

// The bodies that are left, in their order, and parents and nodes by their new numbers.
void renumber(std::vector<Body>& bodies, std::vector<Node>& nodes, const std::vector<int>& order) {
  std::vector<int> place(bodies.size(), -1);
  std::vector<Body> left;
  left.reserve(order.size());
  for (int k : order) place[k] = static_cast<int>(left.size()), left.push_back(std::move(bodies[k]));
  const auto moved = [&](int& body) { body = body < 0 ? -1 : place[body]; };
  for (Body& b : left) moved(b.parent);
  for (Node& n : nodes) moved(n.body);
  bodies = std::move(left);
}

}  // namespace

std::vector<StructureEdits::Coalescing::Coalesced> StructureEdits::Coalescing::coalesce(Multibody& model, const std::vector<int>& chosen) {
  model.require_whole("coalesce bodies");
  if (chosen.empty()) return {};
  const Multibody::Edit edit(model);
  model.settle();
  std::vector<Body> bodies = model.bodies_;
  std::vector<Node> nodes = model.nodes_;
  auto [children, own_nodes, next] = carried_by(bodies, nodes);
  const int n = model.bodies();
  std::vector<char> gone(n, 0);
  std::vector<Coalesced> all;
  for (int k : chosen) {
    const Body& body = bodies[k];
    if (!body.hinge.subhinges.empty())
      throw ModelError("body '" + body.name + "' hangs on hinge '" + body.hinge.name + "' (" + record_of(body.hinge.kind).name +
                       "), which moves: lock the hinge first, or name bodies that hang on a weld");
    const int c = body.parent;
    const Pose<double> X = body.hinge.placement;
    Coalesced record;
    record.carrier = c < 0 ? "" : bodies[c].name;
    record.next = next[k] < 0 ? "" : bodies[next[k]].name;
    record.placement = X;
    if (c >= 0) {
      record.before = mass_of(bodies[c]);
      if (!massless(body)) bodies[c] = lumped(bodies[c], X, body);
      record.after = mass_of(bodies[c]);
    }
    if (!children[k].empty()) next[children[k].back()] = next[k];
    for (int child : children[k]) {
      Hinge& hinge = bodies[child].hinge;
      const Pose<double> before = hinge.placement;
      hinge.placement = placed_on(X, before, "the placement of hinge '" + hinge.name + "'");
      bodies[child].parent = c;
      record.children.push_back({bodies[child].name, before, hinge.placement});
      if (c >= 0) children[c].push_back(child);
    }
    for (int i : own_nodes[k]) {
      record.nodes.emplace_back(nodes[i].name, nodes[i].pose);
      nodes[i].pose = placed_on(X, nodes[i].pose, "node '" + nodes[i].name + "'");
      nodes[i].body = c;
      if (c >= 0) own_nodes[c].push_back(i);
    }
    if (c >= 0) own_nodes[c].push_back(static_cast<int>(nodes.size()));
    nodes.push_back({body.name, c, X});
    gone[k] = 1;
    all.push_back(std::move(record));
  }
  std::vector<int> order;
  for (int k = 0; k < n; ++k)
    if (!gone[k]) order.push_back(k);
  model.structure_changed(happened(bodies[chosen.front()].name, chosen.size(), "coalesced"));
  renumber(bodies, nodes, order);
  model.bodies_ = std::move(bodies), model.nodes_ = std::move(nodes);
  model.settle();
  return all;
}

void StructureEdits::Coalescing::split(Multibody& model, std::vector<Split> chosen) {
  model.require_whole("split bodies");
  if (chosen.empty()) return;
  const Multibody::Edit edit(model);
  model.settle();
  std::vector<Body> bodies = model.bodies_;
  std::vector<Node> nodes = model.nodes_;
  auto numbers = model.body_numbers_;
  auto hinges = model.hinge_numbers_;
  const int n = model.bodies(), end = n + static_cast<int>(chosen.size());
  // The order as a ring through `end`: what comes back is put in anywhere.
  std::vector<int> after(end + 1), before(end + 1);
  const auto join = [&](int a, int b) { after[a] = b, before[b] = a; };
  for (int k = 0; k <= n; ++k) join(k == 0 ? end : k - 1, k == n ? end : k);

  const std::string first = chosen.front().body.name;
  for (Split& one : chosen) {
    const int k = static_cast<int>(bodies.size());
    Body& body = one.body;
    if (!hinges.emplace(body.hinge.name, k).second)
      throw ModelError("'" + model.name_ + "' has a hinge called '" + body.hinge.name + "' already, as that of body '" + body.name +
                       "' was: remove it, or give it another name, before '" + body.name + "' is split off");
    const int c = one.carrier.empty() ? -1 : numbers.at(one.carrier);
    body.parent = c;
    if (c >= 0) {
      const MassProperties& left = one.carrier_mass;
      check_mass_properties(one.carrier + "' without '" + body.name, left.mass, left.com, left.about_com);
      bodies[c].mass = left.mass, bodies[c].com = left.com, bodies[c].inertia = left.about_com;
    }
    int at = end;
    for (const std::string& name : one.places)
      if (const auto found = numbers.find(name); at == end && found != numbers.end() && bodies[found->second].parent == c) at = found->second;
    join(before[at], k), join(k, at);
    for (const auto& [name, placement] : one.children)
      if (const auto found = numbers.find(name); found != numbers.end() && bodies[found->second].parent == c)
        bodies[found->second].parent = k, bodies[found->second].hinge.placement = placement;
    for (const auto& [name, pose] : one.nodes)
      if (const auto found = model.node_numbers_.find(name); found != model.node_numbers_.end() && nodes[found->second].body == c)
        nodes[found->second].body = k, nodes[found->second].pose = pose;
    nodes[model.node_numbers_.at(body.name)].name.clear();  // a body again
    numbers[body.name] = k;
    bodies.push_back(std::move(body));
  }
  model.structure_changed(happened(first, chosen.size(), "split off"));
  std::vector<int> order;
  for (int k = after[end]; k != end; k = after[k]) order.push_back(k);
  std::erase_if(nodes, [](const Node& node) { return node.name.empty(); });
  renumber(bodies, nodes, order);
  model.bodies_ = std::move(bodies), model.nodes_ = std::move(nodes);
  model.settle();
}

}  // namespace pycraft
