// Direct calls on arrays, with an optional leading batch axis and an out=. One pool of workspaces per model and scalar.
#include "bindings/direct_calls.h"
#include "dynamics/rigid_dynamics.h"

namespace pycraft {

namespace {

using Dynamics = DirectCalls<RigidDynamics>;

void check_form(const std::string& form, int refine) {
  if (form != "fast") throw EvaluationError("form '" + form + "' of the articulated-inertia sweep is not there; there is 'fast'");
  if (refine != 0) throw EvaluationError("refine=" + std::to_string(refine) + ": refinement is not there yet; there is refine=0");
}

}  // namespace

void register_dynamics(py::module_& m) {
  py::class_<Dynamics>(m, "Dynamics")
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("forward_dynamics", [](Dynamics& d, const py::object& q, const py::object& v, const py::object& tau, const std::string& form, int refine,
                                  const std::string& precision, const py::object& out) {
        check_form(form, refine);
        const Multibody& mb = d.model();
        const int nq = mb.nq(), nv = mb.nv();
        const Argument a = argument(q, nq, "q", mb), b = argument(v, nv, "v", mb), c = argument(tau, nv, "tau", mb);
        const int batch = common_batch({&a, &b, &c});
        check_states(mb, a, batch);
        check_velocities(mb, b, batch, "v");
        check_velocities(mb, c, batch, "tau");
        return run(d, precision, {{&a, nq}, {&b, nv}, {&c, nv}}, output(out, batch, {nv}), nv, batch,
                   [](auto& w, auto in, auto* y) { w.forward_dynamics(in[0], in[1], in[2], y); });
      }, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("form"), py::arg("refine"), py::arg("precision"), py::arg("out"))
      .def("inverse_dynamics", [](Dynamics& d, const py::object& q, const py::object& v, const py::object& vdot, const std::string& precision, const py::object& out) {
        const Multibody& mb = d.model();
        const int nq = mb.nq(), nv = mb.nv();
        const Argument a = argument(q, nq, "q", mb), b = argument(v, nv, "v", mb);
        if (vdot.is_none()) {
          const int batch = common_batch({&a, &b});
          check_states(mb, a, batch);
          check_velocities(mb, b, batch, "v");
          return run(d, precision, {{&a, nq}, {&b, nv}}, output(out, batch, {nv}), nv, batch,
                     [](auto& w, auto in, auto* y) { w.inverse_dynamics(in[0], in[1], nullptr, y); });
        }
        const Argument c = argument(vdot, nv, "vdot", mb);
        const int batch = common_batch({&a, &b, &c});
        check_states(mb, a, batch);
        check_velocities(mb, b, batch, "v");
        check_velocities(mb, c, batch, "vdot");
        return run(d, precision, {{&a, nq}, {&b, nv}, {&c, nv}}, output(out, batch, {nv}), nv, batch,
                   [](auto& w, auto in, auto* y) { w.inverse_dynamics(in[0], in[1], in[2], y); });
      }, py::arg("q"), py::arg("v"), py::arg("vdot"), py::arg("precision"), py::arg("out"))
      .def("mass_matrix", [](Dynamics& d, const py::object& q, bool inverse, const std::string& precision, const py::object& out) {
        const Multibody& mb = d.model();
        const int nq = mb.nq(), nv = mb.nv();
        const Argument a = argument(q, nq, "q", mb);
        check_states(mb, a, a.batch);
        return run(d, precision, {{&a, nq}}, output(out, a.batch, {nv, nv}), nv * nv, a.batch, [inverse](auto& w, auto in, auto* y) {
          if (inverse)
            w.mass_matrix_inverse(in[0], y);
          else
            w.mass_matrix(in[0], y);
        });
      }, py::arg("q"), py::arg("inverse"), py::arg("precision"), py::arg("out"))
      .def("jacobian", [](Dynamics& d, const std::string& frame, const py::object& q, const std::string& precision, const py::object& out) {
        const Multibody& mb = d.model();
        const Node node = mb.node(mb.node_index(frame));
        const int nq = mb.nq(), nv = mb.nv();
        const Argument a = argument(q, nq, "q", mb);
        check_states(mb, a, a.batch);
        return run(d, precision, {{&a, nq}}, output(out, a.batch, {6, nv}), 6 * nv, a.batch, [&](auto& w, auto in, auto* y) { w.jacobian(node, in[0], y); });
      }, py::arg("frame"), py::arg("q"), py::arg("precision"), py::arg("out"))
      .def("pose", [](Dynamics& d, const std::string& frame, const py::object& q) {
        const Multibody& mb = d.model();
        const Node node = mb.node(mb.node_index(frame));
        const Argument a = argument(q, mb.nq(), "q", mb);
        check_states(mb, a, a.batch);
        py::array_t<double> out = output(py::none(), a.batch, {4, 4});
        return run(d, "double", {{&a, mb.nq()}}, out, 16, a.batch, [&](auto& w, auto in, auto* y) {
          const auto X = w.pose(node, in[0]);
          for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) y[4 * i + j] = X.R(i, j);
            y[4 * i + 3] = X.p[i];
            y[12 + i] = 0;
          }
          y[15] = 1;
        });
      }, py::arg("frame"), py::arg("q"))
      .def("energy", [](Dynamics& d, const py::object& q, const py::object& v) {
        const Multibody& mb = d.model();
        const Argument a = argument(q, mb.nq(), "q", mb), b = argument(v, mb.nv(), "v", mb);
        const int batch = common_batch({&a, &b});
        check_states(mb, a, batch);
        check_velocities(mb, b, batch, "v");
        return run(d, "double", {{&a, mb.nq()}, {&b, mb.nv()}}, output(py::none(), batch, {2}), 2, batch, [](auto& w, auto in, auto* y) {
          y[0] = w.kinetic_energy(in[0], in[1]);
          y[1] = w.potential_energy(in[0]);
        });
      }, py::arg("q"), py::arg("v"));
}

}  // namespace pycraft
