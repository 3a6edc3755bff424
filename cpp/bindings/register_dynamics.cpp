// Direct calls on arrays, with an optional leading batch axis and an out=.
#include <optional>

#include "bindings/direct_calls.h"
#include "dynamics/batch_dynamics.h"

namespace pycraft {

void register_dynamics(py::module_& m) {
  m.def("instruction_set", [] { return kernels::instruction_set().name; },
        "The instruction set whose kernels direct calls run: the widest that this machine has, or the one that the environment variable PYCRAFT_ISA names.");
  m.def("instruction_sets", [] {
    std::vector<std::string> names;
    for (const auto& set : kernels::instruction_sets()) names.push_back(set.name);
    return names;
  }, "Those that were built and that this machine has, from narrow to wide.");
  m.def("checked_refinement", [](const py::object& refine, const std::string& residual, Precision precision) {
    const int steps = refinement(refine, residual, precision).steps;
    return steps == Refinement::automatic ? py::object(py::str("auto")) : py::object(py::int_(steps));
  }, py::arg("refine"), py::arg("residual"), py::arg("precision"), "The number of corrections, or 'auto'; EvaluationError for anything else.");
  py::class_<BatchDynamics> dynamics(m, "Dynamics");
  unpicklable(dynamics)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("forward_dynamics", [](BatchDynamics& d, const py::object& q, const py::object& v, const py::object& tau, Form form, const py::object& refine,
                                  const std::string& residual, Precision precision, const std::string& on_singular, const py::object& out, int threads) {
        Arguments given(d.model(), {{"q", q}, {"v", v}, {"tau", tau}});
        const Solving how{form, refinement(refine, residual, precision), on_singular_from_name(on_singular)};
        return written(d.model(), given, out, {d.model().nv()}, [&](double* target) { d.forward_dynamics(given[0], given[1], given[2], how, precision, target, nullptr, threads); });
      }, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"), py::arg("on_singular"), py::arg("out"),
         py::arg("threads") = 1)
      .def("refinement", [](BatchDynamics& d, const py::object& q, const py::object& v, const py::object& tau, Form form, const py::object& refine,
                            const std::string& residual, Precision precision) {
        Arguments given(d.model(), {{"q", q}, {"v", v}, {"tau", tau}});
        const Solving how{form, refinement(refine, residual, precision), OnSingular::raise};
        py::array_t<double> value = output(py::none(), -1, {d.model().nv()});
        double* target = value.mutable_data();
        RefinementReport report;
        {
          const Undisturbed undisturbed(d.model());
          report = d.refinement(given[0], given[1], given[2], how, precision, target);
        }
        const bool corrected = !report.corrections.empty();
        return py::make_tuple(value, report.corrections, corrected ? py::object(py::float_(report.estimated_error)) : py::object(py::none()));
      }, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"))
      .def("mass_matrix_inverse", [](BatchDynamics& d, const py::object& q, Form form, const py::object& refine, const std::string& residual, Precision precision,
                                     const std::string& on_singular, const py::object& out) {
        Arguments given(d.model(), {{"q", q}});
        const Solving how{form, refinement(refine, residual, precision), on_singular_from_name(on_singular)};
        return written(d.model(), given, out, {d.model().nv(), d.model().nv()}, [&](double* target) { d.mass_matrix_inverse(given[0], how, precision, target); });
      }, py::arg("q"), py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"), py::arg("on_singular"), py::arg("out"))
      .def("memory", [](BatchDynamics& d, Form form, Precision precision) {
        size_t bytes = 0;
        at_precision(precision, [&]<class S>(S) { bytes = RigidDynamics<S>(d.model()).bytes(form); });
        return bytes;
      }, py::arg("form"), py::arg("precision"), "Bytes that one forward dynamics works in.")
      .def("inverse_dynamics", [](BatchDynamics& d, const py::object& q, const py::object& v, const py::object& vdot, Precision precision, const py::object& out, int threads) {
        std::vector<std::pair<const char*, py::object>> all = {{"q", q}, {"v", v}};
        const bool moving = !vdot.is_none();
        if (moving) all.emplace_back("vdot", vdot);
        Arguments given(d.model(), all);
        return written(d.model(), given, out, {d.model().nv()}, [&](double* target) {
          const Given accelerations = moving ? given[2] : Given{};
          d.inverse_dynamics(given[0], given[1], moving ? &accelerations : nullptr, precision, target, nullptr, threads);
        });
      }, py::arg("q"), py::arg("v"), py::arg("vdot"), py::arg("precision"), py::arg("out"), py::arg("threads") = 1)
      .def("mass_matrix", [](BatchDynamics& d, const py::object& q, Precision precision, const py::object& out) {
        Arguments given(d.model(), {{"q", q}});
        return written(d.model(), given, out, {d.model().nv(), d.model().nv()}, [&](double* target) { d.mass_matrix(given[0], precision, target); });
      }, py::arg("q"), py::arg("precision"), py::arg("out"))
      .def("jacobian", [](BatchDynamics& d, const std::string& frame, const py::object& q, Precision precision, const py::object& out) {
        const Node node = d.model().node(d.model().node_index(frame));
        Arguments given(d.model(), {{"q", q}});
        return written(d.model(), given, out, {6, d.model().nv()}, [&](double* target) { d.jacobian(node, given[0], precision, target); });
      }, py::arg("frame"), py::arg("q"), py::arg("precision"), py::arg("out"))
      .def("operational_space", [](BatchDynamics& d, bool inverse, const std::vector<std::string>& frames, const py::object& q) -> std::optional<py::array_t<double>> {
        std::vector<Node> nodes;
        for (const std::string& frame : frames) nodes.push_back(d.model().node(d.model().node_index(frame)));
        Arguments given(d.model(), {{"q", q}});
        const int rows = 6 * static_cast<int>(nodes.size());
        bool sure = false;
        const py::array_t<double> result = written(d.model(), given, py::none(), {rows, rows}, [&](double* target) { sure = d.operational_space(inverse, nodes, given[0], target); });
        return sure ? std::optional(result) : std::nullopt;
      }, py::arg("inverse"), py::arg("frames"), py::arg("q"), "B*ΩB of these nodes or its inverse; None where kernels are not sure.")
      .def("pose", [](BatchDynamics& d, const std::string& frame, const py::object& q) {
        const Node node = d.model().node(d.model().node_index(frame));
        Arguments given(d.model(), {{"q", q}});
        return written(d.model(), given, py::none(), {4, 4}, [&](double* target) { d.pose(node, given[0], target); });
      }, py::arg("frame"), py::arg("q"))
      .def("energy", [](BatchDynamics& d, const py::object& q, const py::object& v, const py::object& datum) {
        const Vector3<double> origin = to_vector3(datum, "datum");
        Arguments given(d.model(), {{"q", q}, {"v", v}});
        return written(d.model(), given, py::none(), {2}, [&](double* target) { d.energy(given[0], given[1], origin, target); });
      }, py::arg("q"), py::arg("v"), py::arg("datum"));
}

}  // namespace pycraft
