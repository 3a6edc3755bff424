// Derivatives of the direct calls, on arrays. Results of several arrays come as one block per state and are cut here.
#include "bindings/direct_calls.h"
#include "dynamics/sensitivities.h"

namespace pycraft {

template <>
inline constexpr bool available_at<Sensitivities, Digits50> = false;
template <>
inline constexpr bool available_at<Sensitivities, Digits100> = false;

namespace {

using Calls = DirectCalls<Sensitivities>;

struct State {
  Argument q, v, w;
  int batch;
  std::vector<std::pair<const Argument*, int>> in;
};

// q, and v and w where given, checked.
State state(const Multibody& mb, const py::object& q, const py::object& v, const py::object& w, const char* last) {
  State s{argument(q, mb.nq(), "q", mb), {}, {}, -1, {}};
  if (!v.is_none()) s.v = argument(v, mb.nv(), "v", mb);
  if (!w.is_none()) s.w = argument(w, mb.nv(), last, mb);
  s.batch = common_batch({&s.q, &s.v, &s.w});
  check_states(mb, s.q, s.batch);
  if (!v.is_none()) check_velocities(mb, s.v, s.batch, "v");
  if (!w.is_none()) check_velocities(mb, s.w, s.batch, last);
  return s;
}

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

// ∂v̇/∂q, ∂v̇/∂v, ∂v̇/∂τ one after the other, from the doubles of the states: what a narrower scalar rounds away, a wider residual sees.
void forward(Calls& d, const State& s, const Solving& how, Precision precision, double* out) {
  const size_t n = d.model().nv(), square = n * n;
  const int states = s.batch < 0 ? 1 : s.batch;
  const auto at = [](const Argument& a, int b) { return a.array.data() + b * a.stride; };
  const ModelInUse use(d.model());
  ReleasedGil release;
  at_precision(precision, [&]<class S>(S) {
    if constexpr (!available_at<Sensitivities, S>) {
      throw EvaluationError(to_quad);
    } else {
      std::vector<S> y(3 * square);
      d.each<S>(0, states, states, [&](Sensitivities<S>& w, int b) {
        w.forward_dynamics(at(s.q, b), at(s.v, b), at(s.w, b), how, y.data(), y.data() + square, y.data() + 2 * square);
        double* to = out + b * 3 * square;
        std::transform(y.begin(), y.end(), to, [](const S& x) { return to_double(x); });
        require_finite(to, 3 * square, d.model());
      });
    }
  });
}

}  // namespace

void register_sensitivities(py::module_& m) {
  const py::arg q("q"), v("v"), precision("precision");
  py::class_<Calls> sensitivities(m, "Sensitivities");
  unpicklable(sensitivities)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("inverse_dynamics", [](Calls& d, const py::object& q, const py::object& v, const py::object& vdot, Precision precision) {
        const Multibody& mb = d.model();
        const int nq = mb.nq(), n = mb.nv(), size = 2 * n * n;
        const State s = state(mb, q, v, vdot, "vdot");
        const auto all = run(d, precision, {{&s.q, nq}, {&s.v, n}, {&s.w, n}}, output(py::none(), s.batch, {size}), size, s.batch,
                             [n](auto& w, auto in, auto* y) { w.inverse_dynamics(in[0], in[1], in[2], y, y + n * n); });
        return cut(all, s.batch, {{n, n}, {n, n}});
      }, q, v, py::arg("vdot"), precision)
      .def("forward_dynamics", [](Calls& d, const py::object& q, const py::object& v, const py::object& tau, Form form, const py::object& refine,
                                  const std::string& residual, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv(), size = 3 * n * n;
        const State s = state(mb, q, v, tau, "tau");
        const Solving how{form, refinement(refine, residual, precision), OnSingular::raise};
        py::array_t<double> all = output(py::none(), s.batch, {size});
        forward(d, s, how, precision, all.mutable_data());
        return cut(all, s.batch, {{n, n}, {n, n}, {n, n}});
      }, q, v, py::arg("tau"), py::arg("form"), py::arg("refine"), py::arg("residual"), precision)
      .def("third_order", [](Calls& d, bool christoffel, const py::object& q, Precision precision, const py::object& out) {
        const Multibody& mb = d.model();
        const int n = mb.nv(), size = n * n * n;
        const State s = state(mb, q, py::none(), py::none(), "");
        return run(d, precision, {{&s.q, mb.nq()}}, output(out, s.batch, {n, n, n}), size, s.batch, [christoffel](auto& w, auto in, auto* y) {
          if (christoffel)
            w.christoffel(in[0], y);
          else
            w.mass_matrix(in[0], y);
        });
      }, py::arg("christoffel"), q, precision, py::arg("out"))
      .def("kinetic_energy", [](Calls& d, const py::object& q, const py::object& v, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv();
        const State s = state(mb, q, v, py::none(), "");
        const auto all = run(d, precision, {{&s.q, mb.nq()}, {&s.v, n}}, output(py::none(), s.batch, {2 * n}), 2 * n, s.batch,
                             [n](auto& w, auto in, auto* y) { w.kinetic_energy(in[0], in[1], y, y + n); });
        return cut(all, s.batch, {{n}, {n}});
      }, q, v, precision)
      .def("hamiltonian", [](Calls& d, const py::object& q, const py::object& p, const py::object& tau, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv();
        const State s = state(mb, q, p, tau, "tau");
        const auto all = run(d, precision, {{&s.q, mb.nq()}, {&s.v, n}, {&s.w, n}}, output(py::none(), s.batch, {2 * n}), 2 * n, s.batch,
                             [n](auto& w, auto in, auto* y) { w.hamiltonian(in[0], in[1], in[2], y, y + n); });
        return cut(all, s.batch, {{n}, {n}});
      }, q, py::arg("p"), py::arg("tau"), precision)
      .def("momentum", [](Calls& d, const py::object& q, const py::object& v, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv();
        const State s = state(mb, q, v, py::none(), "");
        const auto all = run(d, precision, {{&s.q, mb.nq()}, {&s.v, n}}, output(py::none(), s.batch, {12 * n}), 12 * n, s.batch,
                             [n](auto& w, auto in, auto* y) { w.momentum(in[0], in[1], y, y + 6 * n); });
        return cut(all, s.batch, {{6, n}, {6, n}});
      }, q, v, precision)
      .def("jacobian_rate", [](Calls& d, const std::string& frame, const py::object& q, const py::object& v, Precision precision) {
        const Multibody& mb = d.model();
        const Node node = mb.node(mb.node_index(frame));
        const int n = mb.nv();
        const State s = state(mb, q, v, py::none(), "");
        return run(d, precision, {{&s.q, mb.nq()}, {&s.v, n}}, output(py::none(), s.batch, {6, n}), 6 * n, s.batch,
                   [&](auto& w, auto in, auto* y) { w.jacobian_rate(node, in[0], in[1], y); });
      }, py::arg("frame"), q, v, precision)
      .def("jacobian_derivative", [](Calls& d, const std::string& frame, const py::object& q, Precision precision) {
        const Multibody& mb = d.model();
        const Node node = mb.node(mb.node_index(frame));
        const int n = mb.nv();
        const State s = state(mb, q, py::none(), py::none(), "");
        return run(d, precision, {{&s.q, mb.nq()}}, output(py::none(), s.batch, {6, n, n}), 6 * n * n, s.batch,
                   [&](auto& w, auto in, auto* y) { w.jacobian_derivative(node, in[0], y); });
      }, py::arg("frame"), q, precision)
      .def("inertial_regressor", [](Calls& d, const py::object& q, const py::object& v, const py::object& vdot, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv(), size = n * 10 * mb.bodies();
        const State s = state(mb, q, v, vdot, "vdot");
        return run(d, precision, {{&s.q, mb.nq()}, {&s.v, n}, {&s.w, n}}, output(py::none(), s.batch, {n, 10 * mb.bodies()}), size, s.batch,
                   [](auto& w, auto in, auto* y) { w.inertial_regressor(in[0], in[1], in[2], y); });
      }, q, v, py::arg("vdot"), precision)
      .def("log_determinant", [](Calls& d, const std::string& over, const py::object& q, Precision precision) {
        const Multibody& mb = d.model();
        const int n = mb.nv(), bodies = mb.bodies();
        const State s = state(mb, q, py::none(), py::none(), "");
        std::vector<py::ssize_t> shape;
        if (over == "coordinates")
          shape = {n};
        else if (over == "inertias")
          shape = {bodies, 10};
        else if (over == "geometry")
          shape = {bodies, 6};
        else if (over == "axes")
          shape = {n, 6};
        else
          throw EvaluationError("gradient over '" + over + "': there are coordinates, inertias, geometry, axes");
        const int size = static_cast<int>(shape[0] * (shape.size() > 1 ? shape[1] : 1));
        const char which = over[0];
        return run(d, precision, {{&s.q, mb.nq()}}, output(py::none(), s.batch, shape), size, s.batch, [which](auto& w, auto in, auto* y) {
          using P = decltype(y);
          P none = nullptr;
          w.log_determinant(in[0], which == 'c' ? y : none, which == 'i' ? y : none, which == 'g' ? y : none, which == 'a' ? y : none);
        });
      }, py::arg("over"), q, precision);
}

}  // namespace pycraft
