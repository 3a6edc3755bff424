// The directions in which a multibody model's operators are differentiated, and what becomes of their leaves.
//
//   coordinate i     ∂E = E Δ_i,  Δ_i = crf(h_i),  ∂H = Π_< H Δ_i,   Π_< the coordinates of the same hinge before i's subhinge
//   time             ∂E = E Δ_θ̇, ∂H = Ḣ, velocities along θ̈ as given
//   a fixed twist    inserted in hinge k before subhinge p, in the axes there: as a locked coordinate would be. p = 0 moves the
//                    placement; a twist before a subhinge and its opposite after it turn or shift the subhinge's axis
//   mass, centre of mass, inertia of a body: ∂M;  rotor inertia of a coordinate: ∂J
//   independent coordinate i of embedded loops: along the tree's velocities w = X e_i, all hinges around the loops moving,
//                    ∂E = E crf(H*w), ∂H = Σ_s Π_<s H crf(H*Π_s w) over subhinges s, and ∂X; tree's θ̇ = X θ̇_r with ∂X, as θ̇_r stays
//   a twist in a hinge of embedded loops: as of the tree, and along the w with which dependent coordinates keep the loops
//
// Of embedded loops H_C = X*H_g, J_C = X*J_g X:  ∂H_C = ∂X*H_g + X*∂H_g,  ∂J_C = ∂X*J_g X + X*∂J_g X + X*J_g ∂X.
//
// What lies inboard in the same hinge moves with what lies outboard: ∂_iΔ_a = Δ_aΔ_i - Δ_iΔ_a where a stands before i. So the leaves are
// closed under differentiation, and second derivatives need no new kernel. Derivatives along ball and free coordinates are along
// quasi-velocities and do not commute.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algebra/theorems/differentiate.h"
#include "operators/multibody_operators.h"

namespace pycraft {

// Records of the letters that only derivatives bring up.
const std::vector<SymbolDefinition>& derivative_symbols();

// A twist fixed in hinge `body` before its subhinge `position`, six numbers, angular first.
struct InsertedTwist {
  int body, position;
  double twist[6];
};

// What diff() takes beside a coordinate: the name of a parameter and how it moves the leaves.
struct Parameter {
  std::shared_ptr<MultibodyOperators> source;
  std::string name;
  std::vector<InsertedTwist> twists;   // placement, axis, point
  int inertia_body = -1;               // mass properties
  InertiaParameter inertia = InertiaParameter::mass;
  int rotor = -1;                      // coordinate
};

std::unique_ptr<Direction> twist_direction(const std::shared_ptr<MultibodyOperators>& source, Twists twists);
std::unique_ptr<Direction> coordinate_direction(const std::shared_ptr<MultibodyOperators>& source, int coordinate);
class EmbeddedOperators;
std::unique_ptr<Direction> independent_direction(const std::shared_ptr<EmbeddedOperators>& source, int coordinate);
// Of a mass property or rotor inertia that of the tree; along twists in hinges dependent coordinates keep the loops.
std::unique_ptr<Direction> parameter_on_loops(const std::shared_ptr<EmbeddedOperators>& source, const Parameter& parameter);
// vdot: a vector of Θ, of embedded loops θ̈_r; empty: refused where it is needed.
std::unique_ptr<Direction> time_direction(const std::shared_ptr<MultibodyOperators>& source, const Expression& vdot, const std::shared_ptr<EmbeddedOperators>& embedded = nullptr);
std::unique_ptr<Direction> parameter_direction(const Parameter& parameter);
Twists twists_of(const Parameter& parameter);

// The coordinates of a hinge inboard of where a twist stands: these rows of H move with it.
int coordinates_before(const MultibodyOperators& source, const TwistPlace& twist);

// Theorems of the calculus.
std::vector<Theorem> calculus_theorems(const std::shared_ptr<MultibodyOperators>& source);

}  // namespace pycraft
