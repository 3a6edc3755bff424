// A scene: a model and the effects that act on it, by name, on or off. It starts empty. Nothing acts that was not added, the model's own gravity
// neither.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "simulation/effect.h"

namespace pycraft {

struct SceneEntry {
  std::string name;
  std::shared_ptr<const Effect> effect;
  bool on;
};

class Scene {
 public:
  explicit Scene(std::shared_ptr<const Multibody> model) : model_(std::move(model)) {}

  const Multibody& model() const { return *model_; }
  const std::shared_ptr<const Multibody>& shared_model() const { return model_; }
  const std::vector<SceneEntry>& entries() const { return entries_; }

  // Under a name, or under that of its kind, with a number where that is taken; returns the name. ModelError for a name that is taken, and for
  // two effects that are on and claim the same coordinate, by their names.
  std::string add(const std::string& name, std::shared_ptr<const Effect> effect, bool on = true);
  // ModelError for a name that is not there, with those that are nearest.
  void remove(const std::string& name);
  void set_on(const std::string& name, bool on);
  const SceneEntry& entry(const std::string& name) const { return entries_[find(name)]; }

 private:
  size_t find(const std::string& name) const;
  void refuse_conflicts(const std::string& name, const Effect& effect) const;

  std::shared_ptr<const Multibody> model_;
  std::vector<SceneEntry> entries_;
};

// What the effects that are on do at hinges: terms of D, and what is prescribed.
HingeTerms hinge_terms(const Scene& scene);

}  // namespace pycraft
