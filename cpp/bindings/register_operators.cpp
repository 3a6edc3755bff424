// Operators: all arithmetic dispatch between operators, numbers and arrays lives here, and nowhere else.
#include <cmath>

#include "algebra/engine/evaluate.h"
#include "algebra/language/display.h"
#include "algebra/planning/square_root.h"
#include "algebra/language/properties.h"
#include "algebra/planning/planner.h"
#include "algebra/planning/simplify.h"
#include "algebra/theorems/polynomial.h"
#include "algebra/trees/matrix_tree.h"
#include "bindings/bindings.h"
#include "operators/multibody_operators.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

// Entries that dense() and numpy.asarray refuse to exceed: 512 MB.
constexpr double dense_limit = 64e6;

py::object not_implemented() { return py::reinterpret_borrow<py::object>(Py_NotImplemented); }
bool is_operator(const py::object& x) { return py::isinstance<Expression>(x); }
bool is_number(const py::object& x) {
  if (PyFloat_Check(x.ptr()) || PyLong_Check(x.ptr())) return true;
  if (py::hasattr(x, "as_integer_ratio")) return true;  // Fraction, Decimal
  if (!py::hasattr(x, "__float__") || !py::hasattr(x, "ndim") || x.attr("ndim").cast<int>() != 0) return false;
  return !py::hasattr(x, "dtype") || std::string("biuf").find(x.attr("dtype").attr("kind").cast<std::string>()) != std::string::npos;  // not complex
}
bool is_array(const py::object& x) { return py::isinstance<py::array>(x) || py::isinstance<py::list>(x) || py::isinstance<py::tuple>(x); }

// f(), its errors about an operational-space inertia without a value with what to do.
template <class F>
void with_remedy(const Expression& e, F f) {
  try {
    f();
  } catch (const SingularOperatorError& error) {
    bool of_nodes = false;
    visit(e, [&](const Expression& x) { of_nodes |= x.kind() == NodeKind::symbol && x.node().symbol.definition->id == SymbolId::Lambda; });
    if (!of_nodes) throw;
    throw SingularOperatorError(std::string(error.what()) + "; Λ is the inverse of B*ΩB, which has none where the nodes cannot move in every direction: take those " +
                                "in which they can, Lambda(nodes, directions=[\"x\", ...])");
  }
}

// The axes of a result: states, if there are several, and rows.
std::vector<py::ssize_t> rows_of(const Expression& e, int batch) {
  std::vector<py::ssize_t> shape;
  if (batch >= 0) shape.push_back(batch);
  shape.push_back(e.codomain().dimension());
  return shape;
}

// y = e x
py::object apply_to_array(Expression e, const py::object& given) {
  const Array x = real_array(given);
  const bool floating = e.floating();
  if (floating) {
    if (x.ndim() < 1 || x.ndim() > 2) throw EvaluationError("I is applied to an array (n,) or (n, m)");
    e = with_space(e, Space::euclidean(static_cast<int>(x.shape(0))));
  }
  auto plan = prepare(e, Request::apply);
  const int batch = floating ? -1 : plan->plan().batch;
  const py::ssize_t n = e.domain().dimension();
  const auto refuse = [&]() {
    std::string shape = "(";
    for (py::ssize_t i = 0; i < x.ndim(); ++i) shape += (i ? ", " : "") + std::to_string(x.shape(i));
    shape += x.ndim() == 1 ? ",)" : ")";
    std::string want = batch < 0 ? "(" + std::to_string(n) + ",) or (" + std::to_string(n) + ", m)"
                                 : "(" + std::to_string(n) + ",), (" + std::to_string(batch) + ", " + std::to_string(n) + ") or (" + std::to_string(batch) + ", " +
                                       std::to_string(n) + ", m)";
    throw EvaluationError(show(e) + " maps " + e.domain().description() + "; it takes an array of shape " + want + ", not " + shape);
  };
  Inputs inputs;
  inputs.x = x.data();
  bool columns = false;
  if (batch < 0 || x.ndim() == 1) {
    if (x.ndim() < 1 || x.ndim() > 2 || x.shape(0) != n) refuse();
    columns = x.ndim() == 2;
    inputs.columns = columns ? static_cast<int>(x.shape(1)) : 1;
  } else {
    if (x.ndim() > 3 || x.shape(0) != batch || x.shape(1) != n) refuse();
    columns = x.ndim() == 3;
    inputs.columns = columns ? static_cast<int>(x.shape(2)) : 1;
    inputs.batched = true;
  }
  std::vector<py::ssize_t> shape = rows_of(e, batch);
  if (columns) shape.push_back(inputs.columns);
  ArrayOfRun y(shape);
  {
    ReleasedGil release;
    with_remedy(e, [&] {
      while (!plan->run(inputs, false, y.result)) {  // the model changed since the plan was made
        check_interrupt();
        plan = prepare(e, Request::apply);
      }
    });
  }
  return y.array();
}

// x e = (e* x*)*
py::object apply_from_left(const py::object& given, const Expression& e) {
  const Array x = real_array(given);
  if (x.ndim() == 1) return apply_to_array(e.T(), x);
  if (x.ndim() != 2 || (!e.floating() && batch_of(e) >= 0))
    throw EvaluationError("an array multiplies an operator from the left as (n,) or (m, n), and without a batch bound");
  return apply_to_array(e.T(), x.attr("T")).attr("T");
}

py::object multiply(const Expression& a, const py::object& b) {
  if (is_operator(b)) return py::cast(a * b.cast<Expression>());
  if (is_number(b)) return py::cast(b.cast<Coefficient>() * a);
  if (is_array(b)) throw py::type_error("operator * array: `*` multiplies operators; apply an operator to an array with `@`");
  return not_implemented();
}

py::object add(const Expression& a, const py::object& b, double sign, bool reflected) {
  if (is_operator(b)) return py::cast(reflected ? b.cast<Expression>() + sign * a : (sign == 1 ? a + b.cast<Expression>() : a - b.cast<Expression>()));
  if (is_number(b)) {
    if (py::float_(b).cast<double>() == 0) return py::cast(reflected && sign != 1 ? -a : a);
    throw SpaceError("number + operator: a number is no operator; write " + std::string(py::str(b)) + "*I for a multiple of the identity");
  }
  if (is_array(b)) throw SpaceError("array + operator: an array has no spaces; make it an operator with pycraft.constant(array, domain, codomain)");
  return not_implemented();
}

void check_dense_size(const Expression& e, int batch) {
  const double entries = double(e.domain().dimension()) * e.codomain().dimension() * std::max(batch, 1);
  if (entries > dense_limit)
    throw EvaluationError(show(e) + " has " + std::to_string(e.codomain().dimension()) + " x " + std::to_string(e.domain().dimension()) +
                          " entries: too many for a dense matrix; apply it to vectors, or take diagonal(), trace(), logdet()");
}

py::object dense(const Expression& e, const py::object& dtype, bool rules) {
  if (e.floating()) throw SpaceError("I has no space yet: combine it with an operator before asking for its entries");
  const int batch = batch_of(e);
  check_dense_size(e, batch);
  const bool objects = wants_objects(dtype);
  std::vector<py::ssize_t> shape = rows_of(e, batch);
  shape.push_back(e.domain().dimension());
  ArrayOfRun y(shape, objects);
  {
    ReleasedGil release;
    with_remedy(e, [&] { evaluate(e, Request::dense, y.result, rules, objects); });
  }
  return y.array();
}

py::object diagonal(const Expression& e) {
  if (e.floating()) throw SpaceError("I has no space yet: combine it with an operator before asking for its entries");
  ArrayOfRun y(rows_of(e, batch_of(e)));
  {
    ReleasedGil release;
    with_remedy(e, [&] { evaluate(e, Request::diagonal, y.result); });
  }
  return y.array();
}

// The value of a vector expression, named vectors given by name.
py::object value(const Expression& e, const py::kwargs& vectors) {
  if (e.floating() || !(e.domain() == Space::euclidean(1)))
    throw SpaceError(show(e) + " is an operator, not a vector; its entries are dense()");
  Inputs inputs;
  py::object dtype = py::none();
  bool rules = true;
  for (const auto& [name, array] : vectors) {
    const std::string key = py::cast<std::string>(name);
    if (key == "dtype") {
      dtype = py::reinterpret_borrow<py::object>(array);
      continue;
    }
    if (key == "rules") {
      rules = py::cast<bool>(array);
      continue;
    }
    const Array a = real_array(py::reinterpret_borrow<py::object>(array));
    inputs.vectors[key].assign(a.data(), a.data() + a.size());
  }
  const bool objects = wants_objects(dtype);
  ArrayOfRun y(rows_of(e, batch_of(e)), objects);
  {
    ReleasedGil release;
    with_remedy(e, [&] { apply(e, inputs, y.result, rules, objects); });
  }
  return y.array();
}

void define_spaces_and_states(py::class_<Expression>& op) {
  op.def_property_readonly("domain", [](const Expression& e) { return e.floating() ? py::object(py::none()) : py::cast(e.domain()); }, "The space it acts on; None for an I that has none yet.")
      .def_property_readonly("codomain", [](const Expression& e) { return e.floating() ? py::object(py::none()) : py::cast(e.codomain()); })
      .def_property_readonly("shape", [](const Expression& e) {
        if (e.floating()) throw SpaceError("I has no space yet, and no shape");
        return py::make_tuple(e.codomain().dimension(), e.domain().dimension());
      })
      .def_property_readonly("T", &Expression::T, "The transpose, the book's star: A: X→Y gives A.T: Y'→X'. Cost: none.")
      .def("inv", &Expression::inv, "The inverse, as an expression; how it is evaluated is the planner's business (see explain).")
      .def("sqrt", &square_root, "L with A = L L.T, body by body; for symmetric block-diagonal operators.")
      .def("at", [](const Expression& e, const py::object& q, const py::object& v, Form form, const py::object& refine, const std::string& residual, Precision precision, const py::object& threads) {
        return e.at(make_binding({e}, q, v, {form, refinement(refine, residual, precision), precision}, threads));
      }, py::arg("q") = py::none(), py::arg("v") = py::none(), py::kw_only(), py::arg("form") = Form::fast, py::arg("refine") = 0, py::arg("residual") = "same", py::arg("precision") = Precision::double_, py::arg("threads") = 1,
         "The same expression bound to a state: q (nq,) or a batch (B, nq), v likewise (zero if left out); q=None takes the model's present state.\n"
         "The innermost binding wins. form: \"fast\", \"ud\" or \"square-root\", of the articulated-inertia sweep; refine: corrections of what is solved, a\n"
         "number or \"auto\", with residual=\"same\", \"gather\" or \"wider\"; precision: \"single\", \"double\", \"extended\", \"quad\", 50, 100; threads: share a batch.")
      .def("_bound", [](const Expression& e, const std::shared_ptr<const Binding>& b) { return e.at(b); });
}

void define_arithmetic(py::class_<Expression>& op) {
  op.def("__matmul__", [](const Expression& a, const py::object& b) -> py::object {
    if (is_operator(b)) return py::cast(a * b.cast<Expression>());
    if (is_array(b)) return apply_to_array(a, b);
    return not_implemented();
  })
      .def("__rmatmul__", [](const Expression& a, const py::object& b) -> py::object { return is_array(b) ? apply_from_left(b, a) : not_implemented(); })
      .def("__mul__", &multiply)
      .def("__rmul__", [](const Expression& a, const py::object& b) -> py::object {
        if (is_number(b)) return py::cast(b.cast<Coefficient>() * a);
        if (is_array(b)) throw py::type_error("array * operator: multiply an array and an operator with `@`");
        return not_implemented();
      })
      .def("__truediv__", [](const Expression& a, const py::object& b) -> py::object {
        if (!is_number(b)) return is_operator(b) ? throw SpaceError("operator / operator: multiply by inv() on the side you mean") : not_implemented();
        const auto c = b.cast<Coefficient>();
        if (c.is_zero()) {
          PyErr_SetString(PyExc_ZeroDivisionError, "operator divided by zero");
          throw py::error_already_set();
        }
        return py::cast(a / c);
      })
      .def("__neg__", [](const Expression& a) { return -a; })
      .def("__pos__", [](const Expression& a) { return a; })
      .def("__add__", [](const Expression& a, const py::object& b) { return add(a, b, 1, false); })
      .def("__radd__", [](const Expression& a, const py::object& b) { return add(a, b, 1, true); })
      .def("__sub__", [](const Expression& a, const py::object& b) { return add(a, b, -1, false); })
      .def("__rsub__", [](const Expression& a, const py::object& b) { return add(a, b, -1, true); })
      .def("__pow__", [](const Expression& a, const py::object& n) -> py::object {
        if (!PyIndex_Check(n.ptr())) throw py::type_error("operator ** n takes a whole number; there is sqrt() for block-diagonal operators");
        return py::cast(power(a, clipped(n)));
      })
      .def("__eq__", [](const Expression& a, const py::object& b) -> py::object { return is_operator(b) ? py::cast(a == b.cast<Expression>()) : not_implemented(); },
           "Structural equality after flattening sums and products: a bool, no numbers. Equality by value is pycraft.check.")
      .def("__hash__", [](const Expression& e) { return static_cast<py::ssize_t>(e.node().hash >> 1); });
}

void define_numbers(py::class_<Expression>& op) {
  op.def("dense", &dense, py::arg("dtype") = py::none(), py::arg("rules") = true,
         "The operator as an array (codomain, domain), with a leading batch axis if one is bound. dtype=object keeps a wider precision as\n"
         "mpmath numbers; rules=False evaluates what was typed, no theorem used.")
      .def("__array__", [](const Expression& e, const py::object& dtype, const py::object&) {
        py::object a = dense(e, py::none(), true);
        return dtype.is_none() ? a : a.attr("astype")(dtype);
      }, py::arg("dtype") = py::none(), py::arg("copy") = py::none())
      .def("diagonal", &diagonal, "The diagonal entries (n,), or (B, n). Cost O(N).")
      .def("value", &value, "The value of a vector expression; named vectors (pycraft.vector) are given by name. rules=False evaluates what was typed.")
      .def("trace", [](const Expression& e) { return trace(e); }, "The trace, as a scalar expression. Cost O(N).")
      .def("logdet", [](const Expression& e) { return logdet(e); }, "ln|det|, as a scalar expression. Cost O(N); exact by structure where a theorem gives it.")
      .def("norm", [](const Expression& e) { return norm(e); }, "The Frobenius norm, as a scalar expression.");
}

// What the planner and the faces make of it.
void define_planning(py::class_<Expression>& op) {
  op.def("simplify", [](const Expression& e) {
    ReleasedGil release;
    return simplify(e);
  }, "The shortest expression that the rewriting theorems find equal to this one.")
      .def_property_readonly("is_symmetric", &is_symmetric, "Known by rule, no number looked at.")
      .def_property_readonly("is_block_diagonal", [](const Expression& e) { return is_block_diagonal(e); }, "Known by rule.")
      .def_property_readonly("is_upper_triangular", [](const Expression& e) { return is_upper_triangular(e); }, "By blocks, parents before children: φ and ψ are. Known by rule.")
      .def_property_readonly("is_lower_triangular", [](const Expression& e) { return is_lower_triangular(e); }, "By blocks: φ* and ψ* are. Known by rule.")
      .def("explain", [](const Expression& e, const std::string& request) { return of_face("explain")(e, request); },
           py::arg("request") = "apply", "The plan as a table: steps, tiers, cost; shown when it is the last line of a cell.")
      .def("algorithm", [](const Expression& e, const std::string& language, const std::string& request) {
        return of_face("algorithm")(e, language, request);
      }, py::arg("language") = "text", py::arg("request") = "apply",
           "The plan written out as the textbook recursion: language \"text\", \"latex\", or \"python\" (NumPy alone) and \"cpp\" (Eigen alone),\n"
           "source that runs by itself. See pycraft.recursions.")
      .def("animate", [](const Expression& e, const py::object& x, const std::string& on, const std::string& request) { return of_face("animate")(e, x, on, request); },
           py::arg("x") = py::none(), py::kw_only(), py::arg("on") = "tree", py::arg("request") = "apply",
           "The sweeps of the plan for x (ones where it is left out) as a film on the tree, or on=\"robot\", with a page by save. See pycraft.view.SweepFilm.")
      .def("play", [](const Expression& e, const py::object& x) { return of_face("animate")(e, x, "robot", "apply"); }, py::arg("x") = py::none(), "`animate` on the model as it stands.")
      .def("compile", [](const Expression& e, const std::string& request) { return of_face("compile_expression")(e, request); },
           py::arg("request") = "apply",
           "The plan written out as straight-line C++, built and loaded: a callable of q, of v where velocities matter, of x for \"apply\" and not\n"
           "for \"dense\", \"diagonal\", \"trace\", \"logdet\" and \"norm\"; one state or a batch, out=. See Multibody.compile, docs/compiled.md.")
      .def("certify", [](const py::object& self, const py::args& args, const py::kwargs& kwargs) {
        return of_face("certify_expression")(self, *args, **kwargs);
      }, "certify(q=None, x=None, *, v=None, form=\"fast\", refine=0, residual=\"same\", precision=\"double\", seed=0, seconds=0.02)\n\n"
         "The value at one state, the dense form or the product with x, with its measured error, what rounding of q, v and x does,\n"
         "condition, where digits are lost and what the next rung costs: a pycraft.accuracy.certificates.certificate.Certificate. q: (nq,) or a State,\n"
         "the model's present state where left out; x: (n,) or (n, m); v: (nv,), zero where left out; form, refine, residual and precision\n"
         "as in at; seed: of the signs by which the data are moved; seconds: spent on each timing. Raises EvaluationError where the\n"
         "expression is bound already, ModelError for arrays of another shape and for a model without coordinates.")
      .def("blocks", [](const Expression& e, const std::string& order) { return of_face("block_view")(e, order); },
           py::arg("order") = "base-to-tip", "A labelled block view of the dense form; order=\"tip-to-base\" shows the book's triangles.")
      .def("plan", [](const Expression& e, const std::string& request, bool rules) {
        static const std::pair<const char*, Request> names[] = {{"apply", Request::apply}, {"dense", Request::dense}, {"diagonal", Request::diagonal},
                                                                {"blockdiag", Request::block_diagonal}, {"trace", Request::trace},
                                                                {"logdet", Request::logdet}, {"norm", Request::norm}};
        for (const auto& [name, r] : names)
          if (request == name) {
            ReleasedGil release;
            return prepare(e, r, rules);
          }
        throw EvaluationError("no plan is made for '" + request + "'; there are apply, dense, diagonal, blockdiag, trace, logdet, norm");
      }, py::arg("request") = "apply", py::arg("rules") = true, "The plan: what is run, step by step, with its cost.");
}

// What it is made of.
void define_structure(py::class_<Expression>& op) {
  op.def_property_readonly("children", [](const Expression& e) { return e.children(); })
      .def_property_readonly("kind", [](const Expression& e) {
        static const char* names[] = {"symbol", "vector", "identity", "zero", "constant", "external", "sum", "product", "scaled", "transpose", "inverse", "blockdiag", "sqrt", "function"};
        return names[static_cast<int>(e.kind())];
      })
      .def_property_readonly("coefficient", [](const Expression& e) { return e.node().coefficient; },
                             "The number in front: a float where it is one exactly, else a Fraction.")
      .def_property_readonly("name", [](const Expression& e) -> py::object {
        if (e.kind() == NodeKind::symbol || e.kind() == NodeKind::block_function) return py::cast(e.node().symbol.definition->ascii);
        if (e.kind() == NodeKind::vector) return py::cast(e.node().name);
        if (e.kind() == NodeKind::constant) return py::cast(e.node().constant->name);
        return py::none();
      }, "A symbol's or a function's ASCII name, a vector's or a constant's own; None for what is composed.")
      .def_property_readonly("letter", [](const Expression& e) -> py::object {
        const bool has = e.kind() == NodeKind::symbol || (e.kind() == NodeKind::block_function && e.node().symbol.source);
        return has ? py::cast(Letter{e.node().symbol}) : py::none();
      }, "What stands behind a symbol, or a function of a model: a Letter. None for anything else.")
      .def_property_readonly("batch", [](const Expression& e) -> py::object { return batch_of(e) < 0 ? py::object(py::none()) : py::cast(batch_of(e)); })
      .def_property_readonly("_state", [](const Expression& e) -> py::object {
        const auto all = contexts(e);
        if (all.empty() || !all[0].binding) return py::none();
        const Binding& b = *all[0].binding;
        const auto shaped = [&](const std::vector<double>& x, int width) {
          py::object a = to_numpy(x);
          return b.batch < 0 ? a : a.attr("reshape")(b.batch, width);
        };
        return py::make_tuple(shaped(b.q, b.nq), shaped(b.v, b.nv), b.arithmetic.precision);
      }, "(q, v, precision) that it is bound to, None where it is not.")
      .def_property_readonly("definition", [](const Expression& e) {
        const bool compound = e.kind() == NodeKind::symbol && e.node().symbol.definition->expand;
        return compound ? py::cast(e.node().symbol.definition->expand(e.node().symbol)) : py::object(py::none());
      }, "What a letter abbreviates: EφG of K, B*φ*H* of 𝒥; None for what is no such letter.")
      .def("_with_operand", [](const Expression& e, const Expression& operand) {
        if (e.kind() != NodeKind::block_function) throw EvaluationError(show(e) + " is no function of an operand");
        const Symbol& s = e.node().symbol;
        return s.source ? block_function(*s.definition, s.source, s.binding, operand) : lower_half(operand);
      }, "The same function of another operand.")
      .def("check_current", &Expression::check_current, "Raises StaleOperatorError if a model's structure changed since this was made.")
      .def_property_readonly("sources", [](const Expression& e) {
        py::list all;
        for (const Context& c : contexts(e)) all.append(py::cast(c.source));
        return all;
      });
}

void define_text(py::class_<Expression>& op) {
  op.def("text", [](const Expression& e) { return show_in_full(e); }, "As the book prints it, in Unicode; EvaluationError beyond ten million characters.")
      .def("latex", [](const Expression& e) { return show_in_full(e, Style::latex); })
      .def("python", [](const Expression& e) { return show_in_full(e, Style::python); }, "As Python reads it.")
      .def("__str__", [](const Expression& e) { return show(e, Style::unicode, 100000); })
      .def("__repr__", [](const Expression& e) {
        const std::string text = show(e);
        if (e.floating()) return "<" + text + ">";
        return "<" + text + " : " + e.domain().description() + " → " + e.codomain().description() + ">";
      })
      .def("_repr_latex_", [](const py::object& e) -> py::object {
        const std::string text = show(e.cast<const Expression&>(), Style::latex, 20000);  // half a formula is no LaTeX: what is longer shows as its repr
        return text.ends_with(" …") ? py::object(py::none()) : of_face("expression_latex")(e, text);
      }, "The formula, broken where it is long, and below it spaces, structure and cost.")
      .def("_parts", &parts)
      .def("__reduce__", [](const Expression& e) -> py::tuple {
        return py::make_tuple(of_face("operator_from_nodes"), py::make_tuple(all_parts(e)));
      });
}

}  // namespace

void register_operators(py::module_& m) {
  auto op = declared<py::class_<Expression>>(m, "Operator");
  op.attr("__array_ufunc__") = py::none();
  op.attr("__array_priority__") = py::float_(1000.0);
  define_spaces_and_states(op);
  define_arithmetic(op);
  define_numbers(op);
  define_planning(op);
  define_structure(op);
  define_text(op);
  m.def("identity", [](const py::object& space) { return space.is_none() ? identity() : identity(space.cast<Space>()); }, py::arg("space") = py::none(),
        "I; without a space it takes that of the operator it is combined with.");
  m.def("zero", &zero, py::arg("domain"), py::arg("codomain"), "The zero operator.");
  m.def("vector", &make_vector, py::arg("name"), py::arg("space"), "A named vector of a space: stands for an array that is given at the evaluation.");
  m.def("blockdiag", &block_diagonal, py::arg("operator"), "The operator's diagonal blocks, body by body, zero elsewhere.");
  m.def("equal_by_theorems", [](const Expression& a, const Expression& b) {
    ReleasedGil release;
    return equal_by_theorems(a, b);
  }, py::arg("a"), py::arg("b"), "Whether the rewriting theorems bring both to the same normal form.");
}

}  // namespace pycraft
