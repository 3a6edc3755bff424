// Direct calls on arrays, with an optional leading batch axis and an out=. One pool of workspaces per model and scalar.
#include <unordered_map>

#include "algebra/errors.h"
#include "bindings/bindings.h"
#include "dynamics/rigid_dynamics.h"

namespace pycraft {

namespace {

// The workspaces of a model live as long as the Python object asks for them.
class Dynamics {
 public:
  explicit Dynamics(std::shared_ptr<Multibody> model) : model_(std::move(model)) {}
  const Multibody& model() const { return *model_; }

  // Calls f(workspace, b) for every state of the batch.
  template <class S, class F>
  void each(int batch, F f) {
    std::get<DynamicsPool<S>>(pools_).with(*model_, [&](RigidDynamics<S>& w) {
      for (int b = 0; b < batch; ++b) {
        f(w, b);
        if (b % 256 == 255) check_interrupt();
      }
    });
  }

 private:
  std::shared_ptr<Multibody> model_;
  PerScalar<DynamicsPool> pools_;
};

// One array argument: its data, its stride between states (0 where it is shared by all).
struct Argument {
  Array array;
  py::ssize_t stride = 0;
  int batch = -1;
};

Argument argument(const py::object& given, int width, const char* what, const Multibody& model) {
  Argument a;
  a.array = numbers(given, what);
  if (a.array.ndim() < 1 || a.array.ndim() > 2 || a.array.shape(a.array.ndim() - 1) != width)
    throw ModelError(std::string(what) + " of '" + model.name() + "' takes " + std::to_string(width) + " numbers, or (B, " + std::to_string(width) + ") for a batch");
  if (a.array.ndim() == 2) {
    a.batch = static_cast<int>(a.array.shape(0));
    a.stride = width;
  }
  return a;
}

int common_batch(std::initializer_list<const Argument*> arguments) {
  int batch = -1;
  for (const Argument* a : arguments) {
    if (a->batch < 0) continue;
    if (batch >= 0 && batch != a->batch)
      throw ModelError("batches of " + std::to_string(batch) + " and " + std::to_string(a->batch) + " states in one call");
    batch = a->batch;
  }
  return batch;
}

py::array_t<double> output(const py::object& out, int batch, std::vector<py::ssize_t> shape) {
  if (batch >= 0) shape.insert(shape.begin(), batch);
  if (out.is_none()) return py::array_t<double>(shape);
  const bool fits = py::isinstance<py::array_t<double>>(out) && (py::cast<py::array>(out).flags() & py::array::c_style) && py::cast<py::array>(out).writeable() &&
                    py::cast<py::array>(out).ndim() == static_cast<py::ssize_t>(shape.size()) &&
                    std::equal(shape.begin(), shape.end(), py::cast<py::array>(out).shape());
  if (!fits) {
    std::string text;
    for (py::ssize_t n : shape) text += (text.empty() ? "" : ", ") + std::to_string(n);
    throw ModelError("out= takes a writeable C-ordered float64 array of shape (" + text + ")");
  }
  return py::cast<py::array_t<double>>(out);
}

void check_states(const Multibody& m, const Argument& q, int batch) {
  for (int b = 0; b < (q.stride ? batch : 1); ++b) m.check_q(q.array.data() + b * q.stride, m.nq());
}
void check_velocities(const Multibody& m, const Argument& v, int batch, const char* what) {
  for (int b = 0; b < (v.stride ? batch : 1); ++b) m.check_v(v.array.data() + b * v.stride, m.nv(), what);
}

// Runs f(workspace, inputs..., out) state after state at the precision asked for.
template <class F>
py::array_t<double> run(Dynamics& d, const std::string& precision, std::vector<std::pair<const Argument*, int>> in, py::array_t<double> out, int out_size, int batch, F f) {
  const int states = batch < 0 ? 1 : batch;
  double* target = out.mutable_data();
  const Precision p = precision_from_name(precision);
  std::vector<const double*> data;
  for (const auto& [a, _] : in) data.push_back(a->array.data());
  py::gil_scoped_release release;
  const auto run_in = [&]<class S>(S) {
    std::vector<std::vector<S>> wide(in.size());
    std::vector<const S*> at(in.size());
    std::vector<S> result(out_size);
    d.each<S>(states, [&](RigidDynamics<S>& w, int b) {
      for (size_t i = 0; i < in.size(); ++i) {
        const double* from = data[i] + b * in[i].first->stride;
        if constexpr (std::is_same_v<S, double>) {
          at[i] = from;
        } else {
          wide[i].assign(from, from + in[i].second);
          at[i] = wide[i].data();
        }
      }
      if constexpr (std::is_same_v<S, double>) {
        f(w, at.data(), target + size_t(b) * out_size);
      } else {
        f(w, at.data(), result.data());
        for (int i = 0; i < out_size; ++i) target[size_t(b) * out_size + i] = to_double(result[i]);
      }
    });
  };
  switch (p) {
    case Precision::double_: run_in(double()); break;
    case Precision::extended: run_in(Extended()); break;
    case Precision::quad: run_in(Quad()); break;
  }
  return out;
}

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
