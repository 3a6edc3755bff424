// The alphabet: every operator symbol with its names, spaces and shape. What a symbol's blocks are is the business of its source.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algebra/language/space.h"

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

// Values are computed in groups, each by its own sweep.
struct Group {
  enum : unsigned { kinematics = 1, articulated = 2, composite = 4, compliance = 8, velocities = 16 };
};

// The SKO symbols, which any tree of blocks has. Mechanics adds its own, from first_extra on.
enum SymbolId : int { E, phi, phi_tilde, H, M, J, P, P_plus, D, G, K, tau, tau_bar, E_psi, psi, psi_tilde, R, Upsilon, Omega, lower_half_of, first_extra };

struct Symbol;

struct SymbolDefinition {
  int id;
  std::string ascii, unicode, latex, meaning;
  SpaceKind domain, codomain;
  Pattern pattern;
  bool symmetric = false;
  unsigned groups = Group::kinematics;
  Expression (*expand)(const Symbol&) = nullptr;  // compounds: the definition
  bool tangent_of_inverse = false;                // ∂(ℳ + J)⁻¹: applied by the derivative of the Riccati sweep
};

struct Symbol {
  const SymbolDefinition* definition;
  std::shared_ptr<SkoSource> source;
  std::shared_ptr<const Binding> binding;  // null: the model's state at the time of evaluation
  std::vector<int> arguments;              // a coordinate, or node numbers
  std::string argument_text;               // how the arguments are shown
};

inline bool same_letter(const Symbol& a, const Symbol& b) {
  return a.definition == b.definition && a.source == b.source && a.arguments == b.arguments;
}
inline bool operator==(const Symbol& a, const Symbol& b) { return same_letter(a, b) && a.binding == b.binding; }

// The table of the SKO symbols, in the order of SymbolId.
const std::vector<SymbolDefinition>& sko_symbols();

}  // namespace pycraft
