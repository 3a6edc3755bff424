#include "operators/multibody_operators.h"

#include <algorithm>
#include <mutex>

#include "model/recorded_model.h"
#include "operators/directions.h"
#include "operators/inverse_tangent.h"
#include "operators/rigid_letters.h"

namespace pycraft {

MultibodyOperators::MultibodyOperators(std::shared_ptr<Multibody> model) : SkoSource(model->structure(), model->name()), model_(std::move(model)) {}

Traits MultibodyOperators::traits() const {
  bool constant = true;
  for (int k = 0; k < model_->bodies(); ++k) constant &= model_->body(k).hinge.subhinges.size() <= 1;
  return {structure().is_chain(), structure().single_dof(), constant, model_->has_rotor_inertia(), structure().free_root(), structure().equal_blocks()};
}

std::shared_ptr<const KnownLinks> MultibodyOperators::links() const {
  {
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(links_);
    if (links_ && links_->parameters == parameters()) return links_;
  }
  // Outside the lock: a signal's handler, called in between, may ask for the same. Nobody edits the model meanwhile.
  const auto made = std::make_shared<const KnownLinks>(*model_);
  std::lock_guard<Mutex> lock(mutex_);
  return links_ = made;
}

StateData MultibodyOperators::generic_state() const { return pycraft::generic_state(*model_); }

Space MultibodyOperators::space(SpaceKind kind, const SymbolArguments& arguments) const {
  if (kind != SpaceKind::NodesV && kind != SpaceKind::NodesF) return SkoSource::space(kind, arguments);
  const std::vector<int>& nodes = std::get<OfNodes>(arguments).nodes;
  auto layout = std::make_shared<SpaceLayout>();
  layout->owner = layout->bodies = this;
  layout->owner_name = name();
  layout->nodes = nodes;
  layout->of_body.resize(structure().bodies());
  for (int node : nodes) {
    const Node n = node >= 0 ? model_->node(node) : Node{model_->body(-1 - node).name, -1 - node, Pose<double>::identity()};
    layout->of_body[n.body].push_back(static_cast<int>(layout->blocks.size()));
    layout->blocks.push_back({n.body, layout->dimension, 6, n.name});
    layout->dimension += 6;
  }
  return Space(kind, layout);
}

#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> MultibodyOperators::make_values(S) const { return std::make_unique<RigidValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

bool MultibodyOperators::tangent_of_inverse(const Expression& X, const Expression& tangent, Expression& letter, Expression& of_D) {
  return pycraft::tangent_of_inverse(std::static_pointer_cast<MultibodyOperators>(shared_from_this()), X, tangent, letter, of_D);
}

std::shared_ptr<MultibodyOperators> operators_of(const std::shared_ptr<Multibody>& model) {
  if (auto known = std::static_pointer_cast<MultibodyOperators>(model->operators())) return known;
  auto made = std::make_shared<MultibodyOperators>(model);
  model->keep_operators(made);
  return made;
}

#define PYCRAFT_INSTANTIATE(S)               \
  template class TreeValues<RigidBlocks<S>>; \
  template class RigidValues<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
