// Edits of a structure that stands, as pycraft.models.structure and pycraft.models.grafting call them.
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
           py::arg("v"))
      .def("_relative_motion",
           [](const Multibody& mb, const std::string& body, const std::string& frame) {
             const StructureEdits::Motion motion = StructureEdits::relative_motion(mb, body, frame);
             std::vector<double> twist;
             for (int i = 0; i < 6; ++i) twist.push_back(motion.velocity[i]);
             return py::make_tuple(to_numpy(motion.pose.R), to_numpy(motion.pose.p), to_numpy(twist));
           },
           py::arg("body"), py::arg("frame"), "Rotation, position and twist of a body against a body, node, or the base (empty).")
      .def("_branch",
           [](const Multibody& mb, int root) {
             const StructureEdits::Branch branch = StructureEdits::branch(mb, root);
             StructureEdits::Names names;
             for (int k = branch.first; k < branch.last; ++k) names.bodies.push_back(mb.body(k).name), names.hinges.push_back(mb.body(k).hinge.name);
             for (int i : branch.nodes) names.nodes.push_back(mb.nodes()[i].name);
             return py::make_tuple(names.bodies, names.hinges, names.nodes);
           },
           py::arg("root"), "Names of a body and all outboard of it (-1: of all), of their hinges, and of the nodes on them.")
      .def("_require_new",
           [](const Multibody& mb, const std::vector<std::string>& bodies, const std::vector<std::string>& hinges, const std::vector<std::string>& nodes,
              const std::vector<std::string>& frames, const std::vector<std::string>& loose) {
             StructureEdits::require_new(mb, {bodies, hinges, nodes}, frames, loose);
           },
           py::arg("bodies"), py::arg("hinges"), py::arg("nodes"), py::arg("frames"), py::arg("loose"))
      .def("_graft",
           [](Multibody& mb, const Multibody& source, int root, const std::string& parent, const py::object& rotation, const py::object& position,
              bool places_hinge, const std::vector<std::string>& bodies, const std::vector<std::string>& hinges, const std::vector<std::string>& nodes) {
             StructureEdits::graft(mb, source, root, parent, pose_from(rotation, position, "the placement of the copy"), places_hinge, {bodies, hinges, nodes});
           },
           py::arg("source"), py::arg("root"), py::arg("parent"), py::arg("rotation"), py::arg("position"), py::arg("places_hinge"), py::arg("bodies"),
           py::arg("hinges"), py::arg("nodes"))
      .def("_reroot", &StructureEdits::reroot, py::arg("body"), py::arg("rates"), "Returns the accelerations of the hinges that were turned, by name.");
  register_locking(m);
}

}  // namespace pycraft
