// Edits of a structure that stands, as pycraft.models.structure calls them.
#include "bindings/hinge_arguments.h"
#include "bindings/register_locking.h"
#include "model/structure_edits.h"

namespace pycraft {

void register_structure(py::module_& m) {
  declared<py::class_<Multibody, std::shared_ptr<Multibody>>>(m, "Multibody")
      .def("_rehang",
           [](Multibody& mb, const std::string& body, const std::string& parent, const std::string& hinge, const std::string& hinge_name,
              const std::vector<py::object>& axes, const py::object& point, const py::object& pitch, const py::object& subhinges, const py::object& rotation,
              const py::object& position, const py::object& rotor_inertia, const py::object& lower, const py::object& upper, const std::vector<double>& q,
              const std::vector<double>& v) {
             StructureEdits::rehang(mb, body, parent,
                                    hinge_from(hinge_name, hinge, axes, point, pitch, subhinges, rotation, position, rotor_inertia, lower, upper), q, v);
           },
           py::arg("body"), py::arg("parent"), py::arg("hinge"), py::arg("hinge_name"), py::arg("axes"), py::arg("point"), py::arg("pitch"),
           py::arg("subhinges"), py::arg("rotation"), py::arg("position"), py::arg("rotor_inertia"), py::arg("lower"), py::arg("upper"), py::arg("q"),
           py::arg("v"));
  register_locking(m);
}

}  // namespace pycraft
