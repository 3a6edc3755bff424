#include "model/frames.h"

#include <algorithm>
#include <mutex>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// How many letters are put in, left out or taken for others between two names.
int distance(const std::string& a, const std::string& b) {
  std::vector<int> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = static_cast<int>(j);
  for (size_t i = 0; i < a.size(); ++i) {
    int diagonal = row[0]++;
    for (size_t j = 0; j < b.size(); ++j) {
      const int best = std::min({row[j] + 1, row[j + 1] + 1, diagonal + (a[i] != b[j])});
      diagonal = row[j + 1];
      row[j + 1] = best;
    }
  }
  return row.back();
}

std::string called(const std::string& name) { return name.empty() ? "the base" : "'" + name + "'"; }

}  // namespace

// ------------------------------------------------------------------ names

std::optional<FrameNumber> FrameTree::of_model(const std::string& name) const {
  try {
    const int nodes = static_cast<int>(model_->nodes().size()), index = model_->node_index(name);
    return index < nodes ? model_->bodies() + index : index - nodes;
  } catch (const ModelError&) {
    return std::nullopt;
  }
}

std::optional<FrameNumber> FrameTree::known(const std::string& name) const {
  if (const auto loose = numbers_.find(name); loose != numbers_.end()) return -2 - loose->second;
  if (name.empty()) return base_frame;
  const auto kept = base_names_.find(name);
  if (kept == base_names_.end()) return of_model(name);
  std::lock_guard<Mutex> lock(mutex_);
  Unknown& of = kept->second;
  const std::uint64_t parameters = model_->parameters();
  const size_t nodes = model_->nodes().size();
  if (of.unknown && of.parameters == parameters && of.nodes == nodes) return base_frame;
  const auto found = of_model(name);
  of = {parameters, nodes, !found};
  return found ? *found : base_frame;
}

FrameNumber FrameTree::find(const std::string& name) const {
  if (const auto number = known(name)) return *number;
  std::vector<std::string> all = {"base"};
  for (int k = 0; k < model_->bodies(); ++k) all.push_back(model_->body(k).name);
  for (const Node& node : model_->nodes()) all.push_back(node.name);
  for (const auto& [loose, _] : numbers_) all.push_back(loose);
  std::string text = "no frame of '" + model_->name() + "' is called '" + name + "'";
  const auto nearest = std::min_element(all.begin(), all.end(), [&](const auto& a, const auto& b) { return distance(a, name) < distance(b, name); });
  if (2 * distance(*nearest, name) <= static_cast<int>(name.size())) text += "; the nearest is '" + *nearest + "'";
  text += all.size() > 12 ? "; there are " + std::to_string(all.size()) + ", as " : "; there are ";
  for (size_t i = 0; i < all.size() && i < 12; ++i) text += (i ? ", " : "") + all[i];
  throw ModelError(text + (all.size() > 12 ? ", ..." : ""));
}

std::string FrameTree::name(FrameNumber frame) const {
  if (frame == base_frame) return "";
  if (frame < base_frame) return loose(frame).name;
  return frame < model_->bodies() ? model_->body(frame).name : model_->nodes()[frame - model_->bodies()].name;
}

void FrameTree::check_new(const std::string& name) const {
  if (name.empty()) throw ModelError("a frame of '" + model_->name() + "' has no name");
  // Looked for one by one: that there is none is said by an error that lists all, which takes a large model long.
  bool taken = numbers_.count(name) || base_names_.count(name);
  for (int k = 0; k < model_->bodies() && !taken; ++k) taken = model_->body(k).name == name;
  for (const Node& node : model_->nodes()) taken |= node.name == name;
  if (taken)
    throw ModelError("'" + model_->name() + "' has a frame called '" + name + "' already; give every frame a name of its own, 'base' and 'world' are the base's");
}

const LooseFrame& FrameTree::loose(const std::string& name) const {
  const auto found = numbers_.find(name);
  if (found != numbers_.end()) return *frames_[found->second];
  const FrameNumber frame = find(name);
  throw ModelError("frame " + called(name) + " of '" + model_->name() + "' is " +
                   (frame == base_frame ? "the base" : frame < model_->bodies() ? "that of a body" : "a node") + ": loose frames alone are moved, attached and removed");
}
LooseFrame& FrameTree::of(const std::string& name) { return const_cast<LooseFrame&>(loose(name)); }

std::vector<std::string> FrameTree::loose_names() const {
  std::vector<std::string> names;
  for (const auto& [name, _] : numbers_) names.push_back(name);
  return names;
}

// ------------------------------------------------------------------ edits

FrameTree::Edit::Edit(FrameTree& frames) : use_(frames.use_) {
  if (!use_.try_edit())
    throw ModelError("the frames of '" + frames.model_->name() + "' are being asked about, in another thread or by a motion that this edit is made from: edit them when that is over");
}

void FrameTree::add(const std::string& name, const std::string& on, const Pose<double>& pose, FrameFunction motion) {
  const Edit edit(*this);
  check_new(name);
  find(on);
  auto frame = std::make_unique<LooseFrame>(LooseFrame{name, on, checked_pose(pose, "frame '" + name + "'"), std::move(motion), edits_ + 1});
  ++edits_;
  const auto place = std::find(frames_.begin(), frames_.end(), nullptr);
  numbers_[name] = static_cast<int>(place - frames_.begin());
  if (place == frames_.end())
    frames_.push_back(std::move(frame));
  else
    *place = std::move(frame);
}

void FrameTree::move(const std::string& name, const Pose<double>& pose) {
  const Edit edit(*this);
  LooseFrame& frame = of(name);
  frame.pose = checked_pose(pose, "frame '" + name + "'");
  frame.motion = nullptr;
  frame.edited = ++edits_;
}

void FrameTree::move(const std::string& name, FrameFunction motion) {
  const Edit edit(*this);
  LooseFrame& frame = of(name);
  frame.motion = std::move(motion);
  frame.edited = ++edits_;
}

void FrameTree::attach(const std::string& name, const std::string& on) {
  const Edit edit(*this);
  LooseFrame& frame = of(name);
  std::string way;
  for (FrameNumber at = find(on); at < base_frame; at = carrier(at)) {
    way += (way.empty() ? "'" : " on '") + loose(at).name + "'";
    if (&loose(at) == &frame)
      throw ModelError("frame '" + name + "' cannot stand on " + (on == name ? "itself" : "'" + on + "', which stands on it: " + way));
  }
  frame.on = on;
  frame.edited = ++edits_;
}

void FrameTree::remove(const std::string& name) {
  const Edit edit(*this);
  loose(name);
  std::string standing;
  int count = 0;
  for (const auto& other : frames_)
    if (other && other->on == name && ++count <= 6) standing += (standing.empty() ? "'" : ", '") + other->name + "'";
  if (count)
    throw ModelError("frame '" + name + "' cannot be removed: " + standing + (count > 6 ? ", ..." : "") + (count == 1 ? " stands" : " stand") +
                     " on it; remove or attach elsewhere what does");
  const auto found = numbers_.find(name);
  frames_[found->second] = nullptr;
  numbers_.erase(found);
  ++edits_;
}

// ------------------------------------------------------------------ the tree

FrameNumber FrameTree::carrier(FrameNumber frame) const {
  if (frame < base_frame) {
    const LooseFrame& of = loose(frame);
    if (const auto on = known(of.on)) return *on;
    throw ModelError("frame '" + of.name + "' of '" + model_->name() + "' stood on '" + of.on + "', which is no longer there: attach it to another frame, or remove it");
  }
  if (frame >= model_->bodies()) return model_->nodes()[frame - model_->bodies()].body;
  return frame == base_frame ? base_frame : model_->body(frame).parent;
}

std::vector<FrameNumber> FrameTree::outside(FrameNumber frame) const {
  std::vector<FrameNumber> all = {frame};
  while (all.back() < base_frame || all.back() >= model_->bodies()) all.push_back(carrier(all.back()));
  return all;
}

FrameStep FrameTree::step(FrameNumber frame) const {
  using enum FrameStep::Kind;
  if (frame >= model_->bodies()) return {fixed, frame, &model_->nodes()[frame - model_->bodies()].pose, 0};
  const LooseFrame& of = loose(frame);
  return of.motion ? FrameStep{moved, frame, nullptr, of.edited} : FrameStep{fixed, frame, &of.pose, of.edited};
}

FramePath FrameTree::path(FrameNumber frame, FrameNumber other) const {
  std::vector<FrameNumber> a = outside(frame), b = outside(other);
  FramePath path;
  int i = a.back(), j = b.back();
  if (i == j) {  // of one body: to the outermost frame that carries both
    while (!a.empty() && !b.empty() && a.back() == b.back()) a.pop_back(), b.pop_back();
  } else {
    a.pop_back(), b.pop_back();
  }
  for (const FrameNumber outer : a) path.up.push_back(step(outer));
  for (const FrameNumber outer : b) path.down.push_back(step(outer));
  // Parents come before their children: of two bodies the later one carries not the other.
  while (i != j) {
    int& later = i > j ? i : j;
    (i > j ? path.up : path.down).push_back({FrameStep::Kind::hinge, later, nullptr, 0});
    later = model_->body(later).parent;
  }
  std::reverse(path.down.begin(), path.down.end());
  return path;
}

}  // namespace pycraft
