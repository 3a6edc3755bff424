// The theorems of the algebra as data: one file feeds the checker, the planner's rewriting and the proofs.
#pragma once

#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "algebra/language/expression.h"
#include "algebra/language/scalar_expression.h"
#include "algebra/language/source.h"

namespace pycraft {

// What a theorem asks for beyond a tree with D invertible; several are joined by |.
enum class Hypothesis : unsigned { no_hypothesis = 0, chain = 1, no_hinge_diagonal = 2, single_dof = 4, constant_hinges = 8, free_root = 16, equal_blocks = 32 };
constexpr Hypothesis operator|(Hypothesis some, Hypothesis more) { return static_cast<Hypothesis>(static_cast<unsigned>(some) | static_cast<unsigned>(more)); }
constexpr bool contains(Hypothesis all, Hypothesis one) { return static_cast<unsigned>(all) & static_cast<unsigned>(one); }
std::vector<std::string> hypothesis_names(Hypothesis hypotheses);
// Those that the model does not meet.
Hypothesis unmet(Hypothesis hypotheses, const Traits& traits);

// How the planner may use it.
enum class Use {
  check,    // stated, checked, not used in planning
  rewrite,  // lhs -> rhs in the normal form
  inverse   // X⁻¹ = rhs: how the planner inverts X, and rhs
};

using Side = std::variant<Expression, Scalar>;

struct Theorem {
  std::string name;
  std::string group;       // the heading it is listed under
  Side lhs, rhs;
  Hypothesis hypotheses = Hypothesis::no_hypothesis;
  std::string source;
  Use use = Use::check;
  bool on_one_path = false;  // stated only for blocks (i, j) with i and j on one path to the base
  bool at_most = false;      // lhs <= rhs instead of lhs = rhs
  std::string waiting;       // not evaluated yet, and for what it waits
  std::string text, latex;   // how it is shown, where the sides spelled out would hide it
  bool one_way = false;      // of a rewriting: its transpose would undo it, and is none
};

// What an expression is made of: the letters of one model.
struct Letters {
  explicit Letters(std::shared_ptr<SkoSource> source, const std::shared_ptr<const Binding>& binding = nullptr);
  std::shared_ptr<SkoSource> source;
  Expression E, phi, phi_tilde, H, M, J, P, P_plus, D, G, K, tau, tau_bar, E_psi, psi, psi_tilde, R, Upsilon, Omega, I;
};

// The letters of a model and the theorems stated with them, each under the heading of its group.
struct Statements : Letters {
  using Letters::Letters;
  // How the last one is shown, where the sides spelled out would hide it.
  void shown(const std::string& text, const std::string& latex) {
    list.back().text = text;
    list.back().latex = latex;
  }
  std::vector<Theorem> list;
  std::string group;
};

// The theorems that hold on every SKO tree, stated for this model.
std::vector<Theorem> sko_theorems(const std::shared_ptr<SkoSource>& source);

}  // namespace pycraft
