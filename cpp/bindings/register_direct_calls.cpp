// The plain case of a direct call: contiguous float64 arrays at their places, options by name. It takes CPython's own way of calling
// (PEP 590) to the core, without pybind11's dispatcher and without a Python function between. Whatever else is given (lists, a State,
// nothing for the present state, another method) goes to the Python function of that name, which knows it all and says what is wrong.
#include <cstddef>
#include <memory>
#include <optional>

#include "bindings/direct_calls.h"
#include "dynamics/batch_dynamics.h"
#include <structmember.h>  // after Python.h

namespace pycraft {

namespace {

struct Options {
  Solving how;
  Precision precision = Precision::double_;
  const Node* node = nullptr;  // of what is asked of a frame
};

// A direct call: the arrays that it is given, the result of one state, and the core's function.
struct DirectCall {
  const char* name;
  std::array<const char*, 3> arrays;
  int given;
  bool of_frame, solves;  // the frame comes first; takes a form and a refinement
  std::array<int, 2> (*shape)(int nv);  // a vector: {0, n}
  void (*compute)(BatchDynamics& d, const Given* in, const Options& options, double* out);
};

constexpr DirectCall direct_calls[] = {
    {"forward_dynamics", {"q", "v", "tau"}, 3, false, true, [](int nv) { return std::array{0, nv}; },
     [](BatchDynamics& d, const Given* in, const Options& o, double* out) { d.forward_dynamics(in[0], in[1], in[2], o.how, o.precision, out); }},
    {"inverse_dynamics", {"q", "v", "vdot"}, 3, false, false, [](int nv) { return std::array{0, nv}; },
     [](BatchDynamics& d, const Given* in, const Options& o, double* out) { d.inverse_dynamics(in[0], in[1], &in[2], o.precision, out); }},
    {"bias_forces", {"q", "v"}, 2, false, false, [](int nv) { return std::array{0, nv}; },
     [](BatchDynamics& d, const Given* in, const Options& o, double* out) { d.inverse_dynamics(in[0], in[1], nullptr, o.precision, out); }},
    {"mass_matrix", {"q"}, 1, false, false, [](int nv) { return std::array{nv, nv}; },
     [](BatchDynamics& d, const Given* in, const Options& o, double* out) { d.mass_matrix(in[0], o.precision, out); }},
    {"mass_matrix_inverse", {"q"}, 1, false, true, [](int nv) { return std::array{nv, nv}; },
     [](BatchDynamics& d, const Given* in, const Options& o, double* out) { d.mass_matrix_inverse(in[0], o.how, o.precision, out); }},
    {"jacobian", {"q"}, 1, true, false, [](int nv) { return std::array{6, nv}; },
     [](BatchDynamics& d, const Given* in, const Options& o, double* out) { d.jacobian(*o.node, in[0], o.precision, out); }},
    {"pose", {"q"}, 1, true, false, [](int) { return std::array{4, 4}; },
     [](BatchDynamics& d, const Given* in, const Options& o, double* out) { d.pose(*o.node, in[0], out); }},
};

const DirectCall& direct_call(const std::string& name) {
  std::string known;
  for (const DirectCall& call : direct_calls) {
    if (name == call.name) return call;
    known += (known.empty() ? "'" : ", '") + std::string(call.name) + "'";
  }
  throw EvaluationError("'" + name + "' is no direct call; there are " + known);
}

// ---- arrays, past the wrappers

using Proxy = py::detail::PyArray_Proxy;

PyObject* float64() {
  static PyObject* const descr = py::dtype::of<double>().release().ptr();  // NumPy's own; one for all arrays of native doubles
  return descr;
}

struct Plain {
  double* data;
  int ndim, width;
  py::ssize_t states;  // -1: one
  const py::ssize_t* shape;
};

// An ndarray itself, aligned, C-ordered, float64 in the machine's byte order; else nothing.
std::optional<Plain> plain(PyObject* given) {
  auto& numpy = py::detail::npy_api::get();
  if (Py_TYPE(given) != numpy.PyArray_Type_) return std::nullopt;
  const Proxy* a = py::detail::array_proxy(given);
  constexpr int wanted = py::detail::npy_api::NPY_ARRAY_ALIGNED_ | py::detail::npy_api::NPY_ARRAY_C_CONTIGUOUS_;
  if (a->descr != float64() || (a->flags & wanted) != wanted || a->nd < 1) return std::nullopt;
  return Plain{reinterpret_cast<double*>(a->data), a->nd, static_cast<int>(a->dimensions[a->nd - 1]), a->nd == 2 ? a->dimensions[0] : -1, a->dimensions};
}

PyObject* new_array(int ndim, py::ssize_t* shape) {
  auto& numpy = py::detail::npy_api::get();
  Py_INCREF(float64());
  return numpy.PyArray_NewFromDescr_(numpy.PyArray_Type_, float64(), ndim, shape, nullptr, nullptr, 0, nullptr);
}

bool overlap(const double* a, size_t n, const double* b, size_t m) { return a < b + m && b < a + n; }

// ---- the callable

struct Callable {
  PyObject_HEAD
  vectorcallfunc vectorcall;
  PyObject* function;      // takes what is not plain
  PyObject* dynamics;      // prepared: of one model; else that of the model that comes first
  const DirectCall* call;
  Options options;         // of calls that are not prepared: the defaults
  std::string frame;       // prepared: whose Jacobian or pose
  py::ssize_t states;      // prepared: a batch of so many, -1: one state; else -2: any
};

// Bodies times states below which the GIL is kept: letting it go and taking it again would cost more than it gives to others.
constexpr py::ssize_t kept = 64;

// The core's object behind the Python model: its `_direct`, which the first call by the method makes. The model keeps it.
BatchDynamics* dynamics_of(PyObject* model) {
  static PyObject* const name = PyUnicode_InternFromString("_direct");
  const py::object held = py::reinterpret_steal<py::object>(PyObject_GetAttr(model, name));
  if (held) return py::cast<BatchDynamics*>(held);
  if (!PyErr_ExceptionMatches(PyExc_AttributeError)) throw py::error_already_set();
  PyErr_Clear();
  return nullptr;
}

bool named(PyObject* text, const char* ascii) { return PyUnicode_CompareWithASCIIString(text, ascii) == 0; }

// An option of a call that was not prepared, by its commonest values; false: by others.
bool takes(const DirectCall& call, Options& options, PyObject* name, PyObject* value) {
  if (named(name, "precision")) return PyUnicode_Check(value) && named(value, "double");
  if (!call.solves) return false;
  if (named(name, "form")) {
    if (!PyUnicode_Check(value)) return false;
    for (const auto& [form, text] : {std::pair{Form::fast, "fast"}, std::pair{Form::ud, "ud"}, std::pair{Form::square_root, "square-root"}})
      if (named(value, text)) {
        options.how.form = form;
        return true;
      }
    return false;
  }
  if (named(name, "refine")) {
    int beyond;
    return PyLong_CheckExact(value) && PyLong_AsLongAndOverflow(value, &beyond) == 0 && !beyond;
  }
  return PyUnicode_Check(value) && ((named(name, "residual") && named(value, "same")) || (named(name, "on_singular") && named(value, "raise")) ||
                                    (named(name, "method") && named(value, "articulated") && call.given == 3));
}

// The result; nothing where something is not plain.
PyObject* computed(const Callable& c, PyObject* const* args, py::ssize_t count, PyObject* names) {
  BatchDynamics* d;
  if (c.dynamics) {
    d = py::cast<BatchDynamics*>(py::handle(c.dynamics));
  } else {
    if (count == 0 || !(d = dynamics_of(args[0]))) return nullptr;
    ++args, --count;
  }
  const DirectCall& call = *c.call;
  Options options = c.options;
  PyObject* out = nullptr;
  const py::ssize_t keywords = names ? PyTuple_GET_SIZE(names) : 0;
  if (count != call.given + (call.of_frame && !c.dynamics)) return nullptr;
  for (py::ssize_t i = 0; i < keywords; ++i) {
    PyObject *const name = PyTuple_GET_ITEM(names, i), *const value = args[count + i];
    if (named(name, "out")) {
      out = value == Py_None ? nullptr : value;
    } else if (c.dynamics || !takes(call, options, name, value)) {
      return nullptr;
    }
  }
  const Multibody& model = d->model();
  Node node;
  if (call.of_frame) {
    std::string frame = c.frame;
    if (!c.dynamics) {
      if (!PyUnicode_CheckExact(args[0])) return nullptr;
      py::ssize_t length;
      const char* const text = PyUnicode_AsUTF8AndSize(args[0], &length);
      if (!text) return nullptr;
      frame.assign(text, length);
      ++args;
    }
    node = model.node(model.node_index(frame));
    options.node = &node;
  }
  Given given[3];
  py::ssize_t states = -1;
  for (int i = 0; i < call.given; ++i) {
    const auto a = plain(args[i]);
    if (!a || a->ndim > 2 || a->width != (i == 0 ? model.nq() : model.nv())) return nullptr;
    if (a->states >= 0) {
      if (states >= 0 && states != a->states) return nullptr;
      states = a->states;
    }
    given[i] = {call.arrays[i], a->data, a->width, static_cast<int>(a->states)};
  }
  if (c.states != -2 && c.states != states) return nullptr;
  py::ssize_t shape[3];
  int ndim = 0;
  if (states >= 0) shape[ndim++] = states;
  const auto [rows, columns] = call.shape(model.nv());
  if (rows > 0) shape[ndim++] = rows;
  if (call.shape(1)[0] > 0 && rows == 0) return nullptr;  // a matrix of no rows
  shape[ndim++] = columns;
  PyObject* result;
  double* target;
  if (out) {
    const auto a = plain(out);
    if (!a || a->ndim != ndim || !std::equal(shape, shape + ndim, a->shape) || !(py::detail::array_proxy(out)->flags & py::detail::npy_api::NPY_ARRAY_WRITEABLE_)) return nullptr;
    target = a->data;
    size_t size = 1;
    for (int i = 0; i < ndim; ++i) size *= shape[i];
    for (int i = 0; i < call.given; ++i)
      if (overlap(target, size, given[i].data, size_t(given[i].width) * std::max(given[i].batch, 1))) return nullptr;
    Py_INCREF(out);
    result = out;
  } else {
    result = new_array(ndim, shape);
    if (!result) throw py::error_already_set();
    target = reinterpret_cast<double*>(py::detail::array_proxy(result)->data);
  }
  const py::object owned = py::reinterpret_steal<py::object>(result);
  if (model.bodies() * std::max<py::ssize_t>(states, 1) <= kept) {
    call.compute(*d, given, options, target);
  } else {
    const Undisturbed undisturbed(model);
    call.compute(*d, given, options, target);
  }
  return py::object(owned).release().ptr();
}

PyObject* called(PyObject* self, PyObject* const* args, size_t flags, PyObject* names) {
  const auto& c = *reinterpret_cast<Callable*>(self);
  try {
    if (PyObject* result = computed(c, args, PyVectorcall_NARGS(flags), names)) return result;
    if (PyErr_Occurred()) return nullptr;
    return PyObject_Vectorcall(c.function, args, flags & ~PY_VECTORCALL_ARGUMENTS_OFFSET, names);
  } catch (py::error_already_set& e) {
    e.restore();
  } catch (...) {
    py::detail::try_translate_exceptions();
  }
  return nullptr;
}

PyObject* bound(PyObject* self, PyObject* object, PyObject*) {
  if (object && object != Py_None) return PyMethod_New(self, object);
  Py_INCREF(self);
  return self;
}

// Name, docstring, signature, ...: the Python function's.
PyObject* attribute(PyObject* self, PyObject* name) {
  const auto& c = *reinterpret_cast<Callable*>(self);
  if (named(name, "__wrapped__")) {
    Py_INCREF(c.function);
    return c.function;
  }
  if (named(name, "__class__") || named(name, "__reduce__") || named(name, "__reduce_ex__")) return PyObject_GenericGetAttr(self, name);
  return PyObject_GetAttr(c.function, name);
}

int visit(PyObject* self, visitproc visit, void* arg) {
  const auto& c = *reinterpret_cast<Callable*>(self);
  Py_VISIT(Py_TYPE(self));
  Py_VISIT(c.function);
  Py_VISIT(c.dynamics);
  return 0;
}
int clear(PyObject* self) {
  auto& c = *reinterpret_cast<Callable*>(self);
  Py_CLEAR(c.function);
  Py_CLEAR(c.dynamics);
  return 0;
}
void destroy(PyObject* self) {
  PyObject_GC_UnTrack(self);
  clear(self);
  PyTypeObject* const type = Py_TYPE(self);
  std::destroy_at(&reinterpret_cast<Callable*>(self)->frame);
  type->tp_free(self);
  Py_DECREF(type);
}

PyMemberDef members[] = {{"__vectorcalloffset__", T_PYSSIZET, offsetof(Callable, vectorcall), READONLY, nullptr}, {nullptr, 0, 0, 0, nullptr}};
PyType_Slot slots[] = {{Py_tp_call, reinterpret_cast<void*>(PyVectorcall_Call)},
                       {Py_tp_descr_get, reinterpret_cast<void*>(bound)},
                       {Py_tp_getattro, reinterpret_cast<void*>(attribute)},
                       {Py_tp_traverse, reinterpret_cast<void*>(visit)},
                       {Py_tp_clear, reinterpret_cast<void*>(clear)},
                       {Py_tp_dealloc, reinterpret_cast<void*>(destroy)},
                       {Py_tp_members, members},
                       {0, nullptr}};
PyType_Spec spec = {"pycraft._core.DirectCall", sizeof(Callable), 0,
                    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_HAVE_VECTORCALL | Py_TPFLAGS_METHOD_DESCRIPTOR | Py_TPFLAGS_DISALLOW_INSTANTIATION, slots};

py::object callable(const py::object& function, const DirectCall& call, py::object dynamics, const Options& options, const std::string& frame, py::ssize_t states) {
  static PyObject* const type = PyType_FromSpec(&spec);
  auto* const c = type ? PyObject_GC_New(Callable, reinterpret_cast<PyTypeObject*>(type)) : nullptr;
  if (!c) throw py::error_already_set();
  c->vectorcall = called;
  c->function = function.inc_ref().ptr();
  c->dynamics = dynamics.release().ptr();
  c->call = &call;
  c->options = options;
  std::construct_at(&c->frame, frame);
  c->states = states;
  PyObject_GC_Track(c);
  return py::reinterpret_steal<py::object>(reinterpret_cast<PyObject*>(c));
}

}  // namespace

void register_direct_calls(py::module_& m) {
  m.def("direct_call", [](const py::function& function) {
    return callable(function, direct_call(py::cast<std::string>(function.attr("__name__"))), py::object(), Options{}, "", -2);
  }, py::arg("function"), "The direct call of this name: its plain case in the core, everything else by the function.");
  m.def("prepared_call", [](const py::object& function, const std::string& name, const py::object& dynamics, const py::object& batch, const std::string& frame, Form form,
                            const py::object& refine, const std::string& residual, Precision precision, const std::string& on_singular) {
    const Options options{{form, refinement(refine, residual, precision), on_singular_from_name(on_singular)}, precision};
    return callable(function, direct_call(name), dynamics, options, frame, batch.is_none() ? -1 : py::cast<py::ssize_t>(batch));
  }, py::arg("function"), py::arg("name"), py::arg("dynamics"), py::arg("batch"), py::arg("frame"), py::arg("form"), py::arg("refine"), py::arg("residual"),
     py::arg("precision"), py::arg("on_singular"), "A direct call of one model with its options, as `prepare` gives it.");
}

}  // namespace pycraft
