// Direct calls on arrays, with an optional leading batch axis and an out=. One pool of workspaces per model and scalar.
#include "bindings/direct_calls.h"
#include "dynamics/packed_dynamics.h"
#include "dynamics/rigid_dynamics.h"

namespace pycraft {

namespace {

class Dynamics : public DirectCalls<RigidDynamics> {
 public:
  using DirectCalls::DirectCalls;
  template <class T, class F>
  void packed(F f) {
    std::get<WorkspacePool<PackedDynamics<T>>>(packs_).with(model(), f);
  }

 private:
  std::tuple<WorkspacePool<PackedDynamics<Single>>, WorkspacePool<PackedDynamics<double>>> packs_;
};

// The arguments of forward dynamics, checked.
struct Forces {
  Argument q, v, tau;
  int batch;
  Forces(const Multibody& mb, const py::object& q_given, const py::object& v_given, const py::object& tau_given)
      : q(argument(q_given, mb.nq(), "q", mb)), v(argument(v_given, mb.nv(), "v", mb)), tau(argument(tau_given, mb.nv(), "tau", mb)) {
    batch = common_batch({&q, &v, &tau});
    check_states(mb, q, batch);
    check_velocities(mb, v, batch, "v");
    check_velocities(mb, tau, batch, "tau");
  }
};

OnSingular on_singular_from_name(const std::string& name) {
  if (name == "raise") return OnSingular::raise;
  if (name == "minimum-norm") return OnSingular::minimum_norm;
  throw EvaluationError("on_singular '" + name + "' is not there; there are 'raise' and 'minimum-norm'");
}

template <class S>
void run_forward(Dynamics& d, const Forces& in, const Solving& how, double* out) {
  const int states = in.batch < 0 ? 1 : in.batch, nv = d.model().nv();
  const auto at = [](const Argument& a, int b) { return a.array.data() + b * a.stride; };
  std::vector<S> vdot(nv);
  const auto one_by_one = [&](int from, int to) {
    d.each<S>(from, to, states, [&](RigidDynamics<S>& w, int b) {
      if constexpr (std::is_same_v<S, double>) {
        w.forward_dynamics(at(in.q, b), at(in.v, b), at(in.tau, b), out + size_t(b) * nv, how);
      } else {
        w.forward_dynamics(at(in.q, b), at(in.v, b), at(in.tau, b), vdot.data(), how);
        for (int j = 0; j < nv; ++j) out[size_t(b) * nv + j] = to_double(vdot[j]);
      }
      require_finite(out + size_t(b) * nv, nv, d.model());
    });
  };
  int b = 0;
  if constexpr (std::is_same_v<S, double> || std::is_same_v<S, Single>) {
    constexpr int width = PackedDynamics<S>::width;
    if (states >= width && how.form != Form::square_root && how.refinement.steps == 0 && how.on_singular == OnSingular::raise)
      d.packed<S>([&](PackedDynamics<S>& w) {
        for (; b + width <= states; b += width) {
          double* to = out + size_t(b) * nv;
          if (!w.forward_dynamics(at(in.q, b), in.q.stride, at(in.v, b), in.v.stride, at(in.tau, b), in.tau.stride, to, how.form) ||
              !all_finite(to, size_t(width) * nv))
            one_by_one(b, b + width);
          if (b % 1024 == 0) check_interrupt();
        }
      });
  }
  one_by_one(b, states);
}

}  // namespace

void register_dynamics(py::module_& m) {
  m.def("checked_refinement", [](const py::object& refine, const std::string& residual, Precision precision) {
    const int steps = refinement(refine, residual, precision).steps;
    return steps == Refinement::automatic ? py::object(py::str("auto")) : py::object(py::int_(steps));
  }, py::arg("refine"), py::arg("residual"), py::arg("precision"), "The number of corrections, or 'auto'; EvaluationError for anything else.");
  py::class_<Dynamics> dynamics(m, "Dynamics");
  unpicklable(dynamics)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("forward_dynamics", [](Dynamics& d, const py::object& q, const py::object& v, const py::object& tau, Form form, const py::object& refine,
                                  const std::string& residual, Precision precision, const std::string& on_singular, const py::object& out) {
        Forces in(d.model(), q, v, tau);
        const Solving how{form, refinement(refine, residual, precision), on_singular_from_name(on_singular)};
        py::array_t<double> result = output(out, in.batch, {d.model().nv()});
        for (Argument* a : {&in.q, &in.v, &in.tau}) keep_apart(*a, result);
        double* target = result.mutable_data();
        const ModelInUse use(d.model());
        ReleasedGil release;
        at_precision(precision, [&]<class S>(S) { run_forward<S>(d, in, how, target); });
        return result;
      }, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"), py::arg("on_singular"), py::arg("out"))
      .def("refinement", [](Dynamics& d, const py::object& q, const py::object& v, const py::object& tau, Form form, const py::object& refine,
                            const std::string& residual, Precision precision) {
        const Forces in(d.model(), q, v, tau);
        if (in.batch >= 0) throw ModelError("the corrections of a refinement are those of one state; a batch has as many as states");
        const Solving how{form, refinement(refine, residual, precision), OnSingular::raise, true};
        py::array_t<double> value = output(py::none(), -1, {d.model().nv()});
        std::vector<double> corrections;
        double error = 0;
        double* target = value.mutable_data();
        {
          const ModelInUse use(d.model());
          ReleasedGil release;
          at_precision(precision, [&]<class S>(S) {
            std::vector<S> vdot(d.model().nv());
            d.each<S>(0, 1, 1, [&](RigidDynamics<S>& w, int) {
              w.forward_dynamics(in.q.array.data(), in.v.array.data(), in.tau.array.data(), vdot.data(), how);
              corrections = w.corrections();
              error = w.estimated_error();
            });
            for (size_t j = 0; j < vdot.size(); ++j) target[j] = to_double(vdot[j]);
            require_finite(target, vdot.size(), d.model());
          });
        }
        return py::make_tuple(value, corrections, corrections.empty() ? py::object(py::none()) : py::object(py::float_(error)));
      }, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"))
      .def("mass_matrix_inverse", [](Dynamics& d, const py::object& q, Form form, const py::object& refine, const std::string& residual, Precision precision,
                                     const std::string& on_singular, const py::object& out) {
        const Multibody& mb = d.model();
        const int nv = mb.nv();
        Argument a = argument(q, mb.nq(), "q", mb);
        check_states(mb, a, a.batch);
        const Solving how{form, refinement(refine, residual, precision), on_singular_from_name(on_singular)};
        py::array_t<double> result = output(out, a.batch, {nv, nv});
        keep_apart(a, result);
        double* target = result.mutable_data();
        const ModelInUse use(d.model());
        ReleasedGil release;
        at_precision(precision, [&]<class S>(S) {
          std::vector<S> inverse(size_t(nv) * nv);
          const int states = a.batch < 0 ? 1 : a.batch;
          d.each<S>(0, states, states, [&](RigidDynamics<S>& w, int b) {
            w.mass_matrix_inverse(a.array.data() + b * a.stride, inverse.data(), how);
            for (size_t i = 0; i < inverse.size(); ++i) target[b * inverse.size() + i] = to_double(inverse[i]);
            require_finite(target + b * inverse.size(), inverse.size(), d.model());
          });
        });
        return result;
      }, py::arg("q"), py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"), py::arg("on_singular"), py::arg("out"))
      .def("memory", [](Dynamics& d, Form form, Precision precision) {
        size_t bytes = 0;
        at_precision(precision, [&]<class S>(S) { bytes = RigidDynamics<S>(d.model()).bytes(form); });
        return bytes;
      }, py::arg("form"), py::arg("precision"), "Bytes that one forward dynamics works in.")
      .def("inverse_dynamics", [](Dynamics& d, const py::object& q, const py::object& v, const py::object& vdot, Precision precision, const py::object& out) {
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
      .def("mass_matrix", [](Dynamics& d, const py::object& q, Precision precision, const py::object& out) {
        const Multibody& mb = d.model();
        const int nq = mb.nq(), nv = mb.nv();
        const Argument a = argument(q, nq, "q", mb);
        check_states(mb, a, a.batch);
        return run(d, precision, {{&a, nq}}, output(out, a.batch, {nv, nv}), nv * nv, a.batch, [](auto& w, auto in, auto* y) { w.mass_matrix(in[0], y); });
      }, py::arg("q"), py::arg("precision"), py::arg("out"))
      .def("jacobian", [](Dynamics& d, const std::string& frame, const py::object& q, Precision precision, const py::object& out) {
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
        return run(d, Precision::double_, {{&a, mb.nq()}}, out, 16, a.batch, [&](auto& w, auto in, auto* y) {
          const auto X = w.pose(node, in[0]);
          for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) y[4 * i + j] = X.R(i, j);
            y[4 * i + 3] = X.p[i];
            y[12 + i] = 0;
          }
          y[15] = 1;
        });
      }, py::arg("frame"), py::arg("q"))
      .def("energy", [](Dynamics& d, const py::object& q, const py::object& v, const py::object& datum) {
        const Multibody& mb = d.model();
        const Vector3<double> origin = to_vector3(datum, "datum");
        const Argument a = argument(q, mb.nq(), "q", mb), b = argument(v, mb.nv(), "v", mb);
        const int batch = common_batch({&a, &b});
        check_states(mb, a, batch);
        check_velocities(mb, b, batch, "v");
        return run(d, Precision::double_, {{&a, mb.nq()}, {&b, mb.nv()}}, output(py::none(), batch, {2}), 2, batch, [&](auto& w, auto in, auto* y) {
          using S = std::remove_pointer_t<decltype(y)>;
          y[0] = w.kinetic_energy(in[0], in[1]);
          y[1] = w.potential_energy(in[0], cast<S>(origin));
        });
      }, py::arg("q"), py::arg("v"), py::arg("datum"));
}

}  // namespace pycraft
