#include "operators/multibody_operators.h"

#include <algorithm>

#include "operators/rigid_values.h"

namespace pycraft {

MultibodyOperators::MultibodyOperators(std::shared_ptr<Multibody> model) : SkoSource(model->structure(), model->name()), model_(std::move(model)) {}

Traits MultibodyOperators::traits() const {
  bool constant = true;
  for (int k = 0; k < model_->bodies(); ++k) constant &= model_->body(k).hinge.subhinges.size() <= 1;
  return {structure().is_chain(), structure().single_dof(), constant, model_->has_rotor_inertia(), structure().free_root()};
}

Space MultibodyOperators::space(SpaceKind kind, const std::vector<int>& nodes) const {
  if (kind != SpaceKind::NodesV && kind != SpaceKind::NodesF) return SkoSource::space(kind, nodes);
  auto layout = std::make_shared<SpaceLayout>();
  layout->owner = this;
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

std::unique_ptr<SkoValues<double>> MultibodyOperators::make_values(double) const { return std::make_unique<RigidValues<double>>(structure(), *model_); }
std::unique_ptr<SkoValues<Extended>> MultibodyOperators::make_values(Extended) const { return std::make_unique<RigidValues<Extended>>(structure(), *model_); }
std::unique_ptr<SkoValues<Quad>> MultibodyOperators::make_values(Quad) const { return std::make_unique<RigidValues<Quad>>(structure(), *model_); }

std::shared_ptr<MultibodyOperators> operators_of(const std::shared_ptr<Multibody>& model) {
  if (auto known = std::static_pointer_cast<MultibodyOperators>(model->operators())) return known;
  auto made = std::make_shared<MultibodyOperators>(model);
  model->keep_operators(made);
  return made;
}

// ------------------------------------------------------------------ blocks of the symbols of mechanics

namespace {

template <class S>
void put(const Matrix3<S>& A, S* out, int columns, int row, int column) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[(row + i) * columns + column + j] = A(i, j);
}

// [[ω̃, ṽ], [0, ω̃]]
template <class S>
void cross_force_block(const Vector6<S>& V, S* out) {
  std::fill_n(out, 36, S(0));
  put(skew(V.angular), out, 6, 0, 0);
  put(skew(V.linear), out, 6, 0, 3);
  put(skew(V.angular), out, 6, 3, 3);
}
// [[ω̃, 0], [ṽ, ω̃]]
template <class S>
void cross_motion_block(const Vector6<S>& V, S* out) {
  std::fill_n(out, 36, S(0));
  put(skew(V.angular), out, 6, 0, 0);
  put(skew(V.linear), out, 6, 3, 0);
  put(skew(V.angular), out, 6, 3, 3);
}
// φ = [[R, l~R], [0, R]]
template <class S>
void force_transform_block(const Pose<S>& X, S* out, int columns, int column) {
  for (int i = 0; i < 6; ++i) std::fill_n(out + i * columns + column, 6, S(0));
  put(X.R, out, columns, 0, column);
  put(skew(X.p) * X.R, out, columns, 0, column + 3);
  put(X.R, out, columns, 3, column + 3);
}

}  // namespace

template <class S>
void RigidValues<S>::block(const Symbol& symbol, int k, S* out) const {
  const RigidBlocks<S>& b = this->blocks_;
  const SkoStructure& tree = this->tree_;
  switch (symbol.definition->id) {
    case MechanicsSymbolId::B: {
      // Columns: the forces of the nodes on body k, in the order they were named.
      std::vector<int> here;
      for (int node : symbol.arguments)
        if ((node >= 0 ? model_.node(node).body : -1 - node) == k) here.push_back(node);
      const int columns = 6 * static_cast<int>(here.size());
      for (size_t j = 0; j < here.size(); ++j)
        force_transform_block(here[j] >= 0 ? cast<S>(model_.node(here[j]).pose) : Pose<S>::identity(), out, columns, 6 * static_cast<int>(j));
      return;
    }
    case Delta: {
      const int i = symbol.arguments[0];
      if (i >= tree.dof_offset[k] && i < tree.dof_offset[k + 1])
        cross_force_block(b.H[i], out);
      else
        std::fill_n(out, 36, S(0));
      return;
    }
    case Delta_theta_dot: cross_force_block(velocities_.relative[k], out); return;
    case V_tilde: cross_motion_block(velocities_.V[k], out); return;
    case V_bar: cross_force_block(velocities_.V[k], out); return;
    case momentum_cross: {
      const Vector6<S> h = b.inertia[k] * velocities_.V[k];
      std::fill_n(out, 36, S(0));
      put(S(-1) * skew(h.angular), out, 6, 0, 0);
      put(S(-1) * skew(h.linear), out, 6, 0, 3);
      put(S(-1) * skew(h.linear), out, 6, 3, 0);
      return;
    }
    case X_world: force_transform_block(world_[k], out, 6, 0); return;
    case H_dot:
      for (int j = tree.dof_offset[k]; j < tree.dof_offset[k + 1]; ++j)
        for (int i = 0; i < 6; ++i) out[(j - tree.dof_offset[k]) * 6 + i] = velocities_.H_dot[j][i];
      return;
    default: b.block(symbol.definition->id, k, out);
  }
}

template <class S>
void RigidValues<S>::vector(const Symbol& symbol, S* out) const {
  const SkoStructure& tree = this->tree_;
  const auto copy = [&](const std::vector<Vector6<S>>& from) {
    for (int k = 0; k < tree.bodies(); ++k)
      for (int i = 0; i < 6; ++i) out[6 * k + i] = from[k][i];
  };
  switch (symbol.definition->id) {
    case theta_dot: std::copy(v_.begin(), v_.end(), out); return;
    case velocity: copy(velocities_.V); return;
    case coriolis_acceleration: copy(velocities_.a); return;
    case gyroscopic_force: copy(velocities_.b); return;
    default: {
      const bool base = symbol.definition->id == gravity_base;
      const Vector6<S> g{Vector3<S>::zero(), compiled_->gravity};
      std::vector<Vector6<S>> field(tree.bodies(), Vector6<S>::zero());
      for (int k = 0; k < tree.bodies(); ++k) {
        const int p = tree.parent[k];
        if (p < 0)
          field[k] = motion_to_child(this->blocks_.pose[k], base ? S(-1) * g : g);
        else if (!base)
          field[k] = motion_to_child(this->blocks_.pose[k], field[p]);
      }
      copy(field);
    }
  }
}

template class RigidValues<double>;
template class RigidValues<Extended>;
template class RigidValues<Quad>;

}  // namespace pycraft
