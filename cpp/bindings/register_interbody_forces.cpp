#include "bindings/register_interbody_forces.h"

#include "bindings/direct_calls.h"
#include "dynamics/interbody_forces.h"
#include "simulation/scene_calls.h"
#include "simulation/scene_interbody_forces.h"
#include "simulation/selection.h"

namespace pycraft {

namespace {

using Calls = BatchInterbodyForces;

// What is given, and who holds it.
struct Held {
  Arguments arguments;
  PushedNodes pushed;
  Array wrenches;
  Calls::Asked asked;

  Held(const Multibody& model, const py::object& q, const py::object& v, const char* input, const py::object& x, const std::vector<std::string>& names, bool in_world, const Array& w)
      : arguments(model, {{"q", q}, {"v", v}, {input, x}}), pushed(pushed_nodes(model, names, in_world)), wrenches(w) {
    const int axes = static_cast<int>(wrenches.ndim());
    asked.q = arguments[0], asked.v = arguments[1], asked.input = arguments[2];
    asked.wrenches = {"wrenches", wrenches.data(), 6 * static_cast<int>(names.size()), axes == 3 ? static_cast<int>(wrenches.shape(0)) : -1};
    asked.pushed = &pushed, asked.moving = std::string(input) == "vdot";
  }
  int batch() const { return common_batch({asked.q, asked.v, asked.input, asked.wrenches}); }
};

py::tuple forces(Calls& calls, const py::object& q, const py::object& v, const char* input, const py::object& x, const std::vector<std::string>& names, bool in_world,
                 const Array& wrenches, bool reaction, const Solving& how, Precision precision) {
  const Multibody& model = calls.model();
  Held held(model, q, v, input, x, names, in_world, wrenches);
  held.asked.reaction = reaction, held.asked.how = how, held.asked.precision = precision;
  const int batch = held.batch(), N = model.bodies();
  py::array_t<double> f = output(py::none(), batch, {N, 6}), X = output(py::none(), batch, {N, 4, 4}), T = output(py::none(), batch, {model.nv()}), vdot = output(py::none(), batch, {model.nv()});
  const Calls::Results out{f.mutable_data(), X.mutable_data(), T.mutable_data(), vdot.mutable_data()};
  {
    const Undisturbed undisturbed(model);
    calls.run(held.asked, out);
  }
  return py::make_tuple(f, X, T, vdot);
}

py::tuple derivatives(Calls& calls, const py::object& q, const py::object& v, const py::object& vdot, const std::vector<std::string>& names, bool in_world, const Array& wrenches, bool along_q) {
  const Multibody& model = calls.model();
  const Held held(model, q, v, "vdot", vdot, names, in_world, wrenches);
  const int batch = held.batch(), N = model.bodies(), nv = model.nv();
  std::array<double*, 3> to_forces{}, to_generalized{};
  py::list f, T;
  for (int kind = 0; kind < (along_q ? 1 : 3); ++kind) {
    py::array_t<double> of_f = output(py::none(), batch, {N, 6, nv}), of_T = output(py::none(), batch, {nv, nv});
    to_forces[kind] = of_f.mutable_data(), to_generalized[kind] = of_T.mutable_data();
    f.append(of_f), T.append(of_T);
  }
  {
    const Undisturbed undisturbed(model);
    calls.derivatives(held.asked, to_forces, to_generalized);
  }
  return py::make_tuple(f, T);
}

// Along a run: f (T, bodies, 6), in the bodies' axes, and X_WB (T, bodies, 4, 4). The effects' own states are as they are at first where `own` is
// empty.
py::tuple along_a_run(SceneCalls& calls, const Array& t, const Array& q, const Array& v, const Array& own, bool reaction) {
  const Multibody& model = calls.scene().model();
  const auto rows = static_cast<int>(t.size());
  const int N = model.bodies(), nv = model.nv(), nq = model.nq();
  check_given(model, {{"q", q.data(), static_cast<int>(q.shape(1)), rows}, {"v", v.data(), static_cast<int>(v.shape(1)), rows}});
  py::array_t<double> f = output(py::none(), rows, {N, 6}), X = output(py::none(), rows, {N, 4, 4});
  double *to_f = f.mutable_data(), *to_X = X.mutable_data();
  {
    const Undisturbed undisturbed(model);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      InterbodyForces<S> on(model.structure(), model.compiled<S>());
      std::vector<S> vdot(nv);
      const size_t states = scene.effects().own();
      const std::vector<double> first = scene.effects().own_states();
      if (own.size() > 0 && own.size() != static_cast<py::ssize_t>(rows * states))
        throw ModelError("the effects have " + std::to_string(states) + " states of their own, not " + std::to_string(own.size() / rows));
      for (int i = 0; i < rows; ++i) {
        if (i % 64 == 63) check_interrupt();
        const std::vector<S> wq(q.data() + size_t(i) * nq, q.data() + size_t(i + 1) * nq), wv(v.data() + size_t(i) * nv, v.data() + size_t(i + 1) * nv);
        const double* const of = own.size() > 0 ? own.data() + i * states : first.data();
        const std::vector<S> y(of, of + states);
        naming_state(i, rows, [&] {
          scene_interbody_forces(scene, S(t.data()[i]), wq.data(), wv.data(), y.data(), vdot.data(), on);
          for (int k = 0; k < N; ++k) {
            write(reaction ? on.reaction(k) : on.forces()[k], to_f + (size_t(i) * N + k) * 6);
            write(on.poses()[k], to_X + (size_t(i) * N + k) * 16);
          }
          require_finite(to_f + size_t(i) * N * 6, size_t(N) * 6, model);
        });
      }
    });
  }
  return py::make_tuple(f, X);
}

}  // namespace

PushedNodes pushed_nodes(const Multibody& model, const std::vector<std::string>& names, bool in_world) {
  PushedNodes pushed{{}, in_world};
  for (const std::string& name : names) {
    pushed.nodes.push_back(node_named(model, name, "wrenches"));
    if (pushed.nodes.back().body < 0) throw ModelError("wrenches: '" + name + "' is on the base, which no wrench moves");
  }
  return pushed;
}

void register_interbody_forces(py::module_& m) {
  const py::arg q("q"), v("v"), vdot("vdot"), tau("tau"), names("names"), in_world("in_world"), wrenches("wrenches"), reaction("reaction");
  py::class_<Calls> calls(m, "InterbodyForces", "Forces of hinges on the bodies that they move, with wrenches on nodes of these names.");
  unpicklable(calls)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("after", [](Calls& c, const py::object& q, const py::object& v, const py::object& vdot, const std::vector<std::string>& names, bool in_world, const Array& wrenches, bool reaction, Precision precision) {
        return forces(c, q, v, "vdot", vdot, names, in_world, wrenches, reaction, {}, precision);
      }, q, v, vdot, names, in_world, wrenches, reaction, py::arg("precision"), "f, X_WB, T and v̇, of accelerations.")
      .def("under", [](Calls& c, const py::object& q, const py::object& v, const py::object& tau, const std::vector<std::string>& names, bool in_world, const Array& wrenches, bool reaction, Form form,
                       const py::object& refine, const std::string& residual, Precision precision) {
        return forces(c, q, v, "tau", tau, names, in_world, wrenches, reaction, {form, refinement(refine, residual, precision), OnSingular::raise}, precision);
      }, q, v, tau, names, in_world, wrenches, reaction, py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"), "f, X_WB, T and v̇, of generalized forces.")
      .def("derivatives", &derivatives, q, v, vdot, names, in_world, wrenches, py::arg("along_q"), "Of f and of T, along q, v and v̇, or along q alone.");
  m.def("scene_interbody_forces", &along_a_run, py::arg("calls"), py::arg("t"), q, v, py::arg("own"), reaction, "f in the bodies' axes and X_WB, of states along a run.");
}

}  // namespace pycraft
