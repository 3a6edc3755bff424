// The directions in which a multibody model's operators are differentiated, and what becomes of their leaves.
//
//   coordinate i     ∂E = E Δ_i,  Δ_i = crf(h_i),  ∂H = Π_< H Δ_i,   Π_< the coordinates of the same hinge before i's subhinge
//   time             ∂E = E Δ_θ̇, ∂H = Ḣ, velocities along θ̈ as given
//   a fixed twist    inserted in hinge k before subhinge p, in the axes there: as a locked coordinate would be. p = 0 moves the
//                    placement; a twist before a subhinge and its opposite after it turn or shift the subhinge's axis
//   mass, centre of mass, inertia of a body: ∂M;  rotor inertia of a coordinate: ∂J
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

// Symbols that only derivatives bring up.
enum DerivativeSymbolId : int {
  first_derivative_symbol = first_extra + 100,
  inertia_derivative = first_derivative_symbol,  // arguments: body, parameters (see InertiaParameter)
  coordinate_selection,                          // Π, diagonal of ones; arguments: body (-1: all), subhinges from, to; or one coordinate
  direction_twist,                               // the twist of a direction in the axes of its body; arguments as Delta's
  motion_cross,                                  // functions of a vector: crm(x), crf(x), and -[[ñ, f̃], [f̃, 0]] of x = (n; f)
  force_cross,
  momentum_cross_of,
  inverse_tangent                                // ∂(ℳ + J)⁻¹ in plans: operators/inverse_tangent.h
};
const std::vector<SymbolDefinition>& derivative_symbols();

enum InertiaParameter : int { mass_of_body, com_x, com_y, com_z, inertia_xx, inertia_xy, inertia_xz, inertia_yy, inertia_yz, inertia_zz };

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
  InertiaParameter inertia = mass_of_body;
  int rotor = -1;                      // coordinate
};

// Twists (Delta's arguments) and how much of each.
using Twists = std::vector<std::pair<double, std::vector<int>>>;
std::unique_ptr<Direction> twist_direction(const std::shared_ptr<MultibodyOperators>& source, Twists twists);
std::unique_ptr<Direction> coordinate_direction(const std::shared_ptr<MultibodyOperators>& source, int coordinate);
// vdot: a vector of Θ; empty: refused where it is needed.
std::unique_ptr<Direction> time_direction(const std::shared_ptr<MultibodyOperators>& source, const Expression& vdot);
std::unique_ptr<Direction> parameter_direction(const Parameter& parameter);

// The coordinates of a hinge inboard of where a twist stands: these rows of H move with it.
int coordinates_before(const MultibodyOperators& source, const std::vector<int>& twist);

// Theorems of the calculus.
std::vector<Theorem> calculus_theorems(const std::shared_ptr<MultibodyOperators>& source);

}  // namespace pycraft
