// The SKO symbols, which any tree of blocks E, H, M, J has, and what the compound ones abbreviate.
#include "algebra/language/expression.h"
#include "algebra/language/source.h"

namespace pycraft {

namespace {

using enum SymbolId;

// The symbol `id` of the same model at the same state.
Expression letter(const Symbol& like, SymbolId id) { return make_symbol(id, like.source, like.binding); }

Expression expand_phi_tilde(const Symbol& s) { return letter(s, E) * letter(s, phi); }
Expression expand_K(const Symbol& s) { return letter(s, E) * letter(s, G); }
Expression expand_tau(const Symbol& s) { return letter(s, G) * letter(s, H); }
Expression expand_tau_bar(const Symbol& s) { return identity() - letter(s, G) * letter(s, H); }
Expression expand_E_psi(const Symbol& s) { return letter(s, E) * (identity() - letter(s, G) * letter(s, H)); }
Expression expand_psi_tilde(const Symbol& s) { return expand_E_psi(s) * letter(s, psi); }
Expression expand_Omega(const Symbol& s) {
  const Expression Hpsi = letter(s, H) * letter(s, psi);
  return Hpsi.T() * letter(s, D).inv() * Hpsi;
}

}  // namespace

const std::vector<SymbolDefinition>& sko_symbols() {
  using S = SpaceKind;
  using enum Pattern;
  const unsigned all = Group::kinematics | Group::articulated;
  static const std::vector<SymbolDefinition> table = {
      {E, "E", "E_φ", "\\mathcal{E}_\\phi", "parent-child transforms φ(p,k), strictly triangular", S::F, S::F, edges},
      {phi, "phi", "φ", "\\phi", "(I-E)⁻¹, gathers forces tip to base", S::F, S::F, resolvent},
      {phi_tilde, "phi_tilde", "φ̃", "\\tilde\\phi", "φ - I", S::F, S::F, compound, {.expand = expand_phi_tilde}},
      {H, "H", "H", "H", "hinge map, rows are hinge coordinates", S::F, S::Theta, block_diagonal},
      {M, "M", "M", "M", "spatial inertias", S::V, S::F, block_diagonal, {.symmetric = true}},
      {J, "J", "J", "J", "hinge-diagonal term: rotor inertia", S::Theta, S::Theta, block_diagonal, {.symmetric = true}},
      {P, "P", "P", "P", "articulated-body inertia", S::V, S::F, block_diagonal, {.symmetric = true, .groups = all}},
      {P_plus, "P_plus", "P⁺", "P^{+}", "articulated inertia felt through the hinge, τ̄P", S::V, S::F, block_diagonal, {.symmetric = true, .groups = all}},
      {D, "D", "D", "\\mathcal{D}", "articulated inertia along the hinge, HPH* + J", S::Theta, S::Theta, block_diagonal, {.symmetric = true, .groups = all}},
      {G, "G", "G", "\\mathcal{G}", "Kalman gain PH*D⁻¹", S::Theta, S::F, block_diagonal, {.groups = all}},
      {K, "K", "K", "\\mathcal{K}", "shifted gain E_φG", S::Theta, S::F, compound, {.groups = all, .expand = expand_K}},
      {tau, "tau", "τ", "\\tau", "GH", S::F, S::F, compound, {.groups = all, .expand = expand_tau}},
      {tau_bar, "tau_bar", "τ̄", "\\bar\\tau", "I - τ", S::F, S::F, compound, {.groups = all, .expand = expand_tau_bar}},
      {E_psi, "E_psi", "E_ψ", "\\mathcal{E}_\\psi", "articulated transforms E_φτ̄", S::F, S::F, compound, {.groups = all, .expand = expand_E_psi}},
      {psi, "psi", "ψ", "\\psi", "(I-E_ψ)⁻¹, gathers forces tip to base through free hinges", S::F, S::F, resolvent, {.groups = all}},
      {psi_tilde, "psi_tilde", "ψ̃", "\\tilde\\psi", "ψ - I", S::F, S::F, compound, {.groups = all, .expand = expand_psi_tilde}},
      {R, "R", "R", "\\mathcal{R}", "composite-body inertia", S::V, S::F, block_diagonal, {.symmetric = true, .groups = Group::kinematics | Group::composite}},
      {Upsilon, "Upsilon", "Υ", "\\Upsilon", "operational-space compliance kernel", S::F, S::V, block_diagonal, {.symmetric = true, .groups = all | Group::compliance}},
      {Omega, "Omega", "Ω", "\\Omega", "extended operational-space compliance ψ*H*D⁻¹Hψ", S::F, S::V, compound, {.symmetric = true, .groups = all, .expand = expand_Omega}},
  };
  return table;
}

}  // namespace pycraft
