// A hinge and a pose from what Python gives, each part checked by its name.
#pragma once

#include <string>
#include <vector>

#include "bindings/bindings.h"
#include "model/hinge.h"

namespace pycraft {

Pose<double> pose_from(const py::object& rotation, const py::object& position, const std::string& what);

// By kind and axes, or by subhinges where there are (a sequence of dicts); what is None is left out.
Hinge hinge_from(const std::string& name, const std::string& kind, const std::vector<py::object>& axes, const py::object& point, const py::object& pitch,
                 const py::object& subhinges, const py::object& rotation, const py::object& position, const py::object& rotor_inertia,
                 const py::object& lower, const py::object& upper);

}  // namespace pycraft
