#include "operators/rerooted_tree.h"

#include <algorithm>

#include "numerics/recorded.h"
#include "operators/derived_values.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// The body on the other side of each one's edge when the way to the new root is turned round, -1 of that root.
std::vector<int> turned_parents(const SkoStructure& t, int root) {
  std::vector<int> parent = t.parent;
  for (int k = root, before = -1; k >= 0;) {
    const int inboard = t.parent[k];
    parent[k] = before;
    before = k;
    k = inboard;
  }
  return parent;
}

// Depth first from the new root.
std::vector<int> turned_order(const MultibodyOperators& base, int root) {
  const SkoStructure& t = base.structure();
  if (!base.traits().free_root || !t.equal_blocks()) throw ModelError("'" + base.name() + "' has no free root that could be moved");
  const std::vector<int> parent = turned_parents(t, root);
  std::vector<std::vector<int>> children(t.bodies());
  for (int k = 0; k < t.bodies(); ++k)
    if (parent[k] >= 0) children[parent[k]].push_back(k);
  std::vector<int> order, stack{root};
  while (!stack.empty()) {
    const int k = stack.back();
    stack.pop_back();
    order.push_back(k);
    stack.insert(stack.end(), children[k].rbegin(), children[k].rend());
  }
  return order;
}

// The body whose edge to its parent in the model is that of a body here: its own, or where that is turned the one before it on the way.
int edge_of(const SkoStructure& t, const std::vector<int>& parent, int k) {
  return parent[k] < 0 ? 0 : t.parent[k] == parent[k] ? k : parent[k];
}

SkoStructure turned_structure(const SkoStructure& t, const std::vector<int>& order) {
  const std::vector<int> parent = turned_parents(t, order.front());
  std::vector<int> place(t.bodies());
  for (int i = 0; i < t.bodies(); ++i) place[order[i]] = i;
  SkoStructure s;
  for (int k : order) {
    const int edge = edge_of(t, parent, k);
    s.parent.push_back(parent[k] < 0 ? -1 : place[parent[k]]);
    s.size.push_back(6);
    s.dof.push_back(t.dof[edge]);
    s.body_names.push_back(t.body_names[k]);
    s.hinge_names.push_back(t.hinge_names[edge]);
  }
  s.finish();
  return s;
}

template <class S>
class RerootedValues final : public DerivedValues<S> {
 public:
  explicit RerootedValues(const RerootedTree& source)
      : DerivedValues<S>(source.structure(), source.base()->structure(), source.model()), order_(source.order()) {}

 protected:
  void derive(const RigidBlocks<S>& all) override {
    RigidBlocks<S>& b = this->blocks_;
    const SkoStructure& t = this->whole_;
    const std::vector<int> parent = turned_parents(t, order_.front());
    Pose<S> world = Pose<S>::identity();  // of the new root
    for (int k = order_.front(); k >= 0; k = t.parent[k]) world = all.pose[k] * world;
    factors_.clear();
    for (int i = 0; i < t.bodies(); ++i) {
      const int k = order_[i], edge = edge_of(t, parent, k);
      const bool turned = edge != k && parent[k] >= 0;
      b.inertia[i] = all.inertia[k];
      factors_.push_back((*all.inertia_factors)[k]);
      b.pose[i] = parent[k] < 0 ? world : turned ? inverse(all.pose[edge]) : all.pose[k];
      const Vector6<S> zero = Vector6<S>::zero();
      for (int j = 0, from = t.dof_offset[edge], to = this->tree_.dof_offset[i]; j < t.dof[edge]; ++j) {
        const Vector6<S>& row = all.H[from + j];
        b.H[to + j] = turned ? zero - motion_to_child(inverse(all.pose[edge]), row) : row;
        b.J[to + j] = all.J[from + j];
        b.aligned[to + j] = turned ? -1 : all.aligned[from + j];
      }
    }
    b.inertia_factors = &factors_;
  }

 private:
  const std::vector<int>& order_;
  std::vector<InertiaFactors<S>> factors_;
};

}  // namespace

RerootedTree::RerootedTree(std::shared_ptr<MultibodyOperators> base, int root) : RerootedTree(base, turned_order(*base, root)) {}
RerootedTree::RerootedTree(std::shared_ptr<MultibodyOperators> base, std::vector<int> order)
    : DerivedOperators(turned_structure(base->structure(), order), base->name() + ", another root", base), order_(std::move(order)) {}
#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> RerootedTree::make_values(S) const { return std::make_unique<RerootedValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

}  // namespace pycraft
