// The alphabet: every operator symbol with its names, spaces and shape. What a symbol's blocks are is the business of its source.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "algebra/language/space.h"
#include "algebra/language/symbol_arguments.h"

namespace pycraft {

class Expression;
class SkoSource;
struct Binding;

// What a symbol looks like in blocks over the tree.
enum class Pattern {
  block_diagonal,  // block (k, k) only
  edges,           // block (parent of k, k) only: strictly triangular, nilpotent
  resolvent,       // (I - edges)⁻¹: unit triangular, applied by a sweep and never formed
  compound,        // an abbreviation: expand() says for what
  function,        // a block-diagonal operator made of another operator's blocks, or of a vector: lower½(X), crm(x)
  vector           // a column: a vector of the codomain that the model provides
};

// Values are computed in groups, each by its own sweep. inverse: what ℳ⁻¹ is applied by where nothing asks for the letters of the articulated
// group, in numbers of the source's own.
struct Group {
  enum : unsigned { kinematics = 1, articulated = 2, composite = 4, compliance = 8, velocities = 16, inverse = 32 };
};

// Every letter there is. A letter's record stands in the room that knows what it is: `sko_symbols` here, the others in operators/.
enum class SymbolId {
  // of any tree of blocks
  E, phi, phi_tilde, H, M, J, P, P_plus, D, G, K, tau, tau_bar, E_psi, psi, psi_tilde, R, Upsilon, Omega,
  lower_half_of,          // a function: lower½(X)
  // of mechanics
  B,
  Jacobian,
  Lambda,
  Delta,                  // crf(h_i) at the body of coordinate i
  Delta_theta_dot,        // crf(H*θ̇)
  V_tilde,                // crm(V)
  V_bar,                  // crf(V)
  momentum_cross,         // -[[ñ, f̃], [f̃, 0]] of (n; f) = M V
  X_world,                // φ(0,k): forces in body k's frame to the world's
  H_dot,                  // Ḣ along θ̇
  theta_dot,              // the model's v
  velocity,               // V = φ*H*θ̇
  coriolis_acceleration,  // a = ṼH*θ̇ + Ḣ*θ̇
  gyroscopic_force,       // b = V̄MV
  gravity_field,          // the gravity acceleration (0; g) seen in every body
  gravity_base,           // -φ*(0,r)(0; g) at the roots: the base acceleration that stands for gravity
  // that only derivatives bring up
  inertia_derivative,
  coordinate_selection,   // Π, diagonal of ones
  direction_twist,        // the twist of a direction in the axes of its body
  motion_cross,           // functions of a vector: crm(x), crf(x), and -[[ñ, f̃], [f̃, 0]] of x = (n; f)
  force_cross,
  momentum_cross_of,
  inverse_tangent,        // ∂(ℳ + J)⁻¹ in plans: operators/inverse_tangent.h
  // of grouped bodies
  inner_phi,              // φ_S
  inner_H,                // H_S
  // of embedded loops
  coordinate_map,         // X: θ̇ = X θ̇_r
  coordinate_map_rate,    // Ẋ along θ̇
  coordinate_map_tangent  // ∂X along an independent coordinate, or one of the tree's
};

// Who has a letter: any tree, a multibody model, expressions that were differentiated, grouped bodies, embedded loops.
enum class LetterKind { sko, mechanics, derivatives, groups, embedding };
constexpr LetterKind kind_of(SymbolId id) {
  return id < SymbolId::B                    ? LetterKind::sko
         : id < SymbolId::inertia_derivative ? LetterKind::mechanics
         : id < SymbolId::inner_phi          ? LetterKind::derivatives
         : id < SymbolId::coordinate_map     ? LetterKind::groups
                                             : LetterKind::embedding;
}

struct Symbol;

// What most letters are not, and what some are.
struct SymbolTraits {
  bool symmetric = false;
  unsigned groups = Group::kinematics;            // what of its values is computed first
  Takes takes = Takes::nothing;
  Expression (*expand)(const Symbol&) = nullptr;  // compounds: the definition
  bool tangent_of_inverse = false;                // ∂(ℳ + J)⁻¹: applied by the derivative of the Riccati sweep
};

// The record of a letter: all that is said of it without numbers.
struct SymbolDefinition : SymbolTraits {
  SymbolDefinition(SymbolId its_id, std::string its_ascii, std::string its_unicode, std::string its_latex, std::string its_meaning, SpaceKind from, SpaceKind to,
                   Pattern its_pattern, SymbolTraits more = {})
      : SymbolTraits(more), id(its_id), ascii(std::move(its_ascii)), unicode(std::move(its_unicode)), latex(std::move(its_latex)),
        meaning(std::move(its_meaning)), domain(from), codomain(to), pattern(its_pattern) {}
  SymbolId id;
  std::string ascii, unicode, latex, meaning;
  SpaceKind domain, codomain;
  Pattern pattern;
  LetterKind kind() const { return kind_of(id); }
};

struct Symbol {
  const SymbolDefinition* definition;
  std::shared_ptr<SkoSource> source;
  std::shared_ptr<const Binding> binding;  // null: the model's state at the time of evaluation
  SymbolArguments arguments;
  std::string argument_text;               // how the arguments are shown
};

inline bool same_letter(const Symbol& a, const Symbol& b) {
  return a.definition == b.definition && a.source == b.source && a.arguments == b.arguments;
}
inline bool operator==(const Symbol& a, const Symbol& b) { return same_letter(a, b) && a.binding == b.binding; }

// The table of the SKO symbols, in the order of SymbolId.
const std::vector<SymbolDefinition>& sko_symbols();
inline const SymbolDefinition& sko_symbol(SymbolId id) { return sko_symbols()[static_cast<size_t>(id)]; }

}  // namespace pycraft
