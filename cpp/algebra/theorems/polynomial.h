// The normal form: noncommutative polynomials in the letters of the algebra, rewritten by the theorems marked `rewrite`.
// Two expressions with the same normal form are equal by those theorems. The converse is not claimed.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "algebra/language/expression.h"

namespace pycraft {

// Letters are numbered; a word is a product of letters, the empty word an identity.
using Word = std::vector<int>;
using Polynomial = std::map<Word, Coefficient>;

// The letters met so far: each an expression that lowering leaves whole.
class Alphabet {
 public:
  int letter(const Expression& atom);
  const Expression& atom(int letter) const { return atoms_[letter]; }
  // (symbol id, transposed, inverted) of a symbol's letter as one number, for matching rules; -1 for anything else.
  int code(int letter) const { return codes_[letter]; }
  const std::vector<int>& codes() const { return codes_; }  // of all letters
  // The letter with this code of the same model at the same state as another letter.
  int sibling(int letter, int code);
  // The letter's inverse (a letter again).
  int inverse_of(int letter);
  bool zero_letter(int letter) const { return zero_[letter]; }  // J of a model without rotor inertia

 private:
  std::vector<Expression> atoms_;
  std::vector<int> codes_;
  std::vector<char> zero_;
  std::unordered_map<Expression, int, ExpressionHash> numbers_;
  std::map<std::pair<int, int>, int> siblings_;
};

inline int letter_code(SymbolId id, bool transposed, bool inverted) { return 4 * static_cast<int>(id) + 2 * transposed + inverted; }

// Nothing where the expansion would grow beyond a few hundred words: the planner then keeps what was typed.
std::optional<Polynomial> normal_form(const Expression& e, Alphabet& alphabet);

// A polynomial as an expression again.
Expression to_expression(const Polynomial& p, const Alphabet& alphabet, const Space& domain, const Space& codomain);

// Whether both have the same normal form.
bool equal_by_theorems(const Expression& a, const Expression& b);

}  // namespace pycraft
