#include "algebra/language/space.h"

namespace pycraft {

namespace {

std::shared_ptr<const SpaceLayout> tree_layout(const std::vector<int>& sizes, const std::vector<int>& offsets,
                                               const std::vector<std::string>& labels, const void* owner, const std::string& owner_name) {
  auto layout = std::make_shared<SpaceLayout>();
  layout->owner = layout->bodies = owner;
  layout->owner_name = owner_name;
  for (int k = 0; k < static_cast<int>(sizes.size()); ++k) {
    layout->blocks.push_back({k, offsets[k], sizes[k], labels[k]});
    layout->of_body.push_back({k});
  }
  layout->dimension = offsets.back();
  return layout;
}

}  // namespace

std::shared_ptr<const SpaceLayout> body_layout(const SkoStructure& s, const void* owner, const std::string& owner_name) {
  return tree_layout(s.size, s.offset, s.body_names, owner, owner_name);
}

std::shared_ptr<const SpaceLayout> coordinate_layout(const SkoStructure& s, const void* owner, const std::string& owner_name) {
  return tree_layout(s.dof, s.dof_offset, s.hinge_names, owner, owner_name);
}

std::shared_ptr<const SpaceLayout> cut_into_groups(const SpaceLayout& layout, const std::vector<std::vector<int>>& groups, const void* bodies) {
  auto cut = std::make_shared<SpaceLayout>(layout);
  cut->bodies = bodies;
  cut->of_body.assign(groups.size(), {});
  for (size_t g = 0; g < groups.size(); ++g)
    for (int k : groups[g])
      for (int block : layout.of_body[k]) {
        cut->blocks[block].body = static_cast<int>(g);
        cut->of_body[g].push_back(block);
      }
  return cut;
}

std::shared_ptr<const SpaceLayout> cut_into_bodies_of(const SpaceLayout& layout, const void* bodies) {
  auto cut = std::make_shared<SpaceLayout>(layout);
  cut->bodies = bodies;
  return cut;
}

bool cut_alike(const Space& a, const Space& b) { return a.belongs_to_bodies() && b.belongs_to_bodies() && a.layout().bodies == b.layout().bodies; }

Space Space::euclidean(int dimension) {
  auto layout = std::make_shared<SpaceLayout>();
  layout->blocks.push_back({-1, 0, dimension, ""});
  layout->dimension = dimension;
  return Space(SpaceKind::Euclidean, layout);
}

Space Space::dual() const {
  switch (kind_) {
    case SpaceKind::V: return Space(SpaceKind::F, layout_);
    case SpaceKind::F: return Space(SpaceKind::V, layout_);
    case SpaceKind::NodesV: return Space(SpaceKind::NodesF, layout_);
    case SpaceKind::NodesF: return Space(SpaceKind::NodesV, layout_);
    default: return *this;
  }
}

int Space::body_size(int body) const {
  int rows = 0;
  for (int j : layout_->of_body[body]) rows += layout_->blocks[j].size;
  return rows;
}

std::string Space::name() const {
  switch (kind_) {
    case SpaceKind::Theta: return "Θ";
    case SpaceKind::V: return "V";
    case SpaceKind::F: return "F";
    case SpaceKind::Whitened: return "W";
    case SpaceKind::Euclidean: return "R^" + std::to_string(dimension());
    default: break;
  }
  std::string text = kind_ == SpaceKind::NodesV ? "NodesV(" : "NodesF(";
  for (size_t j = 0; j < layout_->blocks.size(); ++j) {
    if (j == 3 && layout_->blocks.size() > 4) return text + ", ... " + std::to_string(layout_->blocks.size()) + " nodes)";
    text += (j ? ", " : "") + layout_->blocks[j].label;
  }
  return text + ")";
}

std::string Space::description() const {
  if (kind_ == SpaceKind::Euclidean) return name();
  return name() + " (" + std::to_string(dimension()) + ")";
}

bool operator==(const Space& a, const Space& b) {
  if (a.layout_ == b.layout_) return a.kind_ == b.kind_;
  if (!a.layout_ || !b.layout_ || a.kind_ != b.kind_) return false;
  if (a.kind_ == SpaceKind::Euclidean) return a.dimension() == b.dimension();
  if (a.kind_ == SpaceKind::Theta) return a.layout_->owner == b.layout_->owner;
  const bool nodes = a.kind_ == SpaceKind::NodesV || a.kind_ == SpaceKind::NodesF;
  return nodes && a.layout_->owner == b.layout_->owner && a.layout_->nodes == b.layout_->nodes;
}

}  // namespace pycraft
