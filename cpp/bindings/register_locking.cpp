#include "bindings/register_locking.h"

#include "bindings/hinge_arguments.h"
#include "dynamics/impulsive_locking.h"
#include "model/coalescing.h"
#include "model/locked_hinges.h"
#include "model/lumping.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

using Locks = StructureEdits::LockedHinges;
using Coalescing = StructureEdits::Coalescing;

py::tuple pose_data(const Pose<double>& X) { return py::make_tuple(to_numpy(X.R), to_numpy(X.p)); }
Pose<double> pose_of(const py::handle& data, const std::string& what) {
  const auto pair = py::reinterpret_borrow<py::tuple>(data);
  return pose_from(pair[0], pair[1], what);
}

py::tuple mass_data(const MassProperties& m) { return py::make_tuple(m.mass, to_numpy(m.com), to_numpy(full(m.about_com))); }
MassProperties mass_of(const py::handle& data, const std::string& body) {
  const auto three = py::reinterpret_borrow<py::tuple>(data);
  return {one_number(three[0], ("mass of body '" + body + "'").c_str()), to_vector3(three[1], ("centre of mass of body '" + body + "'").c_str()),
          to_symmetric3(three[2], ("inertia of body '" + body + "'").c_str())};
}

// A hinge as `description()` has it.
Hinge hinge_of(const py::dict& data) {
  const py::dict placement = data["placement"];
  return hinge_from(data["name"].cast<std::string>(), data["kind"].cast<std::string>(), {}, py::none(), py::float_(0.0), data["subhinges"],
                    placement["rotation"], placement["position"], data["rotor_inertia"], data["lower"], data["upper"]);
}

std::vector<std::pair<std::string, Pose<double>>> placed(const py::handle& data) {
  std::vector<std::pair<std::string, Pose<double>>> all;
  for (const auto& [name, pose] : py::reinterpret_borrow<py::dict>(data)) {
    const auto called = name.cast<std::string>();
    all.emplace_back(called, pose_of(pose, "'" + called + "'"));
  }
  return all;
}

py::dict coalesced_data(const Coalescing::Coalesced& one) {
  py::dict children, nodes, d;
  for (const auto& child : one.children) children[py::str(child.name)] = py::make_tuple(pose_data(child.before), pose_data(child.after));
  for (const auto& [name, pose] : one.nodes) nodes[py::str(name)] = pose_data(pose);
  d["carrier"] = one.carrier;
  d["next"] = one.next;
  d["placement"] = pose_data(one.placement);
  d["before"] = mass_data(one.before);
  d["after"] = mass_data(one.after);
  d["children"] = children;
  d["nodes"] = nodes;
  return d;
}

Coalescing::Split split_of(const py::dict& data) {
  Coalescing::Split one;
  const py::dict body = data["body"];
  one.body.name = body["name"].cast<std::string>();
  const MassProperties mass = mass_of(py::make_tuple(body["mass"], body["com"], body["inertia"]), one.body.name);
  one.body.mass = mass.mass, one.body.com = mass.com, one.body.inertia = mass.about_com;
  one.body.hinge = hinge_of(body["hinge"]);
  one.carrier = data["carrier"].cast<std::string>();
  one.places = data["places"].cast<std::vector<std::string>>();
  one.carrier_mass = mass_of(data["mass"], one.carrier);
  one.children = placed(data["children"]);
  one.nodes = placed(data["nodes"]);
  return one;
}

Body body_of(const MassProperties& m, const std::string& name) {
  Body b;
  b.name = name;
  b.mass = m.mass, b.com = m.com, b.inertia = m.about_com;
  return b;
}

}  // namespace

void register_locking(py::module_& m) {
  declared<py::class_<Multibody, std::shared_ptr<Multibody>>>(m, "Multibody")
      .def("_lock", [](Multibody& mb, const std::vector<int>& bodies, const py::object& v) { Locks::lock(mb, bodies, one_state(v, "v")); }, py::arg("bodies"), py::arg("v"))
      .def("_unlock", [](Multibody& mb, const std::vector<py::dict>& hinges) {
        std::vector<Locks::Unlocked> all;
        for (const py::dict& one : hinges) {
          Hinge hinge = hinge_of(one["hinge"]);
          const Pose<double> welded = pose_of(one["welded"], "hinge '" + hinge.name + "'");
          all.push_back({std::move(hinge), one["q"].cast<std::vector<double>>(), welded});
        }
        Locks::unlock(mb, std::move(all));
      }, py::arg("hinges"))
      .def("_stop_at_once", [](const Multibody& mb, const std::vector<int>& bodies) {
        std::vector<char> stops(mb.nv(), 0);
        for (int k : bodies) std::fill(stops.begin() + mb.v_offset(k), stops.begin() + mb.v_offset(k + 1), 1);
        const auto state = mb.state();
        const ModelInUse use(mb);
        const auto [v, impulses] = stop_at_once(mb, {state->q.begin(), state->q.end()}, {state->v.begin(), state->v.end()}, stops);
        return py::make_tuple(to_numpy(v), to_numpy(impulses));
      }, py::arg("bodies"), "Velocities and impulses where the hinges of these bodies stop at once, at the present state.")
      .def("_coalesce", [](Multibody& mb, const std::vector<int>& bodies) {
        py::list all;
        for (const auto& one : Coalescing::coalesce(mb, bodies)) all.append(coalesced_data(one));
        return all;
      }, py::arg("bodies"))
      .def("_split", [](Multibody& mb, const std::vector<py::dict>& bodies) {
        std::vector<Coalescing::Split> all;
        for (const py::dict& one : bodies) all.push_back(split_of(one));
        Coalescing::split(mb, std::move(all));
      }, py::arg("bodies"));
  m.def("_joined", [](const py::tuple& mass, const std::string& name, const py::tuple& X, const py::tuple& welded, const std::string& welded_name) {
    const Body sum = lumped(body_of(mass_of(mass, name), name), pose_of(X, "'" + welded_name + "'"), body_of(mass_of(welded, welded_name), welded_name));
    return mass_data({sum.mass, sum.com, sum.inertia});
  }, py::arg("mass"), py::arg("name"), py::arg("pose"), py::arg("welded"), py::arg("welded_name"), "Mass properties of two bodies welded together, in the first one's frame.");
  m.def("_parted", [](const py::tuple& mass, const std::string& name, const py::tuple& X, const py::tuple& welded, const std::string& welded_name) {
    const Body left = parted(body_of(mass_of(mass, name), name), pose_of(X, "'" + welded_name + "'"), body_of(mass_of(welded, welded_name), welded_name));
    return mass_data({left.mass, left.com, left.inertia});
  }, py::arg("mass"), py::arg("name"), py::arg("pose"), py::arg("welded"), py::arg("welded_name"), "The first body's mass properties without those of the one welded to it.");
}

}  // namespace pycraft
