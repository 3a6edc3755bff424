// What `pycraft bench` times in the core, without Python in the loop: an expression applied, a direct call over a set of states.
#include <string>

#include "algebra/engine/evaluate.h"
#include "bench/scenes_by_hand.h"
#include "bench/timing.h"
#include "bindings/bindings.h"
#include "bindings/compiled_library.h"
#include "dynamics/batch_dynamics.h"
#include "dynamics/batch_hybrid_dynamics.h"
#include "dynamics/batch_sensitivities.h"
#include "dynamics/methods.h"
#include "dynamics/sensitivities.h"
#include "runtime/errors.h"
#include "simulation/scene_calls.h"

namespace pycraft {

namespace {

int states_of(const Array& q) {
  if (q.ndim() != 2 || q.shape(0) == 0) throw EvaluationError("a time takes at least one state: q of shape (states, nq)");
  return static_cast<int>(q.shape(0));
}


py::dict result(const Timing& t) {
  py::dict d;
  d["minimum"] = t.minimum;
  d["median"] = t.median;
  d["calls"] = t.calls;
  return d;
}

py::dict time_apply(const Expression& e, const Array& x, double seconds, bool rules) {
  Inputs inputs;
  inputs.x = x.data();
  inputs.columns = x.ndim() == 2 ? static_cast<int>(x.shape(1)) : 1;
  const auto pool = prepare(e, Request::apply, rules);
  Result r;
  Timing t;
  {
    ReleasedGil release;
    t = time_calls([&] { pool->run(inputs, false, r); }, seconds);
  }
  return result(t);
}

// One forward dynamics per state in rotation, in every way there is.
py::dict time_forward(const std::shared_ptr<Multibody>& model, const Array& q, const Array& v, const Array& u, double seconds, Form form, const py::object& refine,
                      const std::string& residual, Precision precision) {
  const Solving how{form, refinement(refine, residual, precision), OnSingular::raise};
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  const double *Q = q.data(), *V = v.data(), *U = u.data();
  std::vector<double> out(nv);
  BatchDynamics w(model);
  int k = 0;
  Timing t;
  {
    ReleasedGil release;
    t = time_calls([&] {
      w.forward_dynamics({"q", Q + size_t(k) * nq, nq}, {"v", V + size_t(k) * nv, nv}, {"tau", U + size_t(k) * nv, nv}, how, precision, out.data());
      k = (k + 1) % K;
    }, seconds);
  }
  return result(t);
}

// Hybrid dynamics with these coordinates prescribed, u their accelerations and the forces of the others.
py::dict time_hybrid(const std::shared_ptr<Multibody>& model, const std::vector<bool>& prescribed, const Array& q, const Array& v, const Array& u, double seconds) {
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  const double *Q = q.data(), *V = v.data(), *U = u.data();
  std::vector<double> accelerations(nv), forces(nv);
  BatchHybridDynamics w(model, std::vector<char>(prescribed.begin(), prescribed.end()));
  int k = 0;
  Timing t;
  {
    ReleasedGil release;
    t = time_calls([&] {
      const double* of_state = U + size_t(k) * nv;
      w.run({"q", Q + size_t(k) * nq, nq}, {"v", V + size_t(k) * nv, nv}, {"tau", of_state, nv}, {"vdot", of_state, nv}, {}, Precision::double_, accelerations.data(), forces.data());
      k = (k + 1) % K;
    }, seconds);
  }
  return result(t);
}

// The same by another method.
py::dict time_method(const std::shared_ptr<Multibody>& model, const std::string& method, const Array& q, const Array& v, const Array& u, double seconds,
                     Precision precision) {
  const Method by = method_from_name(method);
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  Timing t;
  {
    ReleasedGil release;
    at_precision(precision, [&]<class S>(S) {
      DynamicsMethods<S> w(*model);
      std::vector<S> Q, V, U, out(nv);
      convert(q.data(), size_t(K) * nq, Q), convert(v.data(), size_t(K) * nv, V), convert(u.data(), size_t(K) * nv, U);
      int k = 0;
      t = time_calls([&] {
        w.forward_dynamics(by, Q.data() + size_t(k) * nq, V.data() + size_t(k) * nv, U.data() + size_t(k) * nv, out.data());
        k = (k + 1) % K;
      }, seconds);
    });
  }
  return result(t);
}

// Forward dynamics of a batch, seconds per state.
py::dict time_packs(const std::shared_ptr<Multibody>& model, const Array& q, const Array& v, const Array& u, double seconds, Form form, Precision precision) {
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  const double *Q = q.data(), *V = v.data(), *U = u.data();
  std::vector<double> out(size_t(K) * nv);
  BatchDynamics w(model);
  const Given states[] = {{"q", Q, nq, K}, {"v", V, nv, K}, {"tau", U, nv, K}};
  Solving how;
  how.form = form;
  Timing t;
  {
    ReleasedGil release;
    t = time_calls([&] { w.forward_dynamics(states[0], states[1], states[2], how, precision, out.data()); }, seconds);
  }
  t.minimum /= K, t.median /= K;
  return result(t);
}

// One call per state in rotation; q (K, nq), v, u (K, nv).
py::dict time_dynamics(const std::shared_ptr<Multibody>& model, const std::string& call, const Array& q, const Array& v, const Array& u, double seconds) {
  BatchDynamics w(model);
  BatchSensitivities d(model);
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  const size_t square = size_t(nv) * nv;
  const bool vector = call == "forward_dynamics" || call == "inverse_dynamics" || call == "operational_space_inertia";  // of chains whose matrices fit nowhere
  std::vector<double> out(std::max(size_t(144), vector ? size_t(nv) : std::max(3 * square, size_t(6) * nv)));
  int k = 0;
  const auto next = [&] { k = (k + 1) % K; };
  const double *Q = q.data(), *V = v.data(), *U = u.data();
  const auto at_q = [&](const double* x) { return Given{"q", x, nq}; };
  const auto at_v = [&](const double* x) { return Given{"v", x, nv}; };
  ReleasedGil release;
  Timing t;
  const auto run = [&](auto f) {
    t = time_calls([&] { f(Q + size_t(k) * nq, V + size_t(k) * nv, U + size_t(k) * nv), next(); }, seconds);
  };
  if (call == "forward_dynamics") {
    run([&](auto a, auto b, auto c) { w.forward_dynamics(at_q(a), at_v(b), at_v(c), {}, Precision::double_, out.data()); });
  } else if (call == "inverse_dynamics") {
    run([&](auto a, auto b, auto c) {
      const Given given = at_v(c);
      w.inverse_dynamics(at_q(a), at_v(b), &given, Precision::double_, out.data());
    });
  } else if (call == "mass_matrix") {
    run([&](auto a, auto, auto) { w.mass_matrix(at_q(a), Precision::double_, out.data()); });
  } else if (call == "mass_matrix_inverse") {
    run([&](auto a, auto, auto) { w.mass_matrix_inverse(at_q(a), {}, Precision::double_, out.data()); });
  } else if (call == "inverse_dynamics_derivatives") {
    run([&](auto a, auto b, auto c) { d.inverse_dynamics(at_q(a), at_v(b), at_v(c), Precision::double_, {out.data(), out.data() + square, out.data() + 2 * square}); });
  } else if (call == "forward_dynamics_derivatives") {  // the accelerations and their derivatives
    run([&](auto a, auto b, auto c) {
      d.forward_dynamics(at_q(a), at_v(b), at_v(c), {}, Precision::double_, {out.data(), out.data() + square, out.data() + 2 * square});
    });
  } else if (call == "coriolis_matrix") {
    run([&](auto a, auto b, auto) { d.coriolis_matrix(false, at_q(a), at_v(b), Precision::double_, out.data()); });
  } else if (call == "operational_space_inertia" || call == "operational_space_inertia_of_two") {  // of the last body, and of that in the middle
    const auto of_body = [&](int k) { return model->node(model->node_index(model->body(k).name)); };
    const Node nodes[] = {of_body(model->bodies() - 1), of_body(model->bodies() / 2)};
    const size_t count = call == "operational_space_inertia" ? 1 : 2;
    bool sure = true;
    run([&](auto a, auto, auto) { sure &= w.operational_space(true, {nodes, count}, at_q(a), out.data()); });
    if (!sure) throw EvaluationError("the operational-space inertia of a state that is timed is left to the operators");
  } else if (call == "log_determinant_gradient") {
    run([&](auto a, auto, auto) { d.log_determinant(GradientOver::coordinates, at_q(a), Precision::double_, out.data()); });
  } else {
    throw EvaluationError("no direct call '" + call + "' to time");
  }
  py::gil_scoped_acquire acquire;
  return result(t);
}

// States (K, nq) and (K, nv) of a scene in its scalar, and its effects' own states as they are at first.
template <class S>
struct StatesOfScene {
  StatesOfScene(const CompiledScene<S>& scene, const Array& q, const Array& v, const Multibody& mb)
      : nq(mb.nq()), nv(mb.nv()), count(states_of(q)), q(q.data(), q.data() + q.size()), v(v.data(), v.data() + v.size()), vdot(nv), powers(scene.effects().workers().size()) {
    if (v.size() != static_cast<py::ssize_t>(count) * nv || q.size() != static_cast<py::ssize_t>(count) * nq) throw ModelError("q (states, nq) and v (states, nv) of a scene that is timed");
    const std::vector<double> first = scene.effects().own_states();
    own.assign(first.begin(), first.end());
  }
  void evaluate(CompiledScene<S>& scene, SceneList list) {
    const S *at = q.data() + size_t(k) * nq, *rate = v.data() + size_t(k) * nv;
    if (list == SceneList::works) scene.accelerations_and_powers(S(0), at, rate, own.data(), vdot.data(), powers.data());
    else scene.accelerations(S(0), at, rate, own.data(), vdot.data());
    k = (k + 1) % count;
  }
  int nq, nv, count, k = 0;
  std::vector<S> q, v, own, vdot, powers;
};

// Accelerations of a scene, one state after another; with `works`, powers of its effects, too.
py::dict time_scene(SceneCalls& calls, const Array& q, const Array& v, double seconds, bool works) {
  const Multibody& mb = calls.scene().model();
  Timing t;
  {
    const ModelInUse use(mb);
    ReleasedGil release;
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      StatesOfScene<S> states(scene, q, v, mb);
      t = time_calls([&] { states.evaluate(scene, works ? SceneList::works : SceneList::motion); }, seconds);
    });
  }
  return result(t);
}

// Seconds of every pass of a scene's motion by itself, in their order, each over all states.
std::vector<double> time_passes(SceneCalls& calls, const Array& q, const Array& v, double seconds) {
  const Multibody& mb = calls.scene().model();
  std::vector<double> found;
  {
    const ModelInUse use(mb);
    ReleasedGil release;
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      StatesOfScene<S> states(scene, q, v, mb);
      found.assign(scene.passes(SceneList::motion).size(), 0.0);
      const double each = seconds / (states.count * static_cast<double>(found.size()));
      for (int k = 0; k < states.count; ++k) {
        states.evaluate(scene, SceneList::motion);
        for (size_t pass = found.size(); pass-- > 0;)  // accelerations first: repeated effects leave forces that are no state's
          found[pass] += time_calls([&] { scene.repeat(SceneList::motion, pass); }, each).minimum / states.count;
      }
    });
  }
  return found;
}
// The same by hand, and its last result.
std::pair<py::dict, py::array_t<double>> time_by_hand(const std::shared_ptr<Multibody>& model, const std::string& what, const Array& q, const Array& v, double seconds) {
  const int K = states_of(q), nq = model->nq(), nv = model->nv();
  ByHand by_hand(*model, what);
  std::vector<double> out(nv);
  int k = 0;
  Timing t;
  {
    ReleasedGil release;
    t = time_calls([&] {
      by_hand.run(q.data() + size_t(k) * nq, v.data() + size_t(k) * nv, out.data());
      k = (k + 1) % K;
    }, seconds);
    by_hand.run(q.data(), v.data(), out.data());
  }
  return {result(t), to_numpy(out)};
}

}  // namespace

// A compiled function, one state after another; given: an array (K, n) for each input.
py::dict time_compiled(const std::string& library, const std::string& function, const std::vector<Array>& given, int results, double seconds) {
  const CompiledRun run = load_compiled(library, function);
  std::vector<const double*> places(given.size());
  const std::vector<std::int64_t> strides(given.size());
  std::vector<double> out(results);
  const int K = states_of(given.at(0));
  int k = 0;
  ReleasedGil release;
  const Timing t = time_calls([&] {
    for (size_t i = 0; i < given.size(); ++i) places[i] = given[i].data() + k * given[i].shape(1);
    run(places.data(), strides.data(), out.data(), 1);
    k = (k + 1) % K;
  }, seconds);
  py::gil_scoped_acquire acquire;
  return result(t);
}

void register_bench(py::module_& m) {
  m.def("time_compiled", &time_compiled, py::arg("library"), py::arg("function"), py::arg("given"), py::arg("results"), py::arg("seconds") = 0.2,
        "Seconds per call of a compiled function over a set of states in rotation: minimum, median, calls.");
  m.def("time_apply", &time_apply, py::arg("operator"), py::arg("x"), py::arg("seconds") = 0.2, py::arg("rules") = true, "Seconds per application: minimum, median, calls.");
  m.def("time_dynamics", &time_dynamics, py::arg("model"), py::arg("call"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2,
        "Seconds per direct call over a set of states in rotation: minimum, median, calls.");
  m.def("time_forward", &time_forward, py::arg("model"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2, py::arg("form") = Form::fast,
        py::arg("refine") = 0, py::arg("residual") = "same", py::arg("precision") = Precision::double_,
        "Seconds per forward dynamics over a set of states in rotation: minimum, median, calls.");
  m.def("time_hybrid", &time_hybrid, py::arg("model"), py::arg("prescribed"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2,
        "Seconds per hybrid dynamics over a set of states in rotation: minimum, median, calls.");
  m.def("time_method", &time_method, py::arg("model"), py::arg("method"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2,
        py::arg("precision") = Precision::double_, "Seconds per forward dynamics by a method of the mass matrix: minimum, median, calls.");
  m.def("time_scene", &time_scene, py::arg("scene"), py::arg("q"), py::arg("v"), py::arg("seconds") = 0.2, py::arg("works") = false,
        "Seconds per evaluation of a scene's accelerations: minimum, median, calls; with works, of the effects' powers, too.");
  m.def("time_passes", &time_passes, py::arg("scene"), py::arg("q"), py::arg("v"), py::arg("seconds") = 0.2, "Seconds of every pass of a scene's motion, in their order.");
  m.def("time_by_hand", &time_by_hand, py::arg("model"), py::arg("what"), py::arg("q"), py::arg("v"), py::arg("seconds") = 0.2,
        "Seconds per forward dynamics by the bare kernel with one effect written out by hand: minimum, median, calls; and v̇ at the first state.");
  m.def("time_packs", &time_packs, py::arg("model"), py::arg("q"), py::arg("v"), py::arg("u"), py::arg("seconds") = 0.2, py::arg("form") = Form::fast,
        py::arg("precision") = Precision::double_, "Seconds per state of a batch in packs: minimum, median, calls.");
}

}  // namespace pycraft
