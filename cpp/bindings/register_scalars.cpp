#include <cmath>

#include "algebra/engine/evaluate.h"
#include "algebra/language/display.h"
#include "algebra/language/scalar_expression.h"
#include "bindings/bindings.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

py::object value(const Scalar& s) {
  int batch = -1;
  std::vector<double> v;
  {
    ReleasedGil release;
    v = evaluate(s, &batch);
  }
  if (batch < 0) return py::float_(v[0]);
  return to_numpy(v);
}

// What stands behind a scalar's formula where it is shown: its value, or how many it has; nothing where it has none at present.
std::string shown_value(const Scalar& s, const char* equals) {
  try {
    const py::object v = value(s);
    if (!py::isinstance<py::float_>(v)) return ", at " + std::to_string(py::len(v)) + " states";
    return equals + std::string(py::str(v.attr("__format__")(".12g")));
  } catch (const Error&) {
    return "";
  }
}

// A number beside a scalar; an operator is refused: the scalar would have to be frozen at the present state.
Coefficient factor(const py::object& x) {
  if (py::isinstance<Expression>(x))
    throw py::type_error(std::string("a scalar expression is added to and multiplied by scalars and numbers, not operators; for its value at the present state write float(...)"));
  return to_coefficient(x);
}

Scalar quotient(const Scalar& a, const Coefficient& c) {
  if (c.is_zero()) {
    PyErr_SetString(PyExc_ZeroDivisionError, "scalar divided by zero");
    throw py::error_already_set();
  }
  return (1 / c) * a;
}

double single(const Scalar& s) {
  const py::object v = value(s);
  if (!py::isinstance<py::float_>(v)) throw py::type_error("this scalar is bound to a batch of states: take it with numpy.asarray");
  return v.cast<double>();
}

}  // namespace

void register_scalars(py::module_& m) {
  auto scalar = declared<py::class_<Scalar>>(m, "Scalar");
  scalar.attr("__array_ufunc__") = py::none();
  scalar.def("value", &value, "The number; with a batch bound, an array (batch,).")
      .def("__float__", &single)
      .def("__array__", [](const Scalar& s, const py::object& dtype, const py::object&) {
        return py::module_::import("numpy").attr("array")(value(s), dtype);
      }, py::arg("dtype") = py::none(), py::arg("copy") = py::none())
      .def("__format__", [](const Scalar& s, const std::string& spec) { return py::float_(single(s)).attr("__format__")(spec); })
      .def("at", [](const Scalar& s, const py::args& args, const py::kwargs& kwargs) {
        return of_face("scalar_at")(s, *args, **kwargs);
      })
      .def("certify", [](const py::object& self, const py::args& args, const py::kwargs& kwargs) {
        return of_face("certify_expression")(self, *args, **kwargs);
      }, "certify(q=None, *, v=None, form=\"fast\", refine=0, residual=\"same\", precision=\"double\", seed=0, seconds=0.02)\n\n"
         "The number at one state with its measured error, what rounding of q and v does, where digits are lost and what the next rung\n"
         "costs: a pycraft.accuracy.certificates.certificate.Certificate. q: (nq,) or a State, the model's present state where left out; v: (nv,), zero\n"
         "where left out; form, refine, residual and precision as in at; seed: of the signs by which the data are moved; seconds: spent\n"
         "on each timing. Raises EvaluationError where it is bound already, ModelError for arrays of another shape and for a model\n"
         "without coordinates.")
      .def("gradient", [](const Scalar& s, const std::string& over) { return of_face("scalar_gradient")(s, over); },
           py::arg("over") = "coordinates",
           "All derivatives at once, as an array: over \"coordinates\" (nv,), or (B, nv) where a batch is bound; where loops are embedded along the\n"
           "independent coordinates, zero where nothing moves. Of ln det(HφMφ*H* [+ J]) and\n"
           "ln det D in three sweeps, O(N), and then also over \"inertias\", \"geometry\", \"axes\" (see\n"
           "Multibody.log_determinant_gradient); of any other scalar one derivative after the other, O(N) each.")
      .def("operands", [](const Scalar& s) {
        py::list all;
        visit(s, [&](const Expression& e) { all.append(py::cast(e)); });
        return all;
      })
      .def("bound", [](const Scalar& s, const std::shared_ptr<const Binding>& b) { return at(s, b); })
      .def("__add__", [](const Scalar& a, const Scalar& b) { return a + b; })
      .def("__add__", [](const Scalar& a, const py::object& b) { return a + number(factor(b)); })
      .def("__radd__", [](const Scalar& a, const py::object& b) { return number(factor(b)) + a; })
      .def("__sub__", [](const Scalar& a, const Scalar& b) { return a - b; })
      .def("__sub__", [](const Scalar& a, const py::object& b) { return a - number(factor(b)); })
      .def("__rsub__", [](const Scalar& a, const py::object& b) { return number(factor(b)) - a; })
      .def("__mul__", [](const Scalar& a, const Scalar& b) { return a * b; })
      .def("__mul__", [](const Scalar& a, const py::object& c) { return factor(c) * a; })
      .def("__rmul__", [](const Scalar& a, const py::object& c) { return factor(c) * a; })
      .def("__truediv__", [](const Scalar& a, const Scalar& b) { return a * reciprocal(b); })
      .def("__truediv__", [](const Scalar& a, const py::object& c) { return quotient(a, factor(c)); })
      .def("__rtruediv__", [](const Scalar& a, const py::object& c) { return number(factor(c)) * reciprocal(a); })
      .def("__pow__", [](const Scalar& a, const py::object& n) {
        if (!PyIndex_Check(n.ptr())) throw py::type_error("scalar ** n takes a whole number");
        return power(a, clipped(n));
      })
      .def("__neg__", [](const Scalar& a) { return -1 * a; })
      .def("__abs__", [](const Scalar& a) { return std::abs(single(a)); })
      .def("__lt__", [](const Scalar& a, double b) { return single(a) < b; })
      .def("__le__", [](const Scalar& a, double b) { return single(a) <= b; })
      .def("__gt__", [](const Scalar& a, double b) { return single(a) > b; })
      .def("__ge__", [](const Scalar& a, double b) { return single(a) >= b; })
      .def("__eq__", [](const Scalar& a, const Scalar& b) { return a == b; })
      .def("__hash__", [](const Scalar& a) { return std::hash<std::string>()(show(a)); })
      .def("animate", [](const Scalar& a, const std::string& on) { return of_face("animate")(a, py::none(), on, "apply"); }, py::kw_only(), py::arg("on") = "tree",
           "As of operators: the sweeps of the plan as a film.")
      .def("algorithm", [](const Scalar& a, const std::string& language) {
        return of_face("algorithm")(a, language);
      }, py::arg("language") = "text", "The recursion that computes it: \"text\", \"latex\", \"python\" or \"cpp\". See pycraft.recursions.")
      .def("compile", [](const Scalar& a) { return of_face("compile_expression")(a, "apply"); },
           "Written out for this model as straight-line C++, built and loaded: a callable of q, and of v where velocities matter. See\n"
           "Multibody.compile.")
      .def("text", [](const Scalar& a) { return show(a); })
      .def("latex", [](const Scalar& a) { return show(a, Style::latex); })
      .def("_repr_latex_", [](const Scalar& a) { return of_face("formula_latex")(show(a, Style::latex) + shown_value(a, " = ")); })
      .def("__repr__", [](const Scalar& a) { return "<scalar " + show(a) + shown_value(a, " = ") + ">"; })
      // ---- the tree, to be read
      .def_property_readonly("kind", [](const Scalar& a) { return scalar_kind_name(a.node().kind); },
                             "\"number\", \"trace\", \"logdet\", \"norm\", \"sum\", \"scaled\", \"product\" or \"reciprocal\".")
      .def_property_readonly("number", [](const Scalar& a) -> py::object {
        const bool has = a.node().kind == ScalarKind::number || a.node().kind == ScalarKind::scaled;
        return has ? to_number(a.node().value) : py::object(py::none());
      }, "The number, or that in front of what is scaled: a float where it is one exactly, else a Fraction. None for other kinds.")
      .def_property_readonly("operand", [](const Scalar& a) -> py::object { return a.node().operand ? py::cast(a.node().operand) : py::none(); },
                             "The operator that a trace, ln|det| or norm is of; None for other kinds.")
      .def_property_readonly("terms", [](const Scalar& a) { return a.node().terms; }, "What a sum, product, multiple or reciprocal is made of, as scalars.")
      .def("_parts", [](const Scalar& a) {
        const auto& n = a.node();
        return py::make_tuple(static_cast<int>(n.kind), to_number(n.value), n.operand ? py::cast(n.operand) : py::none(), py::cast(n.terms));
      })
      .def("__reduce__", [](const Scalar& a) -> py::tuple {
        return py::make_tuple(py::module_::import("pycraft._core").attr("_scalar_from_parts"), py::cast(a).attr("_parts")());
      });
  m.def("_scalar_from_parts", [](int kind, const Coefficient& value, const py::object& operand, const std::vector<Scalar>& terms) {
    return Scalar({static_cast<ScalarKind>(kind), value, operand.is_none() ? Expression() : operand.cast<Expression>(), terms});
  });
  m.def("scalar", &number, py::arg("value"));
}

}  // namespace pycraft
