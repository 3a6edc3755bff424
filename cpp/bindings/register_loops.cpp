#include "bindings/register_loops.h"

#include <cmath>

#include "bindings/direct_calls.h"
#include "bindings/hinge_arguments.h"
#include "dynamics/loop_calls.h"
#include "operators/loop_operators.h"

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

  void operator()(int n, const double* q, double* r, double* gradient, double* second) const {
    py::gil_scoped_acquire gil;
    const py::object given = f(py::array_t<double>(n, q));
    const std::string what = "the function of coupling '" + coupling + "'";
    if (!py::isinstance<py::tuple>(given) || py::len(given) != 3)
      throw ModelError(what + " returns (r, gradient, second derivatives), of shapes (), (n,), (n, n); no difference is taken in their place");
    const py::tuple parts = given;
    *r = one_number(parts[0], ("r of " + what).c_str());
    if (!std::isfinite(*r)) throw ModelError("r of " + what + " is not a finite number");
    copy(parts[1], "the gradient of " + what, {n}, gradient);
    copy(parts[2], "the second derivatives of " + what, {n, n}, second);
  }

 private:
  static void copy(const py::handle& given, const std::string& what, const std::vector<py::ssize_t>& shape, double* to) {
    const Array a = numbers(given, what.c_str());
    if (a.ndim() != static_cast<py::ssize_t>(shape.size()) || !std::equal(shape.begin(), shape.end(), a.shape()))
      throw ModelError(what + ": of " + std::to_string(shape[0]) + " coordinates it has that many numbers, or rows of them, not " + shape_text(a));
    for (py::ssize_t i = 0; i < a.size(); ++i) {
      if (!std::isfinite(a.data()[i])) throw ModelError(what + " has an entry that is not a finite number");
      to[i] = a.data()[i];
    }
  }
};

PairKind kind_named(const std::string& name) {
  for (const PairKind kind : {PairKind::blade, PairKind::wheel, PairKind::rolling_ball, PairKind::surface})
    if (name == record_of(kind).name) return kind;
  throw ModelError("a loop of kind '" + name + "': there are 'blade', 'wheel', 'rolling ball', 'surface', and hinges");
}

// Of one model: its loops and their rows.
struct Loops {
  explicit Loops(std::shared_ptr<Multibody> model) : set(std::make_shared<LoopSet>(std::move(model))), calls(set) {}
  std::shared_ptr<LoopSet> set;
  LoopCalls calls;
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

}  // namespace

void register_loops(py::module_& m) {
  m.def("_loop_operators_again", [](const py::object& model) { return of_face("loop_source")(model); }, "As it was pickled.");
  const py::arg name("name"), a("a"), b("b"), q("q"), v("v"), precision("precision");
  py::class_<Loops> loops(m, "LoopSet", "The loops of a model, by name, and their rows at given states: pycraft.models.loop_set is its face.");
  unpicklable(loops)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("add_hinge", [](Loops& l, const std::string& name, const std::string& a, const std::string& b, const std::string& hinge,
                           const std::vector<py::object>& axes, const py::object& point, const py::object& pitch, const py::object& rotation,
                           const py::object& position) {
        const py::none none;
        l.set->add_hinge(name, a, b, hinge_from(name, hinge, axes, point, pitch, none, rotation, position, none, none, none));
      }, name, a, b, py::arg("hinge"), py::arg("axes"), py::arg("point"), py::arg("pitch"), py::arg("rotation"), py::arg("position"))
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
      .def("add_coupling", [](Loops& l, const std::string& name, const std::vector<std::tuple<std::string, int, std::vector<double>>>& coordinates,
                              const py::object& constant, const py::object& function) {
        Coupling coupling;
        for (const auto& [hinge, coordinate, coefficients] : coordinates) coupling.coordinates.push_back({hinge, coordinate, coefficients});
        coupling.constant = one_number(constant, ("the constant of coupling '" + name + "'").c_str());
        if (!function.is_none())
          coupling.function = [held = std::make_shared<PythonCoupling>(function, name), n = static_cast<int>(coordinates.size())](
                                  const double* q, double* r, double* gradient, double* second) { (*held)(n, q, r, gradient, second); };
        l.set->add_coupling(name, std::move(coupling));
      }, name, py::arg("coordinates"), py::arg("constant"), py::arg("function"))
      .def("remove", [](Loops& l, const std::string& name) { l.set->remove(name); }, name)
      .def("names", [](const Loops& l) { return l.set->names(); }, "In order of declaration.")
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
        const auto of = std::dynamic_pointer_cast<LoopOperators>(operators);
        std::vector<std::vector<int>> rows;
        for (int k = 0; k < of->structure().bodies(); ++k) rows.push_back(of->rows_of(k));
        return py::make_tuple(of->end_names(), rows);
      }, py::arg("operators"), "The bodies and nodes that A is of, and by body the rows of `operators`.")
      .def("residual", [](Loops& l, const py::object& q, Precision precision) {
        return rows_at(l, {{"q", q}}, {l.rows()}, [&](Arguments& given, double* out) { l.calls.residual(precision, given[0], out); });
      }, q, precision)
      .def("jacobian", [](Loops& l, const py::object& q, Precision precision) {
        return rows_at(l, {{"q", q}}, {l.rows(), l.set->model().nv()}, [&](Arguments& given, double* out) { l.calls.jacobian(precision, given[0], out); });
      }, q, precision)
      .def("bias", [](Loops& l, const py::object& q, const py::object& v, Precision precision) {
        return rows_at(l, {{"q", q}, {"v", v}}, {l.rows()}, [&](Arguments& given, double* out) { l.calls.bias(precision, given[0], given[1], out); });
      }, q, v, precision);
}

}  // namespace pycraft
