#include "bindings/bindings.h"
#include "bindings/hinge_arguments.h"
#include "model/multibody.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

py::dict subhinge_dict(const Subhinge& s) {
  py::dict d;
  d["kind"] = s.record().name;
  d["axis"] = to_numpy(s.axis);
  d["point"] = to_numpy(s.point);
  d["pitch"] = s.pitch;
  return d;
}

py::dict node_dict(const Node& n) {
  py::dict d;
  d["name"] = n.name;
  d["body"] = n.body;
  d["rotation"] = to_numpy(n.pose.R);
  d["position"] = to_numpy(n.pose.p);
  return d;
}

py::array_t<double> read_only(py::array_t<double> a) {
  a.attr("setflags")(py::arg("write") = false);
  return a;
}

// Read-only, and without a copy: the array keeps the numbers alive.
py::array_t<double> view(const SharedNumbers& numbers) {
  using Held = std::shared_ptr<const void>;
  const py::capsule holder(new Held(numbers.holder()), [](void* held) { delete static_cast<Held*>(held); });
  return read_only(py::array_t<double>(static_cast<py::ssize_t>(numbers.size()), numbers.data(), holder));
}

}  // namespace

void register_multibody(py::module_& m) {
  py::class_<SubhingeRecord>(m, "SubhingeKind", "A kind of subhinge: sizes, and what its coordinates are.")
      .def_property_readonly("name", [](const SubhingeRecord& r) { return r.name; })
      .def_readonly("nq", &SubhingeRecord::nq, "Numbers in q.")
      .def_readonly("nv", &SubhingeRecord::nv, "Velocities.")
      .def_property_readonly("quaternion", [](const SubhingeRecord& r) { return r.quaternion < 0 ? py::object(py::none()) : py::object(py::int_(r.quaternion)); },
                             "Where its unit quaternion (w, x, y, z) begins in its q; None where it has none.")
      .def_readonly("angle", &SubhingeRecord::angle, "Whether its one coordinate is an angle, in radians.")
      .def_readonly("axis", &SubhingeRecord::axis, "Whether it has an axis.")
      .def_readonly("point", &SubhingeRecord::point, "Whether it has a point.")
      .def_readonly("pitch", &SubhingeRecord::pitch, "Whether it has a pitch, in metres per radian.")
      .def("__repr__", [](const SubhingeRecord& r) { return "<subhinge kind '" + std::string(r.name) + "': nq " + std::to_string(r.nq) + ", nv " + std::to_string(r.nv) + ">"; });
  py::class_<HingeRecord>(m, "HingeKind", "A kind of hinge: its subhinges, one after the other; a custom one has any.")
      .def_property_readonly("name", [](const HingeRecord& r) { return r.name; })
      .def_readonly("axes", &HingeRecord::axes, "How many axes it is given.")
      .def_property_readonly("subhinges", [](const HingeRecord& r) {
        py::list names;
        for (const auto& [kind, axis] : r.subhinges) names.append(record_of(kind).name);
        return py::tuple(names);
      }, "Names of their kinds.")
      .def_property_readonly("nv", &HingeRecord::nv, "Degrees of freedom.")
      .def("__repr__", [](const HingeRecord& r) { return "<hinge kind '" + std::string(r.name) + "': " + std::to_string(r.subhinges.size()) + " subhinges>"; });
  py::dict subhinges, hinges;
  for (const SubhingeRecord& row : subhinge_records) subhinges[row.name] = py::cast(&row, py::return_value_policy::reference);
  for (const HingeRecord& row : hinge_records()) hinges[row.name] = py::cast(&row, py::return_value_policy::reference);
  m.attr("subhinge_kinds") = subhinges;
  m.attr("hinge_kinds") = hinges;
  declared<py::class_<Multibody, std::shared_ptr<Multibody>>>(m, "Multibody")
      .def(py::init<std::string, bool, bool>(), py::arg("name") = "multibody", py::arg("keep_welds") = false, py::arg("strict") = false)
      .def(py::init(&Multibody::part_of), py::arg("whole"), py::arg("name"), py::arg("bodies"), py::arg("moving_base"))
      .def_property_readonly("name", &Multibody::name)
      .def_property_readonly("keeps_welds", &Multibody::keeps_welds)
      .def_property_readonly("strict", &Multibody::strict)
      .def_property_readonly("nq", &Multibody::nq, "Numbers in q: 4 for a ball, 7 for a free hinge, else one a coordinate.")
      .def_property_readonly("nv", &Multibody::nv, "Generalized velocities: the degrees of freedom.")
      .def_property_readonly("mass", [](const Multibody& mb) {
        double all = 0;
        for (int k = mb.bodies() - 1; k >= 0; --k) all += mb.body(k).mass;
        return all;
      }, "Of all bodies, kg.")
      .def_property_readonly("_size", &Multibody::bodies)
      .def_property_readonly("_parameters", &Multibody::parameters)
      .def("_add_body",
           [](Multibody& mb, const std::string& name, const std::string& parent, const std::string& hinge, const std::string& hinge_name,
              const std::vector<py::object>& axes, const py::object& point, const py::object& pitch, const py::object& subhinges, const py::object& rotation,
              const py::object& position, const py::object& mass, const py::object& com, const py::object& inertia, const py::object& rotor_inertia,
              const py::object& lower, const py::object& upper) {
             Body b;
             b.name = name;
             b.mass = one_number(mass, ("mass of body '" + name + "'").c_str());
             if (!com.is_none()) b.com = to_vector3(com, ("centre of mass of body '" + name + "'").c_str());
             if (!inertia.is_none()) b.inertia = to_symmetric3(inertia, ("inertia of body '" + name + "'").c_str());
             b.hinge = hinge_from(hinge_name.empty() ? name : hinge_name, hinge, axes, point, pitch, subhinges, rotation, position, rotor_inertia, lower, upper);
             mb.add_body(std::move(b), parent);
           },
           py::arg("name"), py::arg("parent"), py::arg("hinge"), py::arg("hinge_name"), py::arg("axes"), py::arg("point"), py::arg("pitch"),
           py::arg("subhinges"), py::arg("rotation"), py::arg("position"), py::arg("mass"), py::arg("com"), py::arg("inertia"), py::arg("rotor_inertia"),
           py::arg("lower"), py::arg("upper"))
      .def("_remove_body", &Multibody::remove_body, py::arg("name"))
      .def("_add_node", [](Multibody& mb, const std::string& name, const std::string& body, const py::object& rotation, const py::object& position) {
        mb.add_node(name, body, pose_from(rotation, position, "node '" + name + "'"));
      })
      .def("_body_index", &Multibody::body_index)
      .def("_hinge_index", &Multibody::hinge_index)
      .def("_node_index", &Multibody::node_index)
      .def("_body", [](const Multibody& mb, int k) {
        const Body& b = mb.body(k);
        Matrix3<double> I = full(b.inertia);
        py::dict d;
        d["name"] = b.name;
        d["parent"] = b.parent;
        d["mass"] = b.mass;
        d["com"] = to_numpy(b.com);
        d["inertia"] = to_numpy(I);
        py::dict h;
        h["name"] = b.hinge.name;
        h["kind"] = record_of(b.hinge.kind).name;
        py::dict placement;
        placement["rotation"] = to_numpy(b.hinge.placement.R);
        placement["position"] = to_numpy(b.hinge.placement.p);
        h["placement"] = placement;
        py::list subhinges;
        for (const Subhinge& s : b.hinge.subhinges) subhinges.append(subhinge_dict(s));
        h["subhinges"] = subhinges;
        h["rotor_inertia"] = to_numpy(b.hinge.rotor_inertia);
        h["lower"] = to_numpy(b.hinge.lower);
        h["upper"] = to_numpy(b.hinge.upper);
        d["hinge"] = h;
        return d;
      })
      .def("_nodes", [](const Multibody& mb) {
        py::list nodes;
        for (const Node& n : mb.nodes()) nodes.append(node_dict(n));
        return nodes;
      })
      .def("_node", [](const Multibody& mb, const std::string& name) {
        const int i = mb.node_index(name);
        if (i >= static_cast<int>(mb.nodes().size())) throw ModelError("'" + name + "' is a body of '" + mb.name() + "', not a node; bodies are in bodies[...]");
        return node_dict(mb.nodes()[i]);
      })
      .def("_slices", [](const Multibody& mb, int k) {
        const Hinge& h = mb.body(k).hinge;
        return py::make_tuple(py::slice(mb.q_offset(k), mb.q_offset(k) + h.nq(), 1), py::slice(mb.v_offset(k), mb.v_offset(k) + h.nv(), 1));
      })
      .def("_names", [](const Multibody& mb) {
        std::vector<std::string> bodies, hinges;
        for (int k = 0; k < mb.bodies(); ++k) {
          bodies.push_back(mb.body(k).name);
          hinges.push_back(mb.body(k).hinge.name);
        }
        return py::make_tuple(bodies, hinges);
      })
      .def("_hinge_sizes", [](const Multibody& mb) {
        std::vector<std::string> hinges;
        std::vector<int> counts;
        for (int k = 0; k < mb.bodies(); ++k) hinges.push_back(mb.body(k).hinge.name), counts.push_back(mb.body(k).hinge.nv());
        return py::make_tuple(hinges, counts);
      })
      .def_property_readonly("coordinate_names", [](const Multibody& mb) { return mb.structure().coordinate_names; },
                             "One per generalized velocity: the hinge's name, or \"hinge[j]\" where it has several.")
      .def("_set_mass_properties", [](Multibody& mb, int k, const py::object& mass, const py::object& com, const py::object& inertia) {
        const std::string name = mb.body(k).name;
        mb.set_mass_properties(k, one_number(mass, ("mass of body '" + name + "'").c_str()), to_vector3(com, ("centre of mass of body '" + name + "'").c_str()),
                               to_symmetric3(inertia, ("inertia of body '" + name + "'").c_str()));
      })
      .def("_set_placement", [](Multibody& mb, int k, const py::object& rotation, const py::object& position) {
        mb.set_placement(k, pose_from(rotation, position, "the placement of hinge '" + mb.body(k).hinge.name + "'"));
      })
      .def("_set_rotor_inertia", [](Multibody& mb, int k, const py::object& values) {
        mb.set_rotor_inertia(k, list_of_numbers(values, ("rotor inertia of hinge '" + mb.body(k).hinge.name + "'").c_str()));
      })
      .def("_set_limits", [](Multibody& mb, int k, const py::object& lower, const py::object& upper) {
        const std::string name = " limit of hinge '" + mb.body(k).hinge.name + "'";
        mb.set_limits(k, list_of_numbers(lower, ("lower" + name).c_str()), list_of_numbers(upper, ("upper" + name).c_str()));
      })
      .def_property("gravity", [](const Multibody& mb) { return read_only(to_numpy(mb.gravity())); },
                    [](Multibody& mb, const py::object& g) { mb.set_gravity(to_vector3(g, "gravity")); },
                    "Gravity acceleration in world axes, m/s²; zero until it is set.")
      .def_property("q", [](const Multibody& mb) {
        return view(mb.state()->q);
      }, [](Multibody& mb, const py::object& given) {
        mb.set_q(one_state(given, "q"));
      },
         "Generalized coordinates (nq,): copied in when set, a read-only view when read.")
      .def_property("v", [](const Multibody& mb) {
        return view(mb.state()->v);
      }, [](Multibody& mb, const py::object& given) {
        mb.set_v(one_state(given, "v"));
      },
         "Generalized velocities (nv,): copied in when set, a read-only view when read.")
      .def("zero_q", [](const Multibody& mb) { return to_numpy(mb.zero_q()); }, "All coordinates zero, quaternions (1, 0, 0, 0).")
      .def("integrate", [](const Multibody& mb, const py::object& at, const py::object& along) {
        const std::vector<double> q = one_state(at, "q"), dv = one_state(along, "dv");
        mb.check_q(q.data(), q.size());
        mb.check_v(dv.data(), dv.size(), "dv");
        std::vector<double> out(mb.nq());
        mb.integrate(q.data(), dv.data(), out.data());
        return to_numpy(out);
      }, py::arg("q"), py::arg("dv"), "q moved along the velocity dv for unit time: on the group for ball and free hinges (exponential of the body twist).")
      .def("difference", [](const Multibody& mb, const py::object& from, const py::object& to) {
        const std::vector<double> q0 = one_state(from, "q0"), q1 = one_state(to, "q1");
        mb.check_q(q0.data(), q0.size());
        mb.check_q(q1.data(), q1.size());
        std::vector<double> out(mb.nv());
        mb.difference(q0.data(), q1.data(), out.data());
        return to_numpy(out);
      }, py::arg("q0"), py::arg("q1"), "The velocity dv with integrate(q0, dv) = q1.")
      .def("check_q", [](const Multibody& mb, const py::object& given) {
        const std::vector<double> q = one_state(given, "q");
        mb.check_q(q.data(), q.size());
      })
      .def("take_warnings", &Multibody::take_warnings)
      .def("_frame_body", [](const Multibody& mb, const std::string& name) { return mb.node(mb.node_index(name)).body; },
           "The number of the body that a body or node is on, -1 for the base.")
      .def("_outboard_of", &outboard_of, py::arg("root"), py::arg("without"))
      .def("_path_between", &path_between, py::arg("a"), py::arg("b"))
      .def("_follow_base", &Multibody::follow_base)
      .def_property_readonly("_part", [](const Multibody& mb) -> py::object {
        if (!mb.part()) return py::none();
        const PartOf& of = *mb.part();
        mb.nq();  // StaleOperatorError where the whole has changed
        return py::dict(py::arg("bodies") = of.bodies, py::arg("moving_base") = of.moving_base, py::arg("carrier") = of.carrier,
                        py::arg("q_runs") = of.q_runs, py::arg("v_runs") = of.v_runs);
      }, "Of a part: its bodies in the whole, its base and where its coordinates are there; None for a model of its own.")
      // A model whose Python face is gone (an operator held alone) is pickled as its face would be.
      .def("__reduce__", [](const py::object& self) -> py::tuple {
        return py::make_tuple(of_face("model_from_description"), py::make_tuple(of_face("describe")(self)));
      })
      .def_property_readonly("has_rotor_inertia", &Multibody::has_rotor_inertia);
}

}  // namespace pycraft
