// Derivatives of the direct calls, on arrays. Results of several arrays come as one block per state and are cut here.
#include "bindings/direct_calls.h"
#include "dynamics/batch_curvature.h"
#include "dynamics/batch_sensitivities.h"
#include "model/rotor_forces.h"

namespace pycraft {

namespace {

// Parts of the trailing axis as arrays of their own: part i of `sizes[i]` numbers, as rows of `columns[i]` (0: flat).
py::tuple cut(const py::array_t<double>& all, int batch, const std::vector<std::vector<py::ssize_t>>& shapes) {
  py::tuple parts(shapes.size());
  const py::ssize_t states = batch < 0 ? 1 : batch, width = all.shape(all.ndim() - 1);
  py::ssize_t at = 0;
  for (size_t i = 0; i < shapes.size(); ++i) {
    std::vector<py::ssize_t> shape = shapes[i];
    py::ssize_t size = 1;
    for (py::ssize_t n : shape) size *= n;
    if (batch >= 0) shape.insert(shape.begin(), batch);
    py::array_t<double> part(shape);
    for (py::ssize_t b = 0; b < states; ++b) std::copy_n(all.data() + b * width + at, size, part.mutable_data() + b * size);
    parts[i] = part;
    at += size;
  }
  return parts;
}

// Three matrices of nv numbers a side, which f writes.
template <class F>
py::tuple three(const Multibody& model, const Arguments& given, F f) {
  py::tuple all(3);
  std::array<double*, 3> to;
  for (int i = 0; i < 3; ++i) {
    py::array_t<double> one = output(py::none(), given.batch, {model.nv(), model.nv()});
    to[i] = one.mutable_data();
    all[i] = one;
  }
  const Undisturbed undisturbed(model);
  f(to);
  return all;
}

// A matrix (nv, nv) for each row of v (B, nv), which f adds to.
template <class F>
py::array_t<double> of_rotors(const Multibody& model, const Array& v, F f) {
  const auto numbers = model.compiled<double>();
  const py::ssize_t n = numbers->nv;
  if (v.ndim() != 2 || v.shape(1) != n) throw ModelError("v of '" + model.name() + "' takes " + std::to_string(n) + " numbers a state");
  py::array_t<double> made(std::vector<py::ssize_t>{v.shape(0), n, n});
  std::fill_n(made.mutable_data(), made.size(), 0.0);
  for (py::ssize_t b = 0; b < v.shape(0); ++b) {
    double* const to = made.mutable_data() + b * n * n;
    f(*numbers, b, [to, n](py::ssize_t i, py::ssize_t j) -> double& { return to[i * n + j]; });
  }
  return made;
}

}  // namespace

void register_sensitivities(py::module_& m) {
  const py::arg q("q"), v("v"), precision("precision");
  py::class_<BatchSensitivities> sensitivities(m, "Sensitivities");
  unpicklable(sensitivities)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("inverse_dynamics", [](BatchSensitivities& d, const py::object& q, const py::object& v, const py::object& vdot, Precision precision) {
        const Multibody& mb = d.model();
        Arguments given(mb, {{"q", q}, {"v", v}, {"vdot", vdot}});
        return three(mb, given, [&](const std::array<double*, 3>& to) { d.inverse_dynamics(given[0], given[1], given[2], precision, to); });
      }, q, v, py::arg("vdot"), precision)
      .def("forward_dynamics", [](BatchSensitivities& d, const py::object& q, const py::object& v, const py::object& tau, Form form, const py::object& refine,
                                  const std::string& residual, Precision precision) {
        const Multibody& mb = d.model();
        Arguments given(mb, {{"q", q}, {"v", v}, {"tau", tau}});
        const Solving how{form, refinement(refine, residual, precision), OnSingular::raise};
        return three(mb, given, [&](const std::array<double*, 3>& to) { d.forward_dynamics(given[0], given[1], given[2], how, precision, to); });
      }, q, v, py::arg("tau"), py::arg("form"), py::arg("refine"), py::arg("residual"), precision)
      .def("third_order", [](BatchSensitivities& d, bool christoffel, const py::object& q, Precision precision, const py::object& out) {
        const Multibody& mb = d.model();
        const int n = mb.nv();
        Arguments given(mb, {{"q", q}});
        return run(d, precision, given, out, {n, n, n}, [christoffel](auto& w, auto in, auto* y) {
          if (christoffel)
            w.christoffel(in[0], y);
          else
            w.mass_matrix(in[0], y);
        });
      }, py::arg("christoffel"), q, precision, py::arg("out"))
      .def("coriolis_matrix", [](BatchSensitivities& d, const py::object& q, const py::object& v, const std::string& form, Precision precision, const py::object& out) {
        const Multibody& mb = d.model();
        Arguments given(mb, {{"q", q}, {"v", v}});
        const bool skew = is_skew(form);
        return written(mb, given, out, {mb.nv(), mb.nv()}, [&](double* target) { d.coriolis_matrix(skew, given[0], given[1], precision, target); });
      }, q, v, py::arg("form"), precision, py::arg("out"))
      .def("kinetic_energy", [](BatchSensitivities& d, const py::object& q, const py::object& v, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv();
        Arguments given(mb, {{"q", q}, {"v", v}});
        const auto all = run(d, precision, given, py::none(), {2 * n}, [n](auto& w, auto in, auto* y) { w.kinetic_energy(in[0], in[1], y, y + n); });
        return cut(all, given.batch, {{n}, {n}});
      }, q, v, precision)
      .def("hamiltonian", [](BatchSensitivities& d, const py::object& q, const py::object& p, const py::object& tau, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv();
        Arguments given(mb, {{"q", q}, {"p", p}, {"tau", tau}});
        const auto all = run(d, precision, given, py::none(), {2 * n}, [n](auto& w, auto in, auto* y) { w.hamiltonian(in[0], in[1], in[2], y, y + n); });
        return cut(all, given.batch, {{n}, {n}});
      }, q, py::arg("p"), py::arg("tau"), precision)
      .def("momentum", [](BatchSensitivities& d, const py::object& q, const py::object& v, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv();
        Arguments given(mb, {{"q", q}, {"v", v}});
        const auto all = run(d, precision, given, py::none(), {12 * n}, [n](auto& w, auto in, auto* y) { w.momentum(in[0], in[1], y, y + 6 * n); });
        return cut(all, given.batch, {{6, n}, {6, n}});
      }, q, v, precision)
      .def("jacobian_rate", [](BatchSensitivities& d, const std::string& frame, const py::object& q, const py::object& v, Precision precision) {
        const Multibody& mb = d.model();
        const Node node = mb.node(mb.node_index(frame));
        const int n = mb.nv();
        Arguments given(mb, {{"q", q}, {"v", v}});
        return run(d, precision, given, py::none(), {6, n}, [&](auto& w, auto in, auto* y) { w.jacobian_rate(node, in[0], in[1], y); });
      }, py::arg("frame"), q, v, precision)
      .def("jacobian_derivative", [](BatchSensitivities& d, const std::string& frame, const py::object& q, Precision precision) {
        const Multibody& mb = d.model();
        const Node node = mb.node(mb.node_index(frame));
        const int n = mb.nv();
        Arguments given(mb, {{"q", q}});
        return run(d, precision, given, py::none(), {6, n, n}, [&](auto& w, auto in, auto* y) { w.jacobian_derivative(node, in[0], y); });
      }, py::arg("frame"), q, precision)
      .def("inertial_regressor", [](BatchSensitivities& d, const py::object& q, const py::object& v, const py::object& vdot, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv();
        Arguments given(mb, {{"q", q}, {"v", v}, {"vdot", vdot}});
        return run(d, precision, given, py::none(), {n, 10 * mb.bodies()}, [](auto& w, auto in, auto* y) { w.inertial_regressor(in[0], in[1], in[2], y); });
      }, q, v, py::arg("vdot"), precision)
      .def("rotor_regressor", [](const BatchSensitivities& d, const Array& v, const Array& vdot) {
        return of_rotors(d.model(), v, [&](const CompiledModel<double>& m, py::ssize_t b, auto out) {
          std::vector<double> J(m.nv, 0.0), c(m.nv);
          for (int j = 0; j < m.nv; ++j) {
            J[j] = 1, std::fill(c.begin(), c.end(), 0.0);
            for (int k = 0; k < m.bodies; ++k) rotor_forces(m, k, J.data(), v.data() + b * m.nv, c.data());
            c[j] += vdot.at(b, j), J[j] = 0;
            for (int i = 0; i < m.nv; ++i) out(i, j) = c[i];
          }
        });
      }, v, py::arg("vdot"))
      .def("rotor_coriolis", [](const BatchSensitivities& d, const Array& v, bool christoffel) {
        return of_rotors(d.model(), v, [&](const CompiledModel<double>& m, py::ssize_t b, auto out) {
          for (int k = 0; k < m.bodies; ++k) each_rotor_coriolis(m, k, m.rotor_inertia.data(), v.data() + b * m.nv, christoffel, [&](int i, int j, double x) { out(i, j) += x; });
        });
      }, v, py::arg("christoffel"))
      .def("log_determinant", [](BatchSensitivities& d, const std::string& over, const py::object& q, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv(), bodies = mb.bodies();
        Arguments given(mb, {{"q", q}});
        const std::pair<GradientOver, std::vector<py::ssize_t>> all[] = {
            {GradientOver::coordinates, {n}}, {GradientOver::inertias, {bodies, 10}}, {GradientOver::geometry, {bodies, 6}}, {GradientOver::axes, {n, 6}}};
        static constexpr const char* names[] = {"coordinates", "inertias", "geometry", "axes"};
        const auto named = std::find(std::begin(names), std::end(names), over);
        if (named == std::end(names)) throw EvaluationError("gradient over '" + over + "': there are coordinates, inertias, geometry, axes");
        const auto& [which, shape] = all[named - names];
        return written(mb, given, py::none(), shape, [&](double* target) { d.log_determinant(which, given[0], precision, target); });
      }, py::arg("over"), q, precision);
  py::class_<BatchCurvature> curvature(m, "Curvature");
  unpicklable(curvature)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("inverse_dynamics", [](BatchCurvature& d, const py::object& q, const py::object& v, const py::object& vdot, const Array& mu, Precision precision) {
        const Multibody& mb = d.model();
        Arguments given(mb, {{"q", q}, {"v", v}, {"vdot", vdot}});
        const py::ssize_t states = given.batch < 0 ? 1 : given.batch, n = mb.nv();
        if (mu.ndim() != 3 || mu.shape(0) != states || mu.shape(2) != n)
          throw ModelError("mu of '" + mb.name() + "': an array (" + std::to_string(states) + ", m, " + std::to_string(n) + "), states, virtual velocities, coordinates");
        const int count = static_cast<int>(mu.shape(1));
        py::array_t<double> out(std::vector<py::ssize_t>{states, count, BatchCurvature::blocks, n, n});
        double* const to = out.mutable_data();
        const double* const along = mu.data();
        const Undisturbed undisturbed(mb);
        d.inverse_dynamics(given[0], given[1], given[2], along, count, precision, to);
        return out;
      }, py::arg("q"), py::arg("v"), py::arg("vdot"), py::arg("mu"), py::arg("precision"),
         "Second derivatives of the power of virtual velocities mu (states, m, nv): (states, m, 4, nv, nv), along q and q, q and v, q and v̇, v and v.");
}

}  // namespace pycraft
