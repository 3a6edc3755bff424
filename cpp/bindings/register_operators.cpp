// Operators: all arithmetic dispatch between operators, numbers and arrays lives here, and nowhere else.
#include <cmath>

#include "algebra/errors.h"
#include "algebra/matrix_tree.h"
#include "algebra/planner.h"
#include "algebra/polynomial.h"
#include "algebra/properties.h"
#include "algebra/simplify.h"
#include "bindings/bindings.h"
#include "operators/multibody_operators.h"

namespace pycraft {

namespace {

}  // namespace

// The symbol of this name of a source; node operators take node names, Delta a coordinate.
Expression source_symbol(const std::shared_ptr<SkoSource>& source, const std::string& name, const std::vector<std::string>& nodes, int coordinate);

namespace {

// Entries that dense() and numpy.asarray refuse to exceed: 512 MB.
constexpr double dense_limit = 64e6;

py::object not_implemented() { return py::reinterpret_borrow<py::object>(Py_NotImplemented); }
bool is_operator(const py::object& x) { return py::isinstance<Expression>(x); }
bool is_number(const py::object& x) {
  if (PyFloat_Check(x.ptr()) || PyLong_Check(x.ptr())) return true;
  return py::hasattr(x, "__float__") && py::hasattr(x, "ndim") && x.attr("ndim").cast<int>() == 0 && !py::hasattr(x, "imag_is_set");
}
bool is_array(const py::object& x) { return py::isinstance<py::array>(x) || py::isinstance<py::list>(x) || py::isinstance<py::tuple>(x); }

int batch_of(const Expression& e) {
  for (const Context& c : contexts(e))
    if (c.binding && c.binding->batch >= 0) return c.binding->batch;
  return -1;
}

Array real_array(const py::object& x) {
  if (py::isinstance<py::array>(x) && py::cast<py::array>(x).dtype().kind() == 'c')
    throw py::type_error("operators act on real arrays; apply them to the real and imaginary parts");
  Array a = Array::ensure(x);
  if (!a) {
    PyErr_Clear();
    throw py::type_error("an operator is applied to an array of numbers, not to this");
  }
  return a;
}

// y = e x
py::object apply_to_array(Expression e, const py::object& given) {
  const Array x = real_array(given);
  const int batch = e.floating() ? -1 : batch_of(e);
  if (e.floating()) {
    if (x.ndim() < 1 || x.ndim() > 2) throw EvaluationError("I is applied to an array (n,) or (n, m)");
    e = with_space(e, Space::euclidean(static_cast<int>(x.shape(0))));
  }
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
  Result r;
  {
    py::gil_scoped_release release;
    apply(e, inputs, r);
  }
  std::vector<py::ssize_t> shape;
  if (batch >= 0) shape.push_back(batch);
  shape.push_back(e.codomain().dimension());
  if (columns) shape.push_back(inputs.columns);
  return to_array(r, shape);
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
  if (is_number(b)) return py::cast(py::float_(b).cast<double>() * a);
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
  Result r;
  {
    py::gil_scoped_release release;
    evaluate(e, Request::dense, r, rules, objects);
  }
  std::vector<py::ssize_t> shape;
  if (batch >= 0) shape.push_back(batch);
  shape.push_back(e.codomain().dimension());
  shape.push_back(e.domain().dimension());
  return to_array(r, shape);
}

py::object diagonal(const Expression& e) {
  if (e.floating()) throw SpaceError("I has no space yet: combine it with an operator before asking for its entries");
  const int batch = batch_of(e);
  Result r;
  {
    py::gil_scoped_release release;
    evaluate(e, Request::diagonal, r);
  }
  std::vector<py::ssize_t> shape;
  if (batch >= 0) shape.push_back(batch);
  shape.push_back(e.codomain().dimension());
  return to_array(r, shape);
}

// The value of a vector expression, named vectors given by name.
py::object value(const Expression& e, const py::kwargs& vectors) {
  if (e.floating() || !(e.domain() == Space::euclidean(1)))
    throw SpaceError(show(e) + " is an operator, not a vector; its entries are dense()");
  Inputs inputs;
  py::object dtype = py::none();
  for (const auto& [name, array] : vectors) {
    const std::string key = py::cast<std::string>(name);
    if (key == "dtype") {
      dtype = py::reinterpret_borrow<py::object>(array);
      continue;
    }
    const Array a = real_array(py::reinterpret_borrow<py::object>(array));
    inputs.vectors[key].assign(a.data(), a.data() + a.size());
  }
  const int batch = batch_of(e);
  Result r;
  const bool objects = wants_objects(dtype);
  {
    py::gil_scoped_release release;
    apply(e, inputs, r, true, objects);
  }
  std::vector<py::ssize_t> shape;
  if (batch >= 0) shape.push_back(batch);
  shape.push_back(e.codomain().dimension());
  return to_array(r, shape);
}

std::shared_ptr<const Binding> make_binding(const std::vector<Expression>& operands, const py::object& q_given, const py::object& v_given, const std::string& form,
                                            int refine, const std::string& precision) {
  if (form != "fast") throw EvaluationError("form '" + form + "' of the articulated-inertia sweep is not there; there is 'fast'");
  if (refine != 0) throw EvaluationError("refine=" + std::to_string(refine) + ": refinement is not there yet; there is refine=0");
  auto binding = std::make_shared<Binding>();
  binding->form = form;
  binding->precision = precision_from_name(precision);
  std::vector<std::shared_ptr<SkoSource>> sources;
  for (const Expression& e : operands)
    for (const Context& c : contexts(e))
      if (!c.binding && std::find(sources.begin(), sources.end(), c.source) == sources.end()) sources.push_back(c.source);
  if (sources.empty()) return binding;  // nothing to bind
  for (const auto& s : sources) s->check_current();
  int nq = 0, nv = 0;
  for (const auto& s : sources)
    if (s->nq() || s->nv()) nq = s->nq(), nv = s->nv();
  if (q_given.is_none()) {
    for (const auto& s : sources)
      if (s->nq() || s->nv()) {
        const auto now = s->state();
        binding->q = now->q;
        binding->v = now->v;
      }
    if (sources.size() > 1)
      for (const auto& s : sources)
        if (s->nq() && (s->nq() != nq)) throw EvaluationError("operators of two models: bind each with its own .at(q)");
  } else {
    py::object q = q_given, v = v_given;
    if (py::hasattr(q, "q") && py::hasattr(q, "v")) {
      v = q.attr("v");
      q = q.attr("q");
    }
    const Array a = real_array(q);
    if (a.ndim() != 1 && a.ndim() != 2) throw ModelError("a state is an array (nq,), a batch of states (B, nq)");
    const py::ssize_t width = a.shape(a.ndim() - 1);
    binding->batch = a.ndim() == 2 ? static_cast<int>(a.shape(0)) : -1;
    const int states = std::max(binding->batch, a.ndim() == 2 ? 0 : 1);
    binding->q.assign(a.data(), a.data() + a.size());
    binding->v.assign(size_t(states) * nv, 0.0);
    if (!v.is_none()) {
      const Array w = real_array(v);
      if (w.ndim() == 1 && w.shape(0) == nv) {
        for (int b = 0; b < states; ++b) std::copy_n(w.data(), nv, binding->v.begin() + size_t(b) * nv);
      } else if (w.ndim() == 2 && w.shape(0) == binding->batch && w.shape(1) == nv) {
        binding->v.assign(w.data(), w.data() + w.size());
      } else {
        throw ModelError("v has not the shape that goes with q: (" + std::to_string(nv) + ",) or (B, " + std::to_string(nv) + ")");
      }
    }
    for (const auto& s : sources)
      for (int b = 0; b < std::max(states, binding->batch == 0 ? 0 : 1); ++b)
        s->check_state(binding->q.data() + size_t(b) * width, width, binding->v.data() + size_t(b) * nv, nv);
    if (binding->batch == 0 && width != nq) throw ModelError("q takes " + std::to_string(nq) + " numbers a state, not " + std::to_string(width));
  }
  binding->nq = nq;
  binding->nv = nv;
  return binding;
}

Expression constant_operator(const py::object& given, const py::object& domain, const py::object& codomain, const std::string& name) {
  const auto space = [](const py::object& s) { return py::isinstance<py::int_>(s) ? Space::euclidean(s.cast<int>()) : s.cast<Space>(); };
  const Space in = space(domain), out = space(codomain);
  if (py::isinstance<py::list>(given) && py::len(given) > 0 && py::isinstance<py::array>(py::list(given)[0]) && in.belongs_to_bodies() &&
      py::len(given) == in.layout().of_body.size()) {
    std::vector<std::vector<double>> blocks;
    for (const auto& item : py::list(given)) {
      const Array b = real_array(py::reinterpret_borrow<py::object>(item));
      blocks.emplace_back(b.data(), b.data() + b.size());
    }
    return constant_blocks(std::move(blocks), in, out, name);
  }
  const Array a = real_array(given);
  for (py::ssize_t i = 0; i < a.size(); ++i)
    if (!std::isfinite(a.data()[i])) throw EvaluationError("constant '" + name + "' has an entry that is not a finite number");
  if (a.ndim() == 1) {  // a diagonal
    const int n = static_cast<int>(a.shape(0));
    if (in.dimension() != n || out.dimension() != n)
      throw SpaceError("constant '" + name + "': a diagonal of " + std::to_string(n) + " numbers does not map " + in.description() + " to " + out.description());
    if (in.belongs_to_bodies() && out.belongs_to_bodies() && in.layout().of_body.size() == out.layout().of_body.size()) {
      std::vector<std::vector<double>> blocks;
      for (size_t k = 0; k < in.layout().of_body.size(); ++k) {
        const int size = in.body_size(static_cast<int>(k));
        std::vector<double> block(size_t(size) * size, 0.0);
        int at = 0;
        for (int b : in.layout().of_body[k])
          for (int i = 0; i < in.layout().blocks[b].size; ++i, ++at) block[size_t(at) * size + at] = a.data()[in.layout().blocks[b].offset + i];
        blocks.push_back(std::move(block));
      }
      return constant_blocks(std::move(blocks), in, out, name);
    }
    std::vector<double> full(size_t(n) * n, 0.0);
    for (int i = 0; i < n; ++i) full[size_t(i) * n + i] = a.data()[i];
    return constant(std::move(full), in, out, name);
  }
  if (a.ndim() != 2 || a.shape(0) != out.dimension() || a.shape(1) != in.dimension())
    throw SpaceError("constant '" + name + "' from " + in.description() + " to " + out.description() + " takes an array (" + std::to_string(out.dimension()) +
                     ", " + std::to_string(in.dimension()) + "), or one diagonal, or a list of one block per body");
  return constant(std::vector<double>(a.data(), a.data() + a.size()), in, out, name);
}

// Holds a Python callable; lets it go under the GIL.
struct Callable {
  py::object f;
  explicit Callable(py::object g) : f(std::move(g)) {}
  ~Callable() {
    py::gil_scoped_acquire gil;
    f = py::object();
  }
};

Expression external_operator(const py::object& product, const py::object& transposed, const Space& domain, const Space& codomain, const std::string& name) {
  auto data = std::make_shared<ExternalData>();
  data->name = name;
  const auto wrap = [](const py::object& f, int in, int out) -> std::function<void(const double*, double*, int)> {
    if (f.is_none()) return nullptr;
    auto held = std::make_shared<Callable>(f);
    return [held, in, out](const double* x, double* y, int m) {
      py::gil_scoped_acquire gil;
      py::array_t<double> a({static_cast<py::ssize_t>(in), static_cast<py::ssize_t>(m)});
      std::copy_n(x, size_t(in) * m, a.mutable_data());
      const Array r = Array::ensure(held->f(a));
      if (!r || r.size() != py::ssize_t(out) * m) throw EvaluationError("an operator from outside returned an array of the wrong shape");
      std::copy_n(r.data(), r.size(), y);
    };
  };
  data->apply = wrap(product, domain.dimension(), codomain.dimension());
  data->apply_transposed = wrap(transposed, codomain.dimension(), domain.dimension());
  return external(std::move(data), domain, codomain);
}

const SymbolDefinition& definition_named(const std::string& name) {
  for (const SymbolDefinition& d : sko_symbols())
    if (d.ascii == name) return d;
  for (const SymbolDefinition& d : mechanics_symbols())
    if (d.ascii == name) return d;
  throw EvaluationError("no operator is called '" + name + "'");
}

// Where a symbol's source comes back from in Python: the model's operators.
py::object source_of(const Symbol& s) { return py::cast(s.source); }

// A space as its model and kind, so that it can be pickled and found again.
py::tuple space_parts(const Space& s) {
  if (s.kind() == SpaceKind::Euclidean) return py::make_tuple(py::none(), static_cast<int>(s.kind()), s.dimension(), py::list());
  const auto source = source_owning(s);
  py::list names;
  for (const auto& b : s.layout().blocks)
    if (!s.layout().nodes.empty()) names.append(b.label);
  return py::make_tuple(py::cast(source), static_cast<int>(s.kind()), s.dimension(), names);
}

Space space_from_parts(const py::tuple& t) {
  const SpaceKind kind = static_cast<SpaceKind>(t[1].cast<int>());
  if (kind == SpaceKind::Euclidean) return Space::euclidean(t[2].cast<int>());
  const auto source = t[0].cast<std::shared_ptr<SkoSource>>();
  const auto names = t[3].cast<std::vector<std::string>>();
  if (!names.empty()) {
    const Space forces = source_symbol(source, "B", names, -1).domain();
    return kind == SpaceKind::NodesF ? forces : forces.dual();
  }
  if (kind == SpaceKind::Whitened) return Space(kind, source->forces().layout_pointer());
  return source->space(kind, {});
}

py::tuple parts(const Expression& e) {
  const auto& n = e.node();
  py::object payload = py::none();
  switch (n.kind) {
    case NodeKind::symbol: {
      py::list names;
      if (const auto mechanics = std::dynamic_pointer_cast<MultibodyOperators>(n.symbol.source); mechanics && n.symbol.definition->id >= first_extra)
        for (int a : n.symbol.arguments) {
          if (n.symbol.definition->id == MechanicsSymbolId::Delta)
            names.append(a);
          else
            names.append(a >= 0 ? mechanics->model()->node(a).name : mechanics->model()->body(-1 - a).name);
        }
      payload = py::make_tuple(source_of(n.symbol), n.symbol.definition->ascii, names, n.symbol.binding ? py::cast(std::const_pointer_cast<Binding>(n.symbol.binding)) : py::none());
      break;
    }
    case NodeKind::vector: payload = py::make_tuple(n.name, space_parts(n.codomain)); break;
    case NodeKind::identity: payload = e.floating() ? py::object(py::none()) : py::object(space_parts(n.domain)); break;
    case NodeKind::zero: payload = py::make_tuple(space_parts(n.domain), space_parts(n.codomain)); break;
    case NodeKind::scaled: payload = py::float_(n.coefficient); break;
    case NodeKind::constant:
      payload = py::make_tuple(n.constant->dense, n.constant->blocks, space_parts(n.domain), space_parts(n.codomain), n.constant->name);
      break;
    case NodeKind::external: throw py::type_error("an operator from outside ('" + n.external->name + "') cannot be pickled");
    default: break;
  }
  return py::make_tuple(static_cast<int>(n.kind), payload, py::cast(n.children));
}

}  // namespace

Expression source_symbol(const std::shared_ptr<SkoSource>& source, const std::string& name, const std::vector<std::string>& nodes, int coordinate) {
  const SymbolDefinition& d = definition_named(name);
  source->check_current();
  if (d.id < first_extra) return make_symbol(d, source);
  const auto mechanics = std::dynamic_pointer_cast<MultibodyOperators>(source);
  if (!mechanics) throw EvaluationError("'" + name + "' is an operator of mechanics; '" + source->name() + "' is a bare tree of matrices");
  switch (d.id) {
    case MechanicsSymbolId::B:
    case MechanicsSymbolId::Jacobian:
    case MechanicsSymbolId::Lambda: return node_operator(static_cast<MechanicsSymbolId>(d.id), mechanics, nodes);
    case MechanicsSymbolId::Delta: return delta_operator(mechanics, coordinate);
    default: return mechanics_operator(static_cast<MechanicsSymbolId>(d.id), mechanics);
  }
}

void register_operators(py::module_& m) {
  py::class_<Binding, std::shared_ptr<Binding>>(m, "Binding", "A state, or a batch of them, that an expression is bound to.")
      .def("__reduce__", [](const Binding& b) {
        return py::make_tuple(py::module_::import("pycraft._core").attr("_binding_from_parts"),
                              py::make_tuple(b.batch, b.nq, b.nv, b.q, b.v, precision_name(b.precision)));
      });
  m.def("_binding_from_parts", [](int batch, int nq, int nv, std::vector<double> q, std::vector<double> v, const std::string& precision) {
    auto b = std::make_shared<Binding>();
    b->batch = batch, b->nq = nq, b->nv = nv, b->q = std::move(q), b->v = std::move(v), b->precision = precision_from_name(precision);
    return b;
  });
  m.def("_bind", &make_binding, py::arg("operands"), py::arg("q"), py::arg("v"), py::arg("form"), py::arg("refine"), py::arg("precision"));

  py::class_<Expression> op(m, "Operator",
                            "An operator expression: what was typed, as data. It holds no numbers and computes nothing until it is applied to an array\n"
                            "(`op @ x`) or asked for one (`dense()`, `diagonal()`, `trace()`, ...). Then rules, planner and engine evaluate it by sweeps\n"
                            "over the tree.");
  op.attr("__array_ufunc__") = py::none();
  op.attr("__array_priority__") = py::float_(1000.0);
  op.def_property_readonly("domain", [](const Expression& e) { return e.floating() ? py::object(py::none()) : py::cast(e.domain()); }, "The space it acts on; None for an I that has none yet.")
      .def_property_readonly("codomain", [](const Expression& e) { return e.floating() ? py::object(py::none()) : py::cast(e.codomain()); })
      .def_property_readonly("shape", [](const Expression& e) {
        if (e.floating()) throw SpaceError("I has no space yet, and no shape");
        return py::make_tuple(e.codomain().dimension(), e.domain().dimension());
      })
      .def_property_readonly("T", &Expression::T, "The transpose, the book's star: A: X→Y gives A.T: Y'→X'. Cost: none.")
      .def("inv", &Expression::inv, "The inverse, as an expression; how it is evaluated is the planner's business (see explain).")
      .def("sqrt", &square_root, "L with A = L L.T, body by body; for symmetric block-diagonal operators.")
      .def("at", [](const Expression& e, const py::object& q, const py::object& v, const std::string& form, int refine, const std::string& precision) {
        return e.at(make_binding({e}, q, v, form, refine, precision));
      }, py::arg("q") = py::none(), py::arg("v") = py::none(), py::kw_only(), py::arg("form") = "fast", py::arg("refine") = 0, py::arg("precision") = "double",
         "The same expression bound to a state: q (nq,) or a batch (B, nq), v likewise (zero if left out); q=None takes the model's present\n"
         "state. The innermost binding wins. precision: \"double\" or \"extended\".")
      .def("_bound", [](const Expression& e, const std::shared_ptr<const Binding>& b) { return e.at(b); })
      // ---- arithmetic
      .def("__matmul__", [](const Expression& a, const py::object& b) -> py::object {
        if (is_operator(b)) return py::cast(a * b.cast<Expression>());
        if (is_array(b)) return apply_to_array(a, b);
        return not_implemented();
      })
      .def("__rmatmul__", [](const Expression& a, const py::object& b) -> py::object { return is_array(b) ? apply_from_left(b, a) : not_implemented(); })
      .def("__mul__", &multiply)
      .def("__rmul__", [](const Expression& a, const py::object& b) -> py::object {
        if (is_number(b)) return py::cast(py::float_(b).cast<double>() * a);
        if (is_array(b)) throw py::type_error("array * operator: multiply an array and an operator with `@`");
        return not_implemented();
      })
      .def("__truediv__", [](const Expression& a, const py::object& b) -> py::object {
        if (!is_number(b)) return is_operator(b) ? throw SpaceError("operator / operator: multiply by inv() on the side you mean") : not_implemented();
        const double c = py::float_(b).cast<double>();
        if (c == 0) {
          PyErr_SetString(PyExc_ZeroDivisionError, "operator divided by zero");
          throw py::error_already_set();
        }
        return py::cast((1 / c) * a);
      })
      .def("__neg__", [](const Expression& a) { return -a; })
      .def("__pos__", [](const Expression& a) { return a; })
      .def("__add__", [](const Expression& a, const py::object& b) { return add(a, b, 1, false); })
      .def("__radd__", [](const Expression& a, const py::object& b) { return add(a, b, 1, true); })
      .def("__sub__", [](const Expression& a, const py::object& b) { return add(a, b, -1, false); })
      .def("__rsub__", [](const Expression& a, const py::object& b) { return add(a, b, -1, true); })
      .def("__pow__", [](const Expression& a, const py::object& n) -> py::object {
        if (!py::isinstance<py::int_>(n)) throw py::type_error("operator ** n takes a whole number; there is sqrt() for block-diagonal operators");
        return py::cast(power(a, n.cast<int>()));
      })
      .def("__eq__", [](const Expression& a, const py::object& b) -> py::object { return is_operator(b) ? py::cast(a == b.cast<Expression>()) : not_implemented(); },
           "Structural equality after flattening sums and products: a bool, no numbers. Equality by value is pycraft.check.")
      .def("__hash__", [](const Expression& e) { return static_cast<py::ssize_t>(e.node().hash >> 1); })
      // ---- numbers
      .def("dense", &dense, py::arg("dtype") = py::none(), py::arg("rules") = true,
           "The operator as an array (codomain, domain), with a leading batch axis if one is bound. dtype=object keeps a wider precision as\n"
           "mpmath numbers; rules=False evaluates what was typed, no theorem used.")
      .def("__array__", [](const Expression& e, const py::object& dtype, const py::object&) {
        py::object a = dense(e, py::none(), true);
        return dtype.is_none() ? a : a.attr("astype")(dtype);
      }, py::arg("dtype") = py::none(), py::arg("copy") = py::none())
      .def("diagonal", &diagonal, "The diagonal entries (n,), or (B, n). Cost O(N).")
      .def("value", &value, "The value of a vector expression; named vectors (pycraft.vector) are given by name.")
      .def("trace", [](const Expression& e) { return trace(e); }, "The trace, as a scalar expression. Cost O(N).")
      .def("logdet", [](const Expression& e) { return logdet(e); }, "ln|det|, as a scalar expression. Cost O(N); exact by structure where a theorem gives it.")
      .def("norm", [](const Expression& e) { return norm(e); }, "The Frobenius norm, as a scalar expression.")
      // ---- algebra
      .def("simplify", &simplify, "The shortest expression that the rewriting theorems find equal to this one.")
      .def_property_readonly("is_symmetric", &is_symmetric, "Known by rule, no number looked at.")
      .def_property_readonly("is_block_diagonal", [](const Expression& e) { return is_block_diagonal(e); }, "Known by rule.")
      .def_property_readonly("is_upper_triangular", [](const Expression& e) { return is_upper_triangular(e); }, "By blocks, parents before children: φ and ψ are. Known by rule.")
      .def_property_readonly("is_lower_triangular", [](const Expression& e) { return is_lower_triangular(e); }, "By blocks: φ* and ψ* are. Known by rule.")
      .def("explain", [](const Expression& e, const std::string& request) { return py::module_::import("pycraft.operators").attr("explain")(e, request); },
           py::arg("request") = "apply", "The plan as a table: steps, tiers, cost; shown when it is the last line of a cell.")
      .def("blocks", [](const Expression& e, const std::string& order) { return py::module_::import("pycraft.operators").attr("block_view")(e, order); },
           py::arg("order") = "base-to-tip", "A labelled block view of the dense form; order=\"tip-to-base\" shows the book's triangles.")
      .def("plan", [](const Expression& e, const std::string& request, bool rules) {
        static const std::pair<const char*, Request> names[] = {{"apply", Request::apply}, {"dense", Request::dense}, {"diagonal", Request::diagonal},
                                                                {"blockdiag", Request::block_diagonal}, {"trace", Request::trace},
                                                                {"logdet", Request::logdet}, {"norm", Request::norm}};
        for (const auto& [name, r] : names)
          if (request == name) return prepare(e, r, rules);
        throw EvaluationError("no plan is made for '" + request + "'; there are apply, dense, diagonal, blockdiag, trace, logdet, norm");
      }, py::arg("request") = "apply", py::arg("rules") = true, "The plan: what is run, step by step, with its cost.")
      .def_property_readonly("children", [](const Expression& e) { return e.children(); })
      .def_property_readonly("kind", [](const Expression& e) {
        static const char* names[] = {"symbol", "vector", "identity", "zero", "constant", "external", "sum", "product", "scaled", "transpose", "inverse", "blockdiag", "sqrt"};
        return names[static_cast<int>(e.kind())];
      })
      .def_property_readonly("coefficient", [](const Expression& e) { return e.node().coefficient; })
      .def_property_readonly("name", [](const Expression& e) -> py::object {
        if (e.kind() == NodeKind::symbol) return py::cast(e.node().symbol.definition->ascii);
        if (e.kind() == NodeKind::vector) return py::cast(e.node().name);
        return py::none();
      }, "A symbol's ASCII name; None for anything composed.")
      .def_property_readonly("batch", [](const Expression& e) -> py::object { return batch_of(e) < 0 ? py::object(py::none()) : py::cast(batch_of(e)); })
      .def("check_current", &Expression::check_current, "Raises StaleOperatorError if a model's structure changed since this was made.")
      .def_property_readonly("sources", [](const Expression& e) {
        py::list all;
        for (const Context& c : contexts(e)) all.append(py::cast(c.source));
        return all;
      })
      // ---- text
      .def("text", [](const Expression& e) { return show(e); }, "As the book prints it, in Unicode.")
      .def("latex", [](const Expression& e) { return show(e, Style::latex); })
      .def("python", [](const Expression& e) { return show(e, Style::python); }, "As Python reads it.")
      .def("__str__", [](const Expression& e) { return show(e); })
      .def("__repr__", [](const Expression& e) {
        std::string text = show(e);
        if (text.size() > 400) text = text.substr(0, text.find(' ', 300)) + " …";
        if (e.floating()) return "<" + text + ">";
        return "<" + text + " : " + e.domain().description() + " → " + e.codomain().description() + ">";
      })
      .def("_repr_latex_", [](const Expression& e) { return "$\\displaystyle " + show(e, Style::latex) + "$"; })
      .def("_parts", &parts)
      .def("__reduce__", [](const Expression& e) {
        return py::make_tuple(py::module_::import("pycraft.operators").attr("operator_from_parts"), parts(e));
      });

  py::class_<SkoSource, std::shared_ptr<SkoSource>>(m, "SkoSource", "Where the blocks of operators come from: a model, or a bare tree of matrices.")
      .def_property_readonly("name", &SkoSource::name)
      .def_property_readonly("Theta", &SkoSource::theta)
      .def_property_readonly("V", &SkoSource::motions)
      .def_property_readonly("F", &SkoSource::forces)
      .def_property_readonly("parents", [](const SkoSource& s) { return s.structure().parent; })
      .def_property_readonly("sizes", [](const SkoSource& s) { return s.structure().size; })
      .def_property_readonly("dof", [](const SkoSource& s) { return s.structure().dof; })
      .def_property_readonly("body_names", [](const SkoSource& s) { return s.structure().body_names; })
      .def_property_readonly("hinge_names", [](const SkoSource& s) { return s.structure().hinge_names; })
      .def_property_readonly("coordinate_names", [](const SkoSource& s) { return s.structure().coordinate_names; })
      .def_property_readonly("traits", [](const SkoSource& s) {
        const Traits t = s.traits();
        py::dict d;
        d["serial chain"] = t.chain, d["single-DOF hinges"] = t.single_dof, d["constant H"] = t.constant_hinges, d["J = 0"] = !t.hinge_diagonal;
        return d;
      })
      .def("symbol", &source_symbol, py::arg("name"), py::arg("nodes") = std::vector<std::string>(), py::arg("coordinate") = -1)
      .def("nodes_space", [](const std::shared_ptr<SkoSource>& s, const std::vector<std::string>& nodes, bool motions) {
        const Expression b = source_symbol(s, "B", nodes, -1);
        return motions ? b.domain().dual() : b.domain();
      })
      .def("check_current", &SkoSource::check_current);
  py::class_<MultibodyOperators, SkoSource, std::shared_ptr<MultibodyOperators>>(m, "MultibodyOperators", "The operators' source of a multibody model.")
      .def_property_readonly("model", [](const MultibodyOperators& s) { return s.model(); })
      .def("__reduce__", [](const MultibodyOperators& s) {
        return py::make_tuple(py::module_::import("pycraft._core").attr("operators_of"), py::make_tuple(py::cast(s.model())));
      });
  m.def("operators_of", &operators_of, py::arg("model"));
  py::class_<MatrixTree, SkoSource, std::shared_ptr<MatrixTree>>(m, "MatrixTree", "A tree whose blocks E, H, M, J are given as matrices of any size.")
      .def(py::init([](const std::vector<int>& parents, const std::vector<int>& sizes, const std::vector<int>& dof, std::vector<std::vector<double>> E,
                       std::vector<std::vector<double>> H, std::vector<std::vector<double>> M, std::vector<std::vector<double>> J,
                       const std::vector<std::string>& names, const std::string& name) {
             SkoStructure s;
             s.parent = parents, s.size = sizes, s.dof = dof, s.body_names = names;
             for (const std::string& n : names) s.hinge_names.push_back(n);
             s.finish();
             return std::make_shared<MatrixTree>(std::move(s), name, std::move(E), std::move(H), std::move(M), std::move(J));
           }),
           py::arg("parents"), py::arg("sizes"), py::arg("dof"), py::arg("E"), py::arg("H"), py::arg("M"), py::arg("J"), py::arg("names"), py::arg("name"))
      .def("__reduce__", [](const MatrixTree& t) {
        const SkoStructure& s = t.structure();
        return py::make_tuple(py::module_::import("pycraft._core").attr("MatrixTree"),
                              py::make_tuple(s.parent, s.size, s.dof, t.E, t.H, t.M, t.J, s.body_names, t.name()));
      });

  m.def("identity", [](const py::object& space) { return space.is_none() ? identity() : identity(space.cast<Space>()); }, py::arg("space") = py::none(),
        "I; without a space it takes that of the operator it is combined with.");
  m.def("zero", &zero, py::arg("domain"), py::arg("codomain"), "The zero operator.");
  m.def("vector", &make_vector, py::arg("name"), py::arg("space"), "A named vector of a space: stands for an array that is given at the evaluation.");
  m.def("constant", &constant_operator, py::arg("array"), py::arg("domain"), py::arg("codomain"), py::arg("name") = "C",
        "An array as an operator from `domain` to `codomain` (spaces, or a size n for R^n): a matrix, one diagonal, or a list of one block per\n"
        "body. What is block diagonal over the bodies is kept so; what has low rank is found when a plan needs it.");
  m.def("external", &external_operator, py::arg("product"), py::arg("transposed"), py::arg("domain"), py::arg("codomain"), py::arg("name"));
  m.def("blockdiag", &block_diagonal, py::arg("operator"), "The operator's diagonal blocks, body by body, zero elsewhere.");
  m.def("_make", [](const std::string& kind, const std::vector<Expression>& children, double coefficient) {
    if (kind == "sum") return sum_of(children);
    if (kind == "product") return product_of(children);
    if (kind == "scaled") return coefficient * children[0];
    if (kind == "transpose") return children[0].T();
    if (kind == "inverse") return children[0].inv();
    if (kind == "blockdiag") return block_diagonal(children[0]);
    return square_root(children[0]);
  });
  m.def("_leaf_from_parts", [](const std::string& kind, const py::object& payload) {
    if (kind == "identity") return payload.is_none() ? identity() : identity(space_from_parts(payload.cast<py::tuple>()));
    const py::tuple t = payload.cast<py::tuple>();
    if (kind == "vector") return make_vector(t[0].cast<std::string>(), space_from_parts(t[1].cast<py::tuple>()));
    if (kind == "zero") return zero(space_from_parts(t[0].cast<py::tuple>()), space_from_parts(t[1].cast<py::tuple>()));
    const Space domain = space_from_parts(t[2].cast<py::tuple>()), codomain = space_from_parts(t[3].cast<py::tuple>());
    auto dense = t[0].cast<std::vector<double>>();
    auto blocks = t[1].cast<std::vector<std::vector<double>>>();
    const auto name = t[4].cast<std::string>();
    return blocks.empty() ? constant(std::move(dense), domain, codomain, name) : constant_blocks(std::move(blocks), domain, codomain, name);
  });
  m.def("equal_by_theorems", &equal_by_theorems, py::arg("a"), py::arg("b"), "Whether the rewriting theorems bring both to the same normal form.");
  m.def("symbol_table", [] {
    py::list table;
    for (const auto* symbols : {&sko_symbols(), &mechanics_symbols()})
      for (const SymbolDefinition& d : *symbols) {
        static const char* kinds[] = {"Θ", "V", "F", "W", "NodesV", "NodesF", "Loops", "R^1"};
        table.append(py::make_tuple(d.ascii, d.unicode, d.latex, kinds[static_cast<int>(d.domain)], kinds[static_cast<int>(d.codomain)], d.meaning));
      }
    return table;
  }, "Every operator: (ASCII, Unicode, LaTeX, domain, codomain, meaning).");
}

}  // namespace pycraft
