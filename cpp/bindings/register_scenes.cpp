// Scenes: their effects, and what is computed of them at states and along runs.
#include "bindings/direct_calls.h"
#include "simulation/scene_calls.h"

namespace pycraft {

namespace {

template <class S>
std::vector<S> wide(const double* x, size_t n) {
  return {x, x + n};
}
template <class S>
void narrow(const S* from, size_t n, double* to) {
  for (size_t i = 0; i < n; ++i) to[i] = to_double(from[i]);
}

py::dict times_of(const std::vector<PassRecord>& passes) {
  py::dict times;
  for (const PassRecord& pass : passes) {
    const py::str name(pass.name);
    times[name] = (times.contains(name) ? py::cast<long>(times[name]) : 0L) + pass.times;
  }
  return times;
}
std::vector<PassRecord> since(std::vector<PassRecord> now, const std::vector<PassRecord>& before) {
  for (size_t i = 0; i < now.size(); ++i) now[i].times -= before[i].times;
  return now;
}

// The effects' own states: as given, or as they are at first.
template <class S>
std::vector<S> own_states(CompiledScene<S>& scene, const std::vector<double>& given) {
  const std::vector<double> own = given.empty() ? scene.effects().own_states() : given;
  if (static_cast<int>(own.size()) != scene.effects().own())
    throw ModelError("the effects have " + std::to_string(scene.effects().own()) + " states of their own, not " + std::to_string(own.size()));
  return wide<S>(own.data(), own.size());
}

py::tuple close(SceneCalls& calls, const Array& q, const Array& v, double t) {
  const Multibody& mb = calls.scene().model();
  mb.check_q(q.data(), q.size()), mb.check_v(v.data(), v.size(), "v");
  std::vector<double> on_q(q.size()), on_v(v.size());
  {
    const Undisturbed undisturbed(mb);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      std::vector<S> wq = wide<S>(q.data(), q.size()), wv = wide<S>(v.data(), v.size());
      scene.effects().prescribe(S(t), wq.data(), wv.data(), nullptr);
      scene.loops()->close(S(t), wq.data(), wv.data());
      scene.loops()->check_start(wq.data(), wv.data());
      narrow(wq.data(), wq.size(), on_q.data()), narrow(wv.data(), wv.size(), on_v.data());
    });
    require_finite(on_q.data(), on_q.size(), mb), require_finite(on_v.data(), on_v.size(), mb);
  }
  return py::make_tuple(to_numpy(on_q), to_numpy(on_v));
}

py::dict evaluate(SceneCalls& calls, const Array& q, const py::object& v, double t, const std::vector<double>& own, double step) {
  const Multibody& mb = calls.scene().model();
  const int nv = mb.nv();
  mb.check_q(q.data(), q.size());
  const Array velocity = v.is_none() ? Array() : numbers(v, "v");
  if (!v.is_none()) mb.check_v(velocity.data(), velocity.size(), "v");
  std::vector<double> vdot(nv), rows;
  std::vector<std::string> names;
  std::vector<PassRecord> passes;
  {
    const Undisturbed undisturbed(mb);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      const std::vector<S> wq = wide<S>(q.data(), q.size()), wv = v.is_none() ? std::vector<S>() : wide<S>(velocity.data(), velocity.size()), y = own_states(scene, own);
      std::vector<S> out(nv), forces(scene.effects().effects().size() * nv);
      const SceneList list = v.is_none() ? SceneList::apart_at_rest : SceneList::apart;
      const auto before = scene.passes(list);
      struct PlainSteps {
        CompiledScene<S>& scene;
        ~PlainSteps() { scene.set_step(S(0)); }
      } after{scene};
      scene.set_step(S(step));
      scene.accelerations_and_forces(S(t), wq.data(), v.is_none() ? nullptr : wv.data(), y.data(), out.data(), forces.data());
      passes = since(scene.passes(list), before);
      narrow(out.data(), out.size(), vdot.data());
      rows.resize(forces.size());
      narrow(forces.data(), forces.size(), rows.data());
      for (const auto& e : scene.effects().effects()) names.push_back(e->name);
    });
    require_finite(vdot.data(), vdot.size(), mb);
  }
  py::dict forces, result;
  for (size_t i = 0; i < names.size(); ++i) forces[py::str(names[i])] = to_numpy(std::vector<double>(rows.begin() + i * nv, rows.begin() + (i + 1) * nv));
  result["vdot"] = to_numpy(vdot), result["forces"] = forces, result["passes"] = times_of(passes);
  return result;
}

py::array_t<double> as_rows(const std::vector<double>& all, size_t rows, int width) {
  py::array_t<double> a({static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(width)});
  std::copy(all.begin(), all.end(), a.mutable_data());
  return a;
}

// Of states along a run: accelerations (T, nv), forces (effects, T, nv), kinetic (T,) and potential energies (T, effects).
py::dict along(SceneCalls& calls, const Array& t, const Array& q, const Array& v, const Array& own) {
  const Multibody& mb = calls.scene().model();
  const size_t rows = t.size(), nv = mb.nv();
  std::vector<double> vdot(rows * nv), kinetic(rows), potential, forces;
  size_t effects = 0;
  {
    const Undisturbed undisturbed(mb);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      effects = scene.effects().effects().size();
      forces.resize(effects * rows * nv), potential.resize(rows * effects);
      std::vector<S> a(nv), f(effects * nv), U(effects);
      const size_t states = scene.effects().own();
      for (size_t i = 0; i < rows; ++i) {
        if (i % 64 == 63) check_interrupt();
        const auto wq = wide<S>(q.data() + i * mb.nq(), mb.nq()), wv = wide<S>(v.data() + i * nv, nv), y = wide<S>(own.data() + i * states, states);
        const S at(t.data()[i]);
        S energy;
        scene.accelerations_and_forces(at, wq.data(), wv.data(), y.data(), a.data(), f.data());
        scene.energies(at, wq.data(), wv.data(), y.data(), &energy, U.data());
        narrow(a.data(), nv, vdot.data() + i * nv), narrow(U.data(), effects, potential.data() + i * effects);
        kinetic[i] = to_double(energy);
        for (size_t e = 0; e < effects; ++e) narrow(f.data() + e * nv, nv, forces.data() + (e * rows + i) * nv);
      }
    });
  }
  py::dict d;
  d["vdot"] = as_rows(vdot, rows, static_cast<int>(nv)), d["kinetic"] = to_numpy(kinetic), d["potential"] = as_rows(potential, rows, static_cast<int>(effects));
  py::array_t<double> all({effects, rows, nv});
  std::copy(forces.begin(), forces.end(), all.mutable_data());
  d["forces"] = all;
  return d;
}

py::list plan(SceneCalls& calls, const std::string& list) {
  const SceneList which = list == "rest" ? SceneList::rest : list == "works" ? SceneList::works : SceneList::motion;
  std::vector<PassRecord> passes;
  const ModelInUse use(calls.scene().model());
  calls.with([&]<class S>(CompiledScene<S>& scene) { passes = scene.passes(which); });
  py::list all;
  for (const PassRecord& p : passes) all.append(py::make_tuple(p.name, p.what, p.because));
  return all;
}

}  // namespace

void register_scenes(py::module_& m) {
  py::class_<Scene>(m, "SceneEffects", "A model and the effects that act on it, by name, on or off; pycraft.Scene is its face.")
      .def(py::init([](const std::shared_ptr<Multibody>& model) { return Scene(model); }), py::arg("model"))
      .def("add", [](Scene& s, const std::string& name, const std::shared_ptr<Effect>& effect, bool on) { return s.add(name, effect, on); }, py::arg("name"), py::arg("effect"), py::arg("on"))
      .def("remove", &Scene::remove, py::arg("name"))
      .def("set_on", &Scene::set_on, py::arg("name"), py::arg("on"));
  py::class_<SceneCalls> calls(m, "SceneCalls", "What is computed of a scene as it was when this was made.");
  unpicklable(calls)
      .def(py::init([](const Scene& scene, Form form, const py::object& refine, const std::string& residual, Precision precision) {
        return std::make_unique<SceneCalls>(scene, Solving{form, refinement(refine, residual, precision), OnSingular::raise}, precision);
      }), py::arg("scene"), py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"))
      .def("evaluate", [](SceneCalls& c, const py::object& q, const py::object& v, double t, const std::vector<double>& own, double step) {
        return evaluate(c, numbers(q, "q"), v, t, own, step);
      }, py::arg("q"), py::arg("v"), py::arg("t"), py::arg("own"), py::arg("step"))
      .def("close", [](SceneCalls& c, const py::object& q, const py::object& v, double t) { return close(c, numbers(q, "q"), numbers(v, "v"), t); }, py::arg("q"), py::arg("v"), py::arg("t"),
           "q and v on the loops that are kept, v by an impulse of the loops.")
      .def("along", [](SceneCalls& c, const Array& t, const Array& q, const Array& v, const Array& own) { return along(c, t, q, v, own); }, py::arg("t"), py::arg("q"), py::arg("v"), py::arg("own"))
      .def_property_readonly("workers", [](SceneCalls& c) {
        std::vector<int> workers;
        c.with([&]<class S>(CompiledScene<S>& scene) { workers = scene.effects().workers(); });
        return workers;
      }, "Numbers of the effects whose works are counted, among those that are on.")
      .def_property_readonly("states", [](SceneCalls& c) {
        std::vector<int> states;
        c.with([&]<class S>(CompiledScene<S>& scene) {
          for (const auto& e : scene.effects().effects()) states.push_back(e->declared.own());
        });
        return states;
      }, "How many states of its own each effect has that is on, what it holds among them.")
      .def("plan", [](SceneCalls& c, const std::string& list) { return plan(c, list); }, py::arg("list"), "(name, what, because) of the passes of a 'motion', at 'rest', or with 'works'.");
}

}  // namespace pycraft
