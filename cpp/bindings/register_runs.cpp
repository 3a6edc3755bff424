// Runs of scenes: what integrators make of them.
#include <chrono>

#include "bindings/direct_calls.h"
#include "bindings/python_steps.h"
#include "bindings/run_record.h"
#include "dynamics/states_together.h"
#include "runtime/fiber.h"
#include "simulation/dense_output.h"
#include "simulation/integrators/pairing.h"
#include "simulation/scene_calls.h"
#include "simulation/scene_equations.h"

namespace pycraft {

namespace {

py::array_t<double> as_rows(const std::vector<double>& all, size_t rows, int width) {
  py::array_t<double> a({static_cast<py::ssize_t>(rows), static_cast<py::ssize_t>(width)});
  std::copy(all.begin(), all.end(), a.mutable_data());
  return a;
}

py::dict as_dict(const Rows& rows, const RunRecord& r, int works) {
  py::dict d;
  const size_t n = rows.t.size();
  d["t"] = to_numpy(rows.t), d["q"] = as_rows(rows.q, n, r.nq), d["v"] = as_rows(rows.v, n, r.nv);
  d["states"] = as_rows(rows.own, n, r.own), d["work"] = as_rows(rows.work, n, works);
  return d;
}

py::dict passes_of(const RunRecord& r) {
  py::dict times;
  for (const PassRecord& pass : r.passes) {
    const py::str name(pass.name);
    times[name] = (times.contains(name) ? py::cast<long>(times[name]) : 0L) + pass.times;
  }
  return times;
}

py::dict as_dict(const WrittenCheckpoint& c) {
  py::dict d;
  d["t"] = c.t, d["x"] = c.x, d["size"] = c.size, d["origin"] = c.origin, d["taken"] = c.taken, d["signs"] = c.signs, d["lengths"] = c.lengths;
  return d;
}
WrittenCheckpoint checkpoint_from(const py::dict& d) {
  const auto parts = [&](const char* key) { return py::cast<std::vector<double>>(d[key]); };
  return {parts("t"), parts("size"), parts("origin"), py::cast<std::vector<std::vector<double>>>(d["x"]), py::cast<long>(d["taken"]), py::cast<std::vector<int>>(d["signs"]), py::cast<std::vector<std::vector<double>>>(d["lengths"])};
}

template <class S>
std::vector<S> wide(const std::vector<double>& x) {
  return {x.begin(), x.end()};
}

// What is asked of a run besides the state.
struct Asked {
  std::vector<double> times, own;
  bool energy, end_at_times;
  IntegratorOptions options;
  const PythonEvents& events;
  const py::object* progress;  // null: not wanted
  const py::object* foreign;   // null: an integrator of the core
  const WrittenCheckpoint* checkpoint;
  const py::object* stiff = nullptr;   // called once when the motion becomes stiff; null: not wanted
  StatesTogether* others = nullptr;  // null: a run by itself
};

// Accelerations wait for those of other runs as long as it lives.
template <class S>
struct Waiting {
  Waiting(CompiledScene<S>& of, StatesTogether* others) : scene(of) { scene.wait_for(others); }
  ~Waiting() { scene.wait_for(nullptr); }
  CompiledScene<S>& scene;
};

// One run in the scalar of the scene. What is known of it by then is in the record where an error ends it.
template <class S>
void run_in(CompiledScene<S>& scene, const std::vector<double>& q, const std::vector<double>& v, const Asked& asked, RunRecord& record) {
  check_integration(asked.times, asked.options, to_double(epsilon<S>()));
  const Waiting<S> waiting(scene, asked.others);
  const long packed_before = scene.in_packs();
  const bool works = asked.energy && !scene.effects().workers().empty();
  Paired<S> pair;
  if (asked.foreign) {
    if constexpr (std::is_same_v<S, double>) {
      pair.equations = std::make_unique<SceneEquations<S>>(scene, works);
      pair.stepper = python_steps(*pair.equations, *asked.foreign, asked.options);
    }
  } else {
    pair = paired(scene, works, asked.options);
  }
  record.nq = scene.numbers().nq, record.nv = scene.numbers().nv, record.own = scene.effects().own(), record.works = pair.equations->integrals();
  record.own_events = pair.equations->event_names();
  for (std::string& name : pair.equations->jump_names()) record.own_events.push_back(std::move(name));
  const std::vector<double>& own = asked.own;
  if (!own.empty() && static_cast<int>(own.size()) != record.own)
    throw ModelError("the effects have " + std::to_string(record.own) + " states of their own, not " + std::to_string(own.size()));
  const SceneList list = works ? SceneList::works : SceneList::motion;
  std::vector<PassRecord> before = scene.passes(list);
  Checkpoint<S> resumed;
  std::vector<S> x;
  if (asked.checkpoint) {
    resumed = read<S>(*asked.checkpoint), x = resumed.x;
    if (static_cast<int>(x.size()) != pair.equations->size())
      throw ModelError("the checkpoint has " + std::to_string(x.size()) + " numbers of a state; the scene, as it is now, has " + std::to_string(pair.equations->size()));
  } else {
    const std::vector<S> wq = wide<S>(q), wv = wide<S>(v), y = wide<S>(own);
    x = SceneEquations<S>(scene, works).initial(S(asked.times.front()), wq.data(), wv.data(), own.empty() ? nullptr : y.data());
  }
  Recorder<S> recorder(record, SceneEquations<S>::unit_of_work(), asked.progress,
                       [&scene, &asked](const S& t, const std::vector<S>& x, const S& step, const S& last) { return stiffness_at(scene, asked.options.integrator, t, x, step, last); }, asked.stiff);
  RunEnd<S> end;
  const RunPlan<S> plan{asked.times, asked.end_at_times, asked.events.functions<S>(), asked.checkpoint ? &resumed : nullptr};
  const auto start = std::chrono::steady_clock::now();
  const auto close = [&] {
    record.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    record.in_packs = scene.in_packs() - packed_before;
    record.switches = end.switches;
    record.cost = end.cost, record.ended_by = end.event, record.checkpoint = written(end.checkpoint);
    record.passes = scene.passes(list);
    for (size_t i = 0; i < before.size(); ++i) record.passes[i].times -= before[i].times;
    if (const auto* solving = dynamic_cast<const VariationalEquations<S>*>(pair.equations.get())) record.solutions = solving->solutions;
    if (const auto* differentiating = dynamic_cast<const LinearizedEquations<S>*>(pair.equations.get())) record.linearizations = differentiating->linearizations;
  };
  try {
    integrate<S>(*pair.equations, *pair.stepper, std::move(x), plan, asked.options, recorder, end);
  } catch (...) {
    close();
    throw;
  }
  close();
}

void run(SceneCalls& calls, RunRecord& record, const Array& q, const Array& v, const Asked& asked) {
  const Multibody& mb = calls.scene().model();
  mb.check_q(q.data(), q.size());
  mb.check_v(v.data(), v.size(), "v");
  const std::vector<double> from_q(q.data(), q.data() + q.size()), from_v(v.data(), v.data() + v.size());
  const Undisturbed undisturbed(mb);
  calls.with([&]<class S>(CompiledScene<S>& scene) { run_in(scene, from_q, from_v, asked, record); });
}

// Several runs of one model side by side. What ends one of them is in its record.
void run_together(const std::vector<SceneCalls*>& calls, const std::vector<RunRecord*>& records, const Array& q, const Array& v, Asked asked) {
  const Multibody& mb = calls.front()->scene().model();
  const size_t nq = q.shape(1), nv = v.shape(1);
  for (const SceneCalls* each : calls)
    if (&each->scene().model() != &mb) throw ModelError("runs side by side are of one model");
  StatesTogether together;
  asked.others = &together;
  const Undisturbed undisturbed(mb);
  const auto start = std::chrono::steady_clock::now();
  const auto run = [&](int i) {
    try {
      const double *qi = q.data() + i * nq, *vi = v.data() + i * nv;
      mb.check_q(qi, nq), mb.check_v(vi, nv, "v");
      calls[i]->with([&]<class S>(CompiledScene<S>& scene) { run_in(scene, {qi, qi + nq}, {vi, vi + nv}, asked, *records[i]); });
    } catch (const std::exception&) {
      records[i]->error = std::current_exception();
    }
  };
  side_by_side(static_cast<int>(calls.size()), StatesTogether::width(), run, [&] { together.answer(); });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (RunRecord* record : records) record->seconds = seconds / static_cast<double>(records.size());
}

// Why runs of a scene cannot be side by side, empty: they can.
std::string alone(SceneCalls& calls, const std::string& integrator) {
  const IntegratorRecord& record = record_of(integrator_from_name(integrator));
  if (!Fiber::there || StatesTogether::width() < 2) return "this machine has no packs of states";
  if (record.way == Way::by_momenta) return std::string("integrator '") + record.name + "' solves for momenta";
  std::string why;
  const ModelInUse use(calls.scene().model());
  calls.with([&]<class S>(CompiledScene<S>& scene) { why = scene.alone(); });
  return why;
}

// States of a run as numbers of its equations; holding: of which row what controllers hold is.
template <class S>
std::vector<S> state_of_row(const CompiledScene<S>& scene, const Rows& rows, const RunRecord& record, int i, int holding) {
  std::vector<S> x;
  const auto append = [&](const std::vector<double>& all, int width, const S& unit) {
    for (int j = 0; j < width; ++j) x.push_back(S(all[size_t(i) * width + j]) / unit);
  };
  append(rows.q, record.nq, S(1)), append(rows.v, record.nv, S(1)), append(rows.own, record.own, S(1)), append(rows.work, record.works, SceneEquations<S>::unit_of_work());
  for (const auto& e : scene.effects().effects())
    for (size_t j = e->declared.states.size(); j < static_cast<size_t>(e->declared.own()); ++j)
      x[record.nq + record.nv + e->first + j] = S(rows.own[size_t(holding) * record.own + e->first + j]);
  return x;
}

// Accelerations at both ends of each step between rows, by what acts in it: at a knot and where a controller is sampled those before and after differ.
template <class S>
void accelerations_of_steps(CompiledScene<S>& scene, const Rows& rows, const RunRecord& record, std::vector<double>& after, std::vector<double>& before) {
  SceneEquations<S> equations(scene, false);
  std::vector<S> vdot(record.nv), rate(record.own);
  const auto find = [&](int i, int holding, std::vector<double>& to) {
    const std::vector<S> x = state_of_row(scene, rows, record, i, holding);
    equations.evaluate(S(rows.t[i]), x.data(), x.data() + record.nq, x.data() + record.nq + record.nv, vdot.data(), rate.data());
    for (int j = 0; j < record.nv; ++j) to[size_t(i) * record.nv + j] = to_double(vdot[j]);
  };
  const int last = static_cast<int>(rows.t.size()) - 1;
  for (int k = 0; k < last; ++k) {
    equations.between(S(rows.t[k]), S(rows.t[k + 1]));
    find(k, k + 1, after), find(k + 1, k + 1, before);
  }
  std::copy_n(after.begin(), record.nv, before.begin());
  std::copy(before.end() - record.nv, before.end(), after.end() - record.nv);
}

py::tuple step_accelerations(SceneCalls& calls, const Array& t, const Array& q, const Array& v, const Array& own) {
  const Multibody& mb = calls.scene().model();
  const auto numbers = [](const Array& a) { return std::vector<double>(a.data(), a.data() + a.size()); };
  const Rows rows{numbers(t), numbers(q), numbers(v), numbers(own), {}};
  RunRecord record;
  record.nq = mb.nq(), record.nv = mb.nv();
  std::vector<double> after(rows.t.size() * record.nv), before(after.size());
  if (rows.t.size() > 1) {
    const Undisturbed undisturbed(mb);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      record.own = scene.effects().own();
      accelerations_of_steps(scene, rows, record, after, before);
    });
  }
  return py::make_tuple(as_rows(after, rows.t.size(), record.nv), as_rows(before, rows.t.size(), record.nv));
}

// The states at `times`, each within the step between rows at[i] and at[i] + 1: by the integrator's dense output, or by Hermite's.
template <class S>
void between_in(CompiledScene<S>& scene, const IntegratorOptions* options, const Rows& rows, const std::vector<double>& times, const std::vector<int>& at, RunRecord& record) {
  const bool works = record.works > 0;
  Paired<S> pair;
  if (options)
    pair = paired(scene, works, *options);
  else
    pair.equations = std::make_unique<SceneEquations<S>>(scene, works);
  HermiteOutput<S> hermite(*pair.equations, options && record_of(options->integrator).order == 1);
  Recorder<S> recorder(record, SceneEquations<S>::unit_of_work(), nullptr);
  std::vector<S> x0, x1, x;
  bool own_output = false;
  for (size_t i = 0; i < times.size(); ++i) {
    if (i % 64 == 63) check_interrupt();
    const int k = at[i];
    const S t(times[i]), t0(rows.t[k]), t1(rows.t[k + 1]);
    if (i == 0 || at[i - 1] != k) {
      x0 = state_of_row(scene, rows, record, k, k + 1), x1 = state_of_row(scene, rows, record, k + 1, k + 1);
      pair.equations->between(t0, t1);
      own_output = pair.stepper && pair.stepper->again(t0, x0, t1);
      if (!own_output) hermite.set(t0, x0, t1, x1);
    }
    if (t == t0 || t == t1)
      x = t == t0 ? x0 : x1;
    else if (own_output)
      pair.stepper->interpolate(t, x);
    else
      hermite.at(t, x);
    pair.equations->settle(t, x);
    recorder.sample(t, x);
  }
}

py::dict between(SceneCalls& calls, const std::string& integrator, const Array& t, const Array& q, const Array& v, const Array& own, const Array& work, const std::vector<double>& times,
                 const std::vector<int>& at) {
  const Multibody& mb = calls.scene().model();
  const auto numbers = [](const Array& a) { return std::vector<double>(a.data(), a.data() + a.size()); };
  const Rows rows{numbers(t), numbers(q), numbers(v), numbers(own), numbers(work)};
  RunRecord record;
  record.nq = mb.nq(), record.nv = mb.nv(), record.works = work.ndim() == 2 ? static_cast<int>(work.shape(1)) : 0;
  IntegratorOptions options;
  if (!integrator.empty()) options.integrator = integrator_from_name(integrator), options.step = 1;
  {
    const Undisturbed undisturbed(mb);
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      record.own = scene.effects().own();
      if (record.works > 0 && record.works != static_cast<int>(scene.effects().workers().size())) throw ModelError("these works are of another scene");
      between_in(scene, integrator.empty() ? nullptr : &options, rows, times, at, record);
    });
  }
  return as_dict(record.samples, record, record.works);
}

// Accelerations at the ends of steps that are known already.
class KnownAccelerations : public ExplicitEquations<double> {
 public:
  KnownAccelerations(const CompiledModel<double>& model, const double* t, const double* after, const double* before) : ExplicitEquations<double>(model, 0), t_(t), after_(after), before_(before) {}
  void look_at(int step) { step_ = step; }
  void evaluate(const double& t, const double* q, const double* v, const double*, double* vdot, double*) override {
    at_q_ = q, at_v_ = v;
    std::copy_n(t == t_[step_] ? after_ + size_t(step_) * nv() : before_ + size_t(step_ + 1) * nv(), nv(), vdot);
  }

 private:
  const double *t_, *after_, *before_;  // by row: those with which a step begins there, and ends
  int step_ = 0;
};

// q (K, nq) and v (K, nv) at `times`, each between rows at[i] and at[i] + 1.
py::tuple hermite_between(const Multibody& mb, const Array& t, const Array& q, const Array& v, const Array& after, const Array& before, const std::vector<double>& times, const std::vector<int>& at) {
  const int nq = mb.nq(), nv = mb.nv();
  std::vector<double> all_q, all_v, x0, x1, x;
  {
    const Undisturbed undisturbed(mb);
    const auto numbers = mb.compiled<double>();
    KnownAccelerations equations(*numbers, t.data(), after.data(), before.data());
    HermiteOutput<double> hermite(equations, false);
    const auto row = [&](int i, std::vector<double>& x) {
      x.assign(q.data() + size_t(i) * nq, q.data() + size_t(i + 1) * nq);
      x.insert(x.end(), v.data() + size_t(i) * nv, v.data() + size_t(i + 1) * nv);
    };
    for (size_t i = 0; i < times.size(); ++i) {
      if (i == 0 || at[i] != at[i - 1]) row(at[i], x0), row(at[i] + 1, x1), equations.look_at(at[i]), hermite.set(t.data()[at[i]], x0, t.data()[at[i] + 1], x1);
      hermite.at(times[i], x);
      all_q.insert(all_q.end(), x.begin(), x.begin() + nq), all_v.insert(all_v.end(), x.begin() + nq, x.end());
    }
  }
  return py::make_tuple(as_rows(all_q, times.size(), nq), as_rows(all_v, times.size(), nv));
}

py::list table() {
  py::list all;
  for (const IntegratorRecord& r : integrator_records) {
    py::dict d;
    d["name"] = r.name, d["order"] = r.order, d["controlled"] = r.controlled, d["on_group"] = r.on_group, d["samples_between"] = r.samples_between;
    d["way"] = r.way == Way::at_states ? "at states" : r.way == Way::of_steps ? "of steps" : r.way == Way::with_derivatives ? "with derivatives" : "by momenta";
    all.append(d);
  }
  return all;
}

}  // namespace

void register_runs(py::module_& m) {
  py::class_<RunRecord> record(m, "RunRecord", "What a run gave out, also of one that an error or an interrupt ended.");
  unpicklable(record)
      .def(py::init([](bool keeps_steps) { auto r = std::make_unique<RunRecord>(); r->keeps_steps = keeps_steps; return r; }), py::arg("keeps_steps"))
      .def_property_readonly("steps", [](const RunRecord& r) { return as_dict(r.steps, r, r.works); }, "The ends of steps.")
      .def_property_readonly("samples", [](const RunRecord& r) { return as_dict(r.samples, r, r.works); }, "The times asked for.")
      .def_property_readonly("events", [](const RunRecord& r) { return py::make_tuple(r.event_of, as_dict(r.events, r, 0)); }, "Numbers of events, and the states at them.")
      .def_property_readonly("own_events", [](const RunRecord& r) { return r.own_events; }, "Events of the effects' own, by the effects; those that were asked for follow them.")
      .def_property_readonly("ended_by", [](const RunRecord& r) { return r.ended_by; }, "The event that ended it, -1: none.")
      .def_property_readonly("stiffness", [](const RunRecord& r) { return r.stiffness ? py::object(as_dict(*r.stiffness)) : py::object(py::none()); }, "What holds the steps of an explicit method, None: nothing.")
      .def_property_readonly("switches", [](const RunRecord& r) { return r.switches; }, "From when on which of several methods took the steps.")
      .def_property_readonly("checkpoint", [](const RunRecord& r) { return as_dict(r.checkpoint); })
      .def_property_readonly("statistics", [](const RunRecord& r) {
        py::dict d;
        d["evaluations"] = r.cost.evaluations, d["steps"] = r.cost.steps, d["rejected"] = r.cost.rejected, d["seconds"] = r.seconds, d["linearizations"] = r.linearizations;
        d["solutions"] = r.solutions, d["in_packs"] = r.in_packs, d["passes"] = passes_of(r);
        return d;
      })
      .def("raise_error", [](const RunRecord& r) { if (r.error) std::rethrow_exception(r.error); }, "What ended one run among several is raised.");
  m.def("run_scene", [](SceneCalls& calls, RunRecord& record, const py::object& q, const py::object& v, const std::vector<double>& times, const std::vector<double>& own, bool energy,
                        const std::string& integrator, double rtol, double atol, double step, double max_step, bool normalise, const py::list& events, const py::object& progress,
                        const py::object& checkpoint, const py::object& foreign, const py::object& stiff) {
    int states = 0;
    {
      const ModelInUse use(calls.scene().model());
      calls.with([&]<class S>(CompiledScene<S>& scene) { states = scene.effects().own(); });
    }
    const PythonEvents looked_for(events, calls.scene().model().nq(), calls.scene().model().nv(), states);
    IntegratorOptions options;
    if (foreign.is_none()) options.integrator = integrator_from_name(integrator);
    options.rtol = rtol, options.atol = atol, options.step = step, options.longest = max_step, options.normalise = normalise;
    WrittenCheckpoint from;
    if (!checkpoint.is_none()) from = checkpoint_from(checkpoint);
    run(calls, record, numbers(q, "q"), numbers(v, "v"),
        {times, own, energy, false, options, looked_for, progress.is_none() ? nullptr : &progress, foreign.is_none() ? nullptr : &foreign, checkpoint.is_none() ? nullptr : &from, stiff.is_none() ? nullptr : &stiff});
  }, py::arg("calls"), py::arg("record"), py::arg("q"), py::arg("v"), py::arg("times"), py::arg("own"), py::arg("energy"), py::arg("integrator"), py::arg("rtol"), py::arg("atol"), py::arg("step"),
     py::arg("max_step"), py::arg("normalise"), py::arg("events"), py::arg("progress"), py::arg("checkpoint"), py::arg("foreign"), py::arg("stiff") = py::none());
  m.def("run_scenes", [](const std::vector<SceneCalls*>& calls, const std::vector<RunRecord*>& records, const Array& q, const Array& v, const std::vector<double>& times, bool energy,
                         const std::string& integrator, double rtol, double atol, double step, double max_step, bool normalise) {
    if (calls.empty()) return;
    if (q.ndim() != 2 || v.ndim() != 2 || records.size() != calls.size() || size_t(q.shape(0)) != calls.size() || size_t(v.shape(0)) != calls.size())
      throw ModelError("runs side by side have a record, a row of q and a row of v each");
    IntegratorOptions options{integrator_from_name(integrator), rtol, atol, step, normalise, max_step};
    const PythonEvents none(py::list(), 0, 0, 0);
    run_together(calls, records, q, v, {times, {}, energy, false, options, none, nullptr, nullptr, nullptr});
  }, py::arg("calls"), py::arg("records"), py::arg("q"), py::arg("v"), py::arg("times"), py::arg("energy"), py::arg("integrator"), py::arg("rtol"), py::arg("atol"), py::arg("step"), py::arg("max_step"),
     py::arg("normalise"), "Runs side by side, in packs of states; RunRecord.raise_error says what ended one.");
  m.def("pack_width", &StatesTogether::width, "States in a pack, in double precision.");
  m.def("alone", &alone, py::arg("calls"), py::arg("integrator"), "Why runs cannot be side by side, in words; empty: they can.");
  m.def("check_pairing", [](SceneCalls& calls, const std::string& integrator, bool foreign, bool implicit) {
    if (foreign)
      check_foreign_pairing(calls.scene(), calls.precision(), integrator, implicit);
    else
      check_pairing(calls.scene(), calls.precision(), integrator_from_name(integrator));
  }, py::arg("calls"), py::arg("integrator"), py::arg("foreign"), py::arg("implicit"), "EvaluationError where they do not fit each other.");
  m.def("scene_between", &between, py::arg("calls"), py::arg("integrator"), py::arg("t"), py::arg("q"), py::arg("v"), py::arg("states"), py::arg("work"), py::arg("times"), py::arg("at"));
  m.def("hermite_between", [](const std::shared_ptr<Multibody>& model, const Array& t, const Array& q, const Array& v, const Array& after, const Array& before, const std::vector<double>& times,
                             const std::vector<int>& at) { return hermite_between(*model, t, q, v, after, before, times, at); },
        py::arg("model"), py::arg("t"), py::arg("q"), py::arg("v"), py::arg("after"), py::arg("before"), py::arg("times"), py::arg("at"));
  m.def("step_accelerations", &step_accelerations, py::arg("calls"), py::arg("t"), py::arg("q"), py::arg("v"), py::arg("states"),
        "Accelerations (K, nv) with which steps begin and end at the rows of a run, by what acts in each.");
  m.def("held_states", [](SceneCalls& calls) {
    std::vector<int> held;
    const ModelInUse use(calls.scene().model());
    calls.with([&]<class S>(CompiledScene<S>& scene) {
      for (const auto& e : scene.effects().effects())
        for (int j = static_cast<int>(e->declared.states.size()); j < e->declared.own(); ++j) held.push_back(e->first + j);
    });
    return held;
  }, py::arg("calls"), "Which of the effects' own states controllers hold from one sample to the next.");
  m.def("integrator_table", &table, "What the core's integrators are.");
}

}  // namespace pycraft
