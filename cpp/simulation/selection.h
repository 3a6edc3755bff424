// What an effect acts on, by names: of hinges, of coordinates ("elbow[1]"), of bodies and nodes, or patterns of a shell ("left_*", "finger?").
// A name that is not there is a ModelError with those that are nearest to it, and says which effect asked.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "model/multibody.h"

namespace pycraft {

// The names that are nearest to one, the nearest first: those that most of its letters fit.
std::vector<std::string> nearest_names(const std::string& name, const std::vector<std::string>& known, size_t most = 3);
// Whether a name fits a pattern: * any letters, ? any one, [abc] one of these, [a-c] one from a to c, [!abc] none of these.
bool fits_pattern(const std::string& name, const std::string& pattern);

using Names = std::optional<std::vector<std::string>>;  // none: all

// The coordinates of the hinges, or coordinates, of these names, each once and in the order of the names. A hinge that has none, locked or a weld,
// is refused where it is named, but for welds_too: then it adds none.
std::vector<int> coordinates_named(const Multibody& model, const Names& names, const std::string& effect, bool welds_too = false);
// The bodies that hinges of these names move.
std::vector<int> hinges_named(const Multibody& model, const Names& names, const std::string& effect);
// The bodies of these names.
std::vector<int> bodies_named(const Multibody& model, const Names& names, const std::string& effect);
// A node, or a body as a node; "" is the base.
Node node_named(const Multibody& model, const std::string& name, const std::string& effect);

// One number for all, or one for each of so many coordinates: `what` they are, for errors. ModelError for another count, and for what is not finite.
std::vector<double> for_each(std::vector<double> values, size_t count, const std::string& what);
// The same of numbers that are not negative.
std::vector<double> not_negative(std::vector<double> values, size_t count, const std::string& what);

// A subhinge: whose body it moves, and where its coordinates are.
struct SubhingePlace {
  int body, subhinge;  // numbered within the hinge
  SubhingeKind kind;
  int q, v;
};
SubhingePlace subhinge_of_coordinate(const Multibody& model, int coordinate);

// Where in q and v a coordinate of a pin, slider or screw is.
struct SingleCoordinate {
  int q, v;
};
// Coordinates that effects on single ones act on; where none are named those of balls and free subhinges are passed over, else they are refused.
std::vector<SingleCoordinate> single_coordinates(const Multibody& model, const Names& hinges, const std::string& effect);

}  // namespace pycraft
