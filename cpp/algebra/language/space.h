// The spaces that operators map between. An expression compares spaces (kind, model, blocks), never just shapes.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algebra/language/structure.h"

namespace pycraft {

// Θ generalized coordinates' velocities and forces; V, F stacked body motions and forces; NodesV, NodesF stacked node motions and
// forces; Whitened: where square roots of V -> F operators start (M = M^½ M^½*); Euclidean: R^n, a user's
// own. V and F are dual, NodesV and NodesF too; the others are their own dual. TreeTheta is said in records of letters alone: the space Θ of
// the tree beneath, where a tree has fewer coordinates than that (operators/embedded_operators.h).
enum class SpaceKind { Theta, V, F, Whitened, NodesV, NodesF, Euclidean, TreeTheta };

// How a space is cut into blocks. Block j belongs to a body (-1: to none) and covers [offset, offset + size) of a vector.
struct SpaceLayout {
  struct Block {
    int body, offset, size;
    std::string label;
  };
  const void* owner = nullptr;  // whose numbers these are: identity of a source; null for Euclidean
  const void* bodies = nullptr; // whose bodies it is cut into
  std::string owner_name;
  std::vector<Block> blocks;
  std::vector<std::vector<int>> of_body;  // block indices per body
  int dimension = 0;
  std::vector<int> nodes;                 // which nodes, for NodesV and NodesF
};

class Space {
 public:
  Space() = default;
  Space(SpaceKind kind, std::shared_ptr<const SpaceLayout> layout) : kind_(kind), layout_(std::move(layout)) {}
  static Space euclidean(int dimension);

  explicit operator bool() const { return layout_ != nullptr; }
  SpaceKind kind() const { return kind_; }
  int dimension() const { return layout_->dimension; }
  const SpaceLayout& layout() const { return *layout_; }
  const std::shared_ptr<const SpaceLayout>& layout_pointer() const { return layout_; }
  Space dual() const;
  // Rows of body k: the number of entries a vector has there.
  int body_size(int body) const;
  bool belongs_to_bodies() const { return kind_ != SpaceKind::Euclidean; }

  std::string name() const;         // Θ, V, F, NodesV(tool), R^3
  std::string description() const;  // Θ (7)

  friend bool operator==(const Space& a, const Space& b);

 private:
  SpaceKind kind_ = SpaceKind::Euclidean;
  std::shared_ptr<const SpaceLayout> layout_;
};

// Whether both are cut into blocks of the same bodies. Grouped bodies have the coordinates of the model they are made of, so that both spaces Θ are
// one: vectors and operators go from either to the other. But each is cut into its own bodies, and what has letters of both into none.
bool cut_alike(const Space& a, const Space& b);

// The layouts of a structure's own spaces.
std::shared_ptr<const SpaceLayout> body_layout(const SkoStructure& structure, const void* owner, const std::string& owner_name);
std::shared_ptr<const SpaceLayout> coordinate_layout(const SkoStructure& structure, const void* owner, const std::string& owner_name);
// The coordinates of a layout, cut into groups of its bodies: groups[g] lists them in the order in which group g takes their coordinates.
std::shared_ptr<const SpaceLayout> cut_into_groups(const SpaceLayout& layout, const std::vector<std::vector<int>>& groups, const void* bodies);
// The same blocks, as bodies of another.
std::shared_ptr<const SpaceLayout> cut_into_bodies_of(const SpaceLayout& layout, const void* bodies);

}  // namespace pycraft
