// Derivatives of expressions, by rule: an expression again. A direction says what becomes of the leaves; everything else follows.
//
// With the leaves' tangents ∂E = E X, ∂H, ∂M, ∂J (X block diagonal, F→F):
//
//   ∂φ = φ ∂E φ                         ∂R = blockdiag(φ (∂M + E (X R + R X*) E*) φ*)
//   ∂ψ = ψ ∂E_ψ ψ                       ∂E_ψ = E F,  F = X τ̄ - ∂τ
//   ∂P = blockdiag(ψ (∂M + E (X P⁺ + P⁺ X* - G ∂H P⁺ - P⁺ ∂H* G* + G ∂J G*) E*) ψ*)         one sweep, tip to base
//   ∂P⁺ = τ̄ ∂P τ̄* - G ∂H P⁺ - P⁺ ∂H* G* + G ∂J G*
//   ∂D = H ∂P H* + ∂H P H* + H P ∂H* + ∂J                 ∂G = (∂P H* + P ∂H* - G ∂D) D⁻¹
//   ∂Υ = blockdiag(ψ* (∂(H*D⁻¹H) + blockdiag(F* E* Υ E τ̄ + τ̄* E* Υ E F)) ψ)                  one sweep, base to tip
//   ∂blockdiag(ψ X ψ*) = blockdiag(ψ (∂X + E (F Y τ̄* + τ̄ Y F*) E*) ψ*),  Y = blockdiag(ψ X ψ*)
//   ∂(A⁻¹) = -A⁻¹ ∂A A⁻¹      ∂√A = √A lower½(√A⁻¹ ∂A √A⁻*)      products, sums, transposes: as ever
//
// The rules compose: a second derivative is sweeps again, with nothing formed and nothing dense.
#pragma once

#include <memory>

#include "algebra/language/expression.h"
#include "algebra/language/scalar_expression.h"

namespace pycraft {

class Differentiator;

class Direction {
 public:
  virtual ~Direction() = default;
  // X with ∂E = E X for the letter's model; zero where E does not move.
  virtual Expression edge_factor(const Symbol& like) const = 0;
  // ∂ of H, M or J.
  virtual Expression block_tangent(const Symbol& symbol) const = 0;
  // ∂ of a symbol that is no SKO letter, or of a block function of a vector.
  virtual Expression tangent(const Expression& symbol, Differentiator& rules) const = 0;
  // A space's own motion seen from the body, F→F: what frame="world" adds. See in_world.
  virtual Expression frame_motion(const Symbol& like) const = 0;
};

// Applies the rules; shared parts of an expression are differentiated once.
class Differentiator {
 public:
  explicit Differentiator(const Direction& direction);
  ~Differentiator();
  Expression operator()(const Expression& e);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Expression differentiate(const Expression& e, const Direction& direction);
Scalar differentiate(const Scalar& a, const Direction& direction);

// The derivative as seen in world axes about the world's origin, in body axes: d(X_o A X_i⁻¹) = X_o (∂A + W_o A - A W_i) X_i⁻¹.
Expression differentiate_in_world(const Expression& e, const Direction& direction);

// Whose spaces the leaves of e map, where no letter of it says so: of constants, vectors, zeros and identities alone.
Context model_of_spaces(const Expression& e);

}  // namespace pycraft
