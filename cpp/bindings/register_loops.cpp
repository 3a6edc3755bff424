#include "bindings/register_loops.h"

#include <algorithm>
#include <cmath>

#include "bindings/direct_calls.h"
#include "bindings/hinge_arguments.h"
#include "bindings/register_interbody_forces.h"
#include "bindings/tapes.h"
#include "bindings/users_function.h"
#include "dynamics/calls_on_loops.h"
#include "dynamics/loop_calls.h"
#include "dynamics/recorded_on_loops.h"
#include "model/checks.h"
#include "model/curve.h"
#include "operators/embedded_operators.h"
#include "operators/loop_operators.h"
#include "simulation/effects/loop.h"
#include "simulation/effects/loop_penalty.h"

namespace pycraft {

namespace {

// A function of coordinates in Python; it is let go under the GIL.
struct PythonCoupling {
  py::object f;
  std::string coupling;
  PythonCoupling(py::object g, std::string of) : f(std::move(g)), coupling(std::move(of)) {}
  PythonCoupling(const PythonCoupling&) = delete;
  ~PythonCoupling() {
    py::gil_scoped_acquire gil;
    f = py::object();
  }

  void operator()(int n, const double* q, double* r, double* gradient, double* second, double* third) const {
    py::gil_scoped_acquire gil;
    const std::string what = "the function of coupling '" + coupling + "'";
    const auto place = [&] {
      std::string at;
      for (int i = 0; i < n; ++i) at += (i ? ", " : "") + short_number(q[i]);
      return " at q = (" + at + ")";
    };
    const py::object given = of_user([&] { return what + place(); }, [&] { return f(py::array_t<double>(n, q)); });
    if (!py::isinstance<py::tuple>(given) || (py::len(given) != 3 && py::len(given) != 4))
      throw ModelError(what + " returns (r, gradient, second derivatives), of shapes (), (n,), (n, n), and third ones (n, n, n) if it has them; no difference is taken in their place");
    const py::tuple parts = given;
    if (third && parts.size() == 3)
      throw EvaluationError("coupling '" + coupling + "' is a function, which has no third derivatives, and they are asked for: of rows twice, or of what they ask where its "
                            "coordinates move; let it return them (n, n, n) as a fourth, or give polynomials");
    *r = one_number(parts[0], ("r of " + what).c_str());
    copy(parts[1], "the gradient of " + what, {n}, gradient);
    copy(parts[2], "the second derivatives of " + what, {n, n}, second);
    if (third) copy(parts[3], "the third derivatives of " + what, {n, n, n}, third);
    const auto require_finite = [&](const char* part, const double* x, int size) {
      for (int i = 0; i < size; ++i)
        if (!std::isfinite(x[i])) throw EvaluationError(part + what + " has an entry that is " + short_number(x[i]) + place());
    };
    if (!std::isfinite(*r)) throw EvaluationError("r of " + what + " is " + short_number(*r) + place());
    require_finite("the gradient of ", gradient, n), require_finite("the second derivatives of ", second, n * n);
    if (third) require_finite("the third derivatives of ", third, n * n * n);
    check_symmetric(n, second, what);
  }

 private:
  // ∂²r/∂i∂j is ∂²r/∂j∂i: what is further apart than differences leave is no second derivatives, as one triangle of them.
  static void check_symmetric(int n, const double* second, const std::string& what) {
    double most = 0;
    for (int i = 0; i < n * n; ++i) most = std::max(most, std::abs(second[i]));
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < i; ++j)
        if (const double above = second[j * n + i], below = second[i * n + j]; std::abs(above - below) > 1e-4 * most)
          throw ModelError("the second derivatives of " + what + " are not symmetric: entries (" + std::to_string(j) + ", " + std::to_string(i) + ") and (" +
                           std::to_string(i) + ", " + std::to_string(j) + ") are " + short_number(above) + " and " + short_number(below));
  }
  static void copy(const py::handle& given, const std::string& what, const std::vector<py::ssize_t>& shape, double* to) {
    const Array a = numbers(given, what.c_str());
    if (a.ndim() != static_cast<py::ssize_t>(shape.size()) || !std::equal(shape.begin(), shape.end(), a.shape()))
      throw ModelError(what + ": of " + std::to_string(shape[0]) + " coordinates it has that many numbers, or rows of them, not " + shape_text(a));
    std::copy_n(a.data(), a.size(), to);
  }
};

PairKind kind_named(const std::string& name) {
  for (const PairKind kind : {PairKind::blade, PairKind::wheel, PairKind::rolling_ball, PairKind::surface})
    if (name == record_of(kind).name) return kind;
  throw ModelError("a loop of kind '" + name + "': there are 'blade', 'wheel', 'rolling ball', 'surface', and hinges");
}

// Of one model: its loops and their rows.
struct Loops {
  explicit Loops(std::shared_ptr<Multibody> model) : set(std::make_shared<LoopSet>(std::move(model))), calls(set), dynamics(set), embedded(set) {}
  std::shared_ptr<LoopSet> set;
  LoopCalls calls;
  ConstrainedDynamics dynamics;
  EmbeddedDynamics embedded;
  int rows() const {
    const ModelInUse use(set->model());
    return set->resolved()->rows;
  }
};

template <class F>
py::array_t<double> rows_at(Loops& loops, const std::vector<std::pair<const char*, py::object>>& state, const std::vector<py::ssize_t>& shape, F f) {
  Arguments given(loops.set->model(), state);
  return written(loops.set->model(), given, py::none(), shape, [&](double* out) { f(given, out); });
}

// x, λ, forces (loops, 2, 6) on b and on a, the rank of Q, a state.
template <class Calls>
py::tuple on_loops(Loops& loops, Calls& calls, Arguments& given, AskedOnLoops asked, const PushedNodes& pushed, const Array& wrenches) {
  const Multibody& model = loops.set->model();
  asked.q = given[0], asked.v = given[1], asked.input = given[2], asked.pushed = &pushed;
  asked.wrenches = {"wrenches", wrenches.data(), 6 * static_cast<int>(pushed.nodes.size()), wrenches.ndim() == 3 ? static_cast<int>(wrenches.shape(0)) : -1};
  const int batch = common_batch({asked.q, asked.v, asked.input, asked.wrenches});
  const auto count = static_cast<py::ssize_t>(loops.set->names().size());
  py::array_t<double> x = output(py::none(), batch, {model.nv()}), multipliers = output(py::none(), batch, {loops.rows()}), forces = output(py::none(), batch, {count, 2, 6});
  std::vector<py::ssize_t> shape;
  if (batch >= 0) shape.push_back(batch);
  py::array_t<int> rank(shape);
  const ResultsOnLoops out{x.mutable_data(), multipliers.mutable_data(), forces.mutable_data(), rank.mutable_data()};
  {
    const Undisturbed undisturbed(model);
    calls.run(asked, out);
  }
  return py::make_tuple(x, multipliers, forces, rank);
}

}  // namespace

void register_loops(py::module_& m) {
  m.def("_loop_operators_again", [](const py::object& model) { return of_face("loop_source")(model); }, "As it was pickled.");
  const py::arg name("name"), a("a"), b("b"), q("q"), v("v"), precision("precision");
  py::class_<Loops> loops(m, "LoopSet", "The loops of a model, by name, and their rows at given states: pycraft.models.loop_set is its face.");
  unpicklable(loops)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("add_hinge", [](Loops& l, const std::string& name, const std::string& a, const std::string& b, const std::string& hinge,
                           const std::vector<py::object>& axes, const py::object& point, const py::object& pitch, const py::object& subhinges,
                           const py::object& rotation, const py::object& position) {
        const py::none none;
        l.set->add_hinge(name, a, b, hinge_from(name, hinge, axes, point, pitch, subhinges, rotation, position, none, none, none));
      }, name, a, b, py::arg("hinge"), py::arg("axes"), py::arg("point"), py::arg("pitch"), py::arg("subhinges"), py::arg("rotation"), py::arg("position"))
      .def("add_pair", [](Loops& l, const std::string& name, const std::string& a, const std::string& b, const std::string& kind, const py::object& number,
                          const py::object& quadric) {
        FramePair pair{a, b, kind_named(kind)};
        pair.number = one_number(number, ("the radius of '" + name + "'").c_str());
        if (!quadric.is_none()) {
          const py::tuple parts = quadric;
          const std::string what = " of the surface of '" + name + "'";
          pair.surface = {to_matrix3(parts[0], ("A" + what).c_str()), to_vector3(parts[1], ("b" + what).c_str()), one_number(parts[2], ("c" + what).c_str())};
        }
        l.set->add_pair(name, std::move(pair));
      }, name, a, b, py::arg("kind"), py::arg("number"), py::arg("quadric"))
      .def("add_curve", [](Loops& l, const std::string& name, const std::string& a, const std::string& b, const Array& coefficients, bool closed) {
        if (coefficients.ndim() != 3 || coefficients.shape(2) != 6) throw ModelError("loop '" + name + "': coefficients of a curve are (pieces, order, 6), not " + shape_text(coefficients));
        FramePair pair{a, b, PairKind::curve};
        const int pieces = static_cast<int>(coefficients.shape(0)), order = static_cast<int>(coefficients.shape(1));
        pair.curve = std::make_shared<const Curve>(coefficients.data(), pieces, order, closed, "loop '" + name + "'");
        l.set->add_pair(name, std::move(pair));
      }, name, a, b, py::arg("coefficients"), py::arg("closed"), "A point on a curve of polynomials, c and m a power (cpp/model/curve.h).")
      .def("add_coupling", [](Loops& l, const std::string& name, const std::vector<std::tuple<std::string, int, std::vector<double>>>& coordinates,
                              const py::object& constant, const py::object& function) {
        Coupling coupling;
        for (const auto& [hinge, coordinate, coefficients] : coordinates) coupling.coordinates.push_back({hinge, coordinate, coefficients});
        coupling.constant = one_number(constant, ("the constant of coupling '" + name + "'").c_str());
        if (!function.is_none())
          coupling.function = [held = std::make_shared<PythonCoupling>(function, name), n = static_cast<int>(coordinates.size())](
                                  const double* q, double* r, double* gradient, double* second, double* third) { (*held)(n, q, r, gradient, second, third); };
        l.set->add_coupling(name, std::move(coupling));
      }, name, py::arg("coordinates"), py::arg("constant"), py::arg("function"))
      .def("remove", [](Loops& l, const std::string& name) { l.set->remove(name); }, name)
      .def("names", [](const Loops& l) { return l.set->names(); }, "In order of declaration.")
      .def("tape", [](const Loops& l, const std::vector<double>& at_q, const std::vector<double>& at_v, const std::vector<double>& tau, size_t most) {
        const Multibody& model = l.set->model();
        const ModelInUse use(model);
        model.check_q(at_q.data(), at_q.size()), model.check_v(at_v.data(), at_v.size(), "v"), model.check_v(tau.data(), tau.size(), "tau");
        return plain_tape(recorded_on_loops(model, l.set->resolved(), at_q.data(), at_v.data(), tau.data(), most));
      }, q, v, py::arg("tau"), py::arg("most"), "What accelerations on the loops are, operation by operation, at states that are decided as this one (tapes.h).")
      .def("kind", [](const Loops& l, const std::string& name) {
        const Loop& loop = l.set->loop(name);
        return std::string(loop.is_coupling() ? "coupling" : record_of(loop.pair.kind).name);
      }, name)
      .def("rows", [](const Loops& l) {
        const ModelInUse use(l.set->model());
        const auto all = l.set->resolved();
        return py::make_tuple(all->names, all->of_positions);
      }, "Names of all rows, and which are of positions.")
      .def("first_rows", [](const Loops& l) {
        const ModelInUse use(l.set->model());
        std::vector<int> first;
        const auto all = l.set->resolved();
        for (const ResolvedLoop& loop : all->loops) first.push_back(loop.first_row);
        first.push_back(all->rows);
        return first;
      }, "Where each loop's rows begin, and the number of all.")
      .def("operators", [](Loops& l, const std::shared_ptr<MultibodyOperators>& base) -> std::shared_ptr<SkoSource> {
        const ModelInUse use(l.set->model());
        return std::make_shared<LoopOperators>(base, l.set);
      }, py::arg("base"), "The source of rows as operators, Q and A by body: pycraft/operators/loop_letters.py.")
      .def("ends", [](const Loops&, const std::shared_ptr<SkoSource>& operators) {
        return std::dynamic_pointer_cast<LoopOperators>(operators)->end_names();
      }, py::arg("operators"), "The bodies and nodes that A is of.")
      .def("residual", [](Loops& l, const py::object& q, Precision precision) {
        return rows_at(l, {{"q", q}}, {l.rows()}, [&](Arguments& given, double* out) { l.calls.residual(precision, given[0], out); });
      }, q, precision)
      .def("sizes", [](Loops& l, const py::object& q, Precision precision) {
        return rows_at(l, {{"q", q}}, {l.rows()}, [&](Arguments& given, double* out) { l.calls.sizes(precision, given[0], out); });
      }, q, precision)
      .def("jacobian", [](Loops& l, const py::object& q, Precision precision) {
        return rows_at(l, {{"q", q}}, {l.rows(), l.set->model().nv()}, [&](Arguments& given, double* out) { l.calls.jacobian(precision, given[0], out); });
      }, q, precision)
      .def("rates", [](Loops& l, const py::object& q, const py::object& v, Precision precision) {
        return rows_at(l, {{"q", q}, {"v", v}}, {l.rows()}, [&](Arguments& given, double* out) { l.calls.rates(precision, given[0], given[1], out); });
      }, q, v, precision)
      .def("bias", [](Loops& l, const py::object& q, const py::object& v, Precision precision) {
        return rows_at(l, {{"q", q}, {"v", v}}, {l.rows()}, [&](Arguments& given, double* out) { l.calls.bias(precision, given[0], given[1], out); });
      }, q, v, precision)
      .def("derivatives", [](Loops& l, const py::object& q, const py::object& v, const py::object& vdot, const Array& multipliers, Precision precision) {
        if (multipliers.ndim() != 1 || multipliers.size() != l.rows()) throw ModelError("multipliers are as many as rows, " + std::to_string(l.rows()) + ", not " + shape_text(multipliers));
        const py::ssize_t n = l.set->model().nv();
        return rows_at(l, {{"q", q}, {"v", v}, {"vdot", vdot}}, {3 * l.rows() + n, n},
                       [&](Arguments& given, double* out) { l.calls.derivatives(precision, given[0], given[1], given[2], multipliers.data(), out); });
      }, q, v, py::arg("vdot"), py::arg("multipliers"), precision, "One under the other ∂(Qv)/∂q, ∂(Q v̇ + Q̇v)/∂q and ∂(Q̇v)/∂v, a row each, and ∂(Q*λ)/∂q.")
      .def("accelerations", [](Loops& l, const py::object& q, const py::object& v, const py::object& tau, const std::vector<std::string>& names, bool in_world,
                               const Array& wrenches, Form form, const py::object& refine, const std::string& residual, Precision precision, double alpha, double beta) {
        const Multibody& model = l.set->model();
        Arguments given(model, {{"q", q}, {"v", v}, {"tau", tau}});
        AskedOnLoops asked;
        asked.form = form, asked.refinement = refinement(refine, residual, precision), asked.precision = precision, asked.alpha = alpha, asked.beta = beta;
        return on_loops(l, l.dynamics, given, asked, pushed_nodes(model, names, in_world), wrenches);
      }, q, v, py::arg("tau"), py::arg("names"), py::arg("in_world"), py::arg("wrenches"), py::arg("form"), py::arg("refine"), py::arg("residual"), precision,
         py::arg("alpha"), py::arg("beta"), "v̇, λ, forces of loops on b and on a, rank.")
      .def("embedded_accelerations", [](Loops& l, const py::object& q, const py::object& v, const py::object& tau, const std::vector<std::string>& names, bool in_world,
                                        const Array& wrenches, std::vector<int> independent, const py::object& refine, Precision precision) {
        const Multibody& model = l.set->model();
        Arguments given(model, {{"q", q}, {"v", v}, {"tau", tau}});
        AskedOnLoops asked;
        asked.independent = std::move(independent), asked.refinement = refinement(refine, "same", precision), asked.precision = precision;
        return on_loops(l, l.embedded, given, asked, pushed_nodes(model, names, in_world), wrenches);
      }, q, v, py::arg("tau"), py::arg("names"), py::arg("in_world"), py::arg("wrenches"), py::arg("independent"), py::arg("refine"), precision,
         "The same by independent coordinates, given by number or, without any, chosen at each state.")
      .def("velocities", [](Loops& l, const py::object& q, const py::object& v, const py::object& impulse, Form form, Precision precision) {
        Arguments given(l.set->model(), {{"q", q}, {"v", v}, {"impulse", impulse}});
        AskedOnLoops asked;
        asked.form = form, asked.precision = precision, asked.velocities = true;
        return on_loops(l, l.dynamics, given, asked, {}, Array(std::vector<py::ssize_t>{0, 6}));
      }, q, v, py::arg("impulse"), py::arg("form"), precision, "v⁺, impulses λ, impulses of loops on b and on a, rank.");
  loops.def_property_readonly("edits", [](const Loops& l) { return l.set->edits(); }, "Another number after every change of the set.")
      .def("effect", [](const Loops& l, std::vector<std::string> names, double alpha, double beta, bool embedded) -> std::shared_ptr<Effect> {
        return std::make_shared<KeepLoops>(l.set, std::move(names), alpha, beta, embedded);
      }, py::arg("names"), py::arg("alpha"), py::arg("beta"), py::arg("embedded"), "What keeps these loops in a scene, all without names.")
      .def("penalty", [](const Loops& l, const std::vector<std::string>& names, double frequency, double damping_ratio) -> std::shared_ptr<Effect> {
        return std::make_shared<LoopPenalty>(l.set, names, frequency, damping_ratio);
      }, py::arg("names"), py::arg("frequency"), py::arg("damping_ratio"), "What holds these loops in a scene by springs and dampers, all without names.")
      .def("springs", [](const Loops& l, const std::vector<std::string>& names, double frequency, double damping_ratio) {
        const LoopPenalty::Springs found = LoopPenalty(l.set, names, frequency, damping_ratio).springs({});
        return py::make_tuple(to_numpy(found.stiffness), to_numpy(found.damping));
      }, py::arg("names"), py::arg("frequency"), py::arg("damping_ratio"), "Stiffness and damping of the rows of such an effect that is alone.");
  m.def("_embedded", [](const std::shared_ptr<MultibodyOperators>& base, const Loops& l,
                        const std::vector<std::tuple<std::vector<int>, std::vector<int>, std::vector<int>>>& sets) {
    const ModelInUse use(l.set->model());
    std::vector<EmbeddedLoops> embedded;
    for (const auto& [bodies, rows, dependent] : sets) embedded.push_back({bodies, rows, dependent});
    return embedded_operators(base, l.set, std::move(embedded));
  }, py::arg("base"), py::arg("loops"), py::arg("sets"), "Of each set: bodies, rows of loops, dependent coordinates, by number.");
  m.def("_embedded_again", [](const py::object& model, const py::object& sets) { return of_face("embedded_source")(model, sets); }, "As it was pickled.");
}

}  // namespace pycraft
