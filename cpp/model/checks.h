// What a model's parts must be, checked in one place for everything that takes them: bodies being added, setters, descriptions, files.
// Each throws a ModelError that names the body, hinge or node, the number, and what would do.
#pragma once

#include <string>
#include <unordered_map>

#include "model/multibody.h"

namespace pycraft {

// Up to six digits, for errors.
std::string short_number(double x);

// ModelError for a name that `known` has not: what there is, up to a dozen.
[[noreturn]] void throw_unknown(const char* what, const std::string& name, const std::string& model, const std::unordered_map<std::string, int>& known);

// The pose, its rotation brought to the nearest orthogonal matrix where it is one to six digits only. `what` names it: "node 'tip'". Throws
// for entries that are not finite, scalings, shears and reflections.
Pose<double> checked_pose(const Pose<double>& pose, const std::string& what);

// A pose given in a frame, as one in the axes that the frame's own pose is given in; both are checked. On a frame that is those axes the pose
// stays what it is to the last bit, and on a long way of frames the rounding of rotations does not gather: a copy is the model bit for bit.
Pose<double> placed_on(const Pose<double>& frame, const Pose<double>& pose, const std::string& what);

// The hinge with everything settled that it leaves open: one rotor inertia stands for all coordinates, none is zeros. Throws for subhinges
// that are not those of its kind, rotor inertias and limits of another number or out of order.
Hinge checked_hinge(Hinge hinge);
std::vector<double> checked_rotor_inertia(const Hinge& hinge, std::vector<double> values);
// One pair a subhinge, lower ≤ upper; -inf and inf are no limit.
void check_limits(const Hinge& hinge, const std::vector<double>& lower, const std::vector<double>& upper);

// The hinge's coordinates: finite, quaternions with a direction.
void check_configuration(const Hinge& hinge, const double* q);
// Velocities, accelerations or forces of the hinge, by the name of `what`: finite.
void check_rates(const Hinge& hinge, const double* v, const char* what);

// Finite, a mass that is not negative, an inertia that is positive semidefinite. Returns what is wrong with the triangle inequality, or "".
std::string check_mass_properties(const std::string& body, double mass, const Vector3<double>& com, const Symmetric3<double>& inertia);

}  // namespace pycraft
