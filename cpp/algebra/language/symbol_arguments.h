// What a letter is of, beside its model: nodes, a coordinate, a twist within a hinge, ... Each letter's record says which of them it takes.
#pragma once

#include <cstddef>
#include <utility>
#include <variant>
#include <vector>

namespace pycraft {

// B, 𝒥, Λ: node numbers; -1 - k is the frame of body k itself.
struct OfNodes {
  std::vector<int> nodes;
  bool operator==(const OfNodes&) const = default;
};
// Δ, h, Π: a coordinate of the model.
struct OfCoordinate {
  int coordinate;
  auto operator<=>(const OfCoordinate&) const = default;
};
// Δ, h: a twist fixed in the hinge of `body` before its subhinge `position`, in the axes there: one component, 0 to 5, angular first.
struct OfTwist {
  int body, position, component;
  auto operator<=>(const OfTwist&) const = default;
};
// Π: the coordinates of subhinges `from` to `to` - 1 of a body, -1: of every body.
struct OfSubhinges {
  int body, from, to;
  bool operator==(const OfSubhinges&) const = default;
};
// ∂M: the mass properties of a body that it is differentiated by, in their order.
enum class InertiaParameter { mass, com_x, com_y, com_z, inertia_xx, inertia_xy, inertia_xz, inertia_yy, inertia_yz, inertia_zz };
struct OfInertia {
  int body;
  std::vector<InertiaParameter> parameters;
  bool operator==(const OfInertia&) const = default;
};
// ∂(ℳ + J)⁻¹: time along the velocities, or twists and how much of each.
using TwistPlace = std::variant<OfCoordinate, OfTwist>;
using Twists = std::vector<std::pair<double, TwistPlace>>;
struct OfDirection {
  bool time = false;
  Twists twists;
  bool operator==(const OfDirection&) const = default;
};

using SymbolArguments = std::variant<std::monostate, OfNodes, OfCoordinate, OfTwist, OfSubhinges, OfInertia, OfDirection>;

// What a letter takes; a direction's place is a coordinate or a twist, a selection a coordinate or subhinges.
enum class Takes { nothing, nodes, place, selection, inertia, direction };
bool fits(Takes takes, const SymbolArguments& given);

inline SymbolArguments as_arguments(const TwistPlace& place) {
  return std::visit([](const auto& p) { return SymbolArguments(p); }, place);
}
// The place that Δ or h is of.
TwistPlace place_in(const SymbolArguments& given);

size_t hash_of(const SymbolArguments& given);

}  // namespace pycraft
