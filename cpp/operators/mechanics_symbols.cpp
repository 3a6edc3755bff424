// The symbols that mechanics adds, their spaces and what the compound ones abbreviate.
#include "operators/alphabet.h"
#include "operators/derived_operators.h"
#include "operators/multibody_operators.h"

namespace pycraft {

namespace {

Expression node_letter(const Symbol& s, SymbolId id) {
  const Expression e = make_symbol(definition_of(id), s.source, s.arguments, s.argument_text);
  return s.binding ? e.at(s.binding) : e;
}
Expression letter(const Symbol& s, SymbolId id) {
  const Expression e = make_symbol(id, s.source);
  return s.binding ? e.at(s.binding) : e;
}

// 𝒥 = B*φ*H*
Expression expand_jacobian(const Symbol& s) {
  return node_letter(s, SymbolId::B).T() * letter(s, SymbolId::phi).T() * letter(s, SymbolId::H).T();
}
// Λ = (B*ΩB)⁻¹
Expression expand_lambda(const Symbol& s) {
  const Expression b = node_letter(s, SymbolId::B);
  return (b.T() * letter(s, SymbolId::Omega) * b).inv();
}

}  // namespace

const std::vector<SymbolDefinition>& mechanics_symbols() {
  using S = SpaceKind;
  using enum Pattern;
  using enum SymbolId;
  const unsigned moving = Group::kinematics | Group::velocities;
  static const std::vector<SymbolDefinition> table = {
      {B, "B", "B", "\\mathcal{B}", "node pick-off: forces at nodes to forces at their bodies", S::NodesF, S::F, block_diagonal, {.takes = Takes::nodes}},
      {Jacobian, "Jacobian", "𝒥", "\\mathcal{J}", "node Jacobian B*φ*H*", S::Theta, S::NodesV, compound, {.takes = Takes::nodes, .expand = expand_jacobian}},
      {Lambda, "Lambda", "Λ", "\\Lambda", "operational-space inertia (B*ΩB)⁻¹", S::NodesV, S::NodesF, compound, {.symmetric = true, .groups = Group::kinematics | Group::articulated, .takes = Takes::nodes, .expand = expand_lambda}},
      {Delta, "Delta", "Δ", "\\Delta", "crf(h_i) at the body of coordinate i", S::F, S::F, block_diagonal, {.takes = Takes::place}},
      {Delta_theta_dot, "Delta_theta_dot", "Δ_θ̇", "\\Delta_{\\dot\\theta}", "crf(H*θ̇)", S::F, S::F, block_diagonal, {.groups = moving}},
      {V_tilde, "V_tilde", "Ṽ", "\\tilde{\\mathcal{V}}", "crm(V)", S::V, S::V, block_diagonal, {.groups = moving}},
      {V_bar, "V_bar", "V̄", "\\bar{\\mathcal{V}}", "crf(V)", S::F, S::F, block_diagonal, {.groups = moving}},
      {momentum_cross, "momentum_cross", "𝓑", "\\mathscr{B}", "-[[ñ, f̃], [f̃, 0]] of (n; f) = MV", S::V, S::F, block_diagonal, {.groups = moving}},
      {X_world, "X_world", "X", "X", "φ(0,k), forces to world axes about the world's origin", S::F, S::F, block_diagonal, {.groups = moving}},
      {H_dot, "H_dot", "Ḣ", "\\dot{H}", "rate of H along θ̇", S::F, S::Theta, block_diagonal, {.groups = moving}},
      {theta_dot, "theta_dot", "θ̇", "\\dot\\theta", "the model's velocity", S::Euclidean, S::Theta, vector, {.groups = moving}},
      {velocity, "velocity", "V", "\\mathcal{V}", "body velocities φ*H*θ̇", S::Euclidean, S::V, vector, {.groups = moving}},
      {coriolis_acceleration, "a", "a", "\\mathfrak{a}", "Coriolis acceleration ṼH*θ̇ + Ḣ*θ̇", S::Euclidean, S::V, vector, {.groups = moving}},
      {gyroscopic_force, "b", "b", "\\mathfrak{b}", "gyroscopic force V̄MV", S::Euclidean, S::F, vector, {.groups = moving}},
      {gravity_field, "gravity_field", "γ", "\\gamma", "gravity acceleration in every body's frame", S::Euclidean, S::V, vector},
      {gravity_base, "gravity_base", "a₀", "\\mathfrak{a}_0", "-gravity at the roots", S::Euclidean, S::V, vector},
  };
  return table;
}

Expression mechanics_operator(SymbolId id, const std::shared_ptr<SkoSource>& source) {
  return make_symbol(definition_of(id), source);
}

Expression node_operator(SymbolId id, const std::shared_ptr<SkoSource>& source, const std::vector<std::string>& names) {
  if (names.empty()) throw ModelError(definition_of(id).ascii + " takes at least one node");
  const Multibody& model = *mechanics_of(source)->model();
  OfNodes of;
  std::string text;
  for (const std::string& name : names) {
    const int index = model.node_index(name);
    if (model.node(index).body < 0)
      throw ModelError("node '" + name + "' lies on the base of '" + source->name() + "': it does not move and feels no body's force");
    // Nodes are added without renumbering bodies; a body's own frame is told from them by its sign.
    const int nodes = static_cast<int>(model.nodes().size());
    of.nodes.push_back(index < nodes ? index : -1 - (index - nodes));
    text += (text.empty() ? "" : ", ") + name;
  }
  return make_symbol(definition_of(id), source, of, text);
}

Expression delta_operator(const std::shared_ptr<SkoSource>& source, int i) {
  if (i < 0 || i >= source->nv())
    throw ModelError("coordinate " + std::to_string(i) + " of '" + source->name() + "', which has " + std::to_string(source->nv()));
  return make_symbol(definition_of(SymbolId::Delta), source, OfCoordinate{i}, mechanics_of(source)->structure().coordinate_names[i]);
}

}  // namespace pycraft
