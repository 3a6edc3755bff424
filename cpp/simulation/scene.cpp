#include "simulation/scene.h"

#include <algorithm>

#include "runtime/errors.h"
#include "simulation/selection.h"

namespace pycraft {

size_t Scene::find(const std::string& name) const {
  std::vector<std::string> known;
  for (size_t i = 0; i < entries_.size(); ++i) {
    if (entries_[i].name == name) return i;
    known.push_back(entries_[i].name);
  }
  std::string text = "the scene of '" + model_->name() + "' has no effect '" + name + "'";
  const auto near = nearest_names(name, known, 1);
  throw ModelError(text + (near.empty() ? "; it is empty" : "; did you mean '" + near[0] + "'?"));
}

std::string Scene::add(const std::string& name, std::shared_ptr<const Effect> effect, bool on) {
  const auto taken = [&](const std::string& n) { return std::any_of(entries_.begin(), entries_.end(), [&](const SceneEntry& e) { return e.name == n; }); };
  std::string called = name.empty() ? effect->kind() : name;
  if (taken(called) && !name.empty())
    throw ModelError("the scene of '" + model_->name() + "' has an effect '" + name + "' already; give another name, or remove that one first");
  for (int i = 2; taken(called); ++i) called = effect->kind() + "_" + std::to_string(i);
  if (on) refuse_conflicts(called, *effect);
  entries_.push_back({called, std::move(effect), on});
  return called;
}

void Scene::remove(const std::string& name) { entries_.erase(entries_.begin() + static_cast<std::ptrdiff_t>(find(name))); }

void Scene::set_on(const std::string& name, bool on) {
  SceneEntry& entry = entries_[find(name)];
  if (on && !entry.on) refuse_conflicts(name, *entry.effect);
  entry.on = on;
}

namespace {

// Of two effects that are on, one of which keeps loops: the same loop twice, and what is found without the other.
void refuse_beside_loops(const std::string& a, const Declaration& keeps, const std::string& b, const Declaration& other, const Multibody& model) {
  if (!keeps.loops) return;
  if (other.loops) {
    const std::vector<std::string> mine = keeps.loops->kept();
    for (const std::string& loop : other.loops->kept())
      if (std::find(mine.begin(), mine.end(), loop) != mine.end())
        throw ModelError("effects '" + a + "' and '" + b + "' both keep loop '" + loop + "' of '" + model.name() + "'; disable or remove one of them");
  }
  if (other.of_trees)
    throw ModelError("effect '" + b + "' counts the coordinates of the tree, and effect '" + a + "' keeps loops of '" + model.name() + "', which leave fewer: disable or remove one of them");
  if (other.impulse_period > 0)
    throw ModelError("effect '" + b + "' acts by impulses on the coordinates of the tree, and effect '" + a + "' keeps loops of '" + model.name() + "': disable or remove one of them");
}

}  // namespace

void Scene::refuse_conflicts(const std::string& name, const Effect& effect) const {
  const Declaration own = effect.declaration();
  const std::vector<int>& prescribed = own.prescribed;
  for (const SceneEntry& other : entries_) {
    if (!other.on || other.name == name) continue;
    const Declaration others = other.effect->declaration();
    refuse_beside_loops(other.name, others, name, own, *model_), refuse_beside_loops(name, own, other.name, others, *model_);
    const std::vector<int>& claimed = others.prescribed;
    for (int j : prescribed)
      if (std::find(claimed.begin(), claimed.end(), j) != claimed.end())
        throw ModelError("effects '" + other.name + "' and '" + name + "' both prescribe coordinate '" + model_->structure().coordinate_names[j] + "' of '" + model_->name() +
                         "'; disable or remove one of them");
  }
}

HingeTerms hinge_terms(const Scene& scene) {
  HingeTerms terms;
  const auto nv = static_cast<unsigned>(scene.model().nv());
  for (const SceneEntry& entry : scene.entries()) {
    if (!entry.on) continue;
    const Declaration d = entry.effect->declaration();
    for (const HingeTerm& h : d.hinges) {
      if (terms.inertia.empty()) terms.inertia.assign(nv, 0.0), terms.driven.assign(nv, 0);
      terms.inertia[h.coordinate] += h.inertia;
      if (h.damping != 0 || h.stiffness != 0) terms.driven[h.coordinate] = 1;
    }
    for (int j : d.prescribed) {
      if (terms.prescribed.empty()) terms.prescribed.assign(nv, 0);
      terms.prescribed[j] = 1;
    }
  }
  return terms;
}

}  // namespace pycraft
