// The plain case of a direct call: contiguous float64 arrays at their places, options by name. It takes CPython's own way of calling
// (PEP 590) to the core, without pybind11's dispatcher and without a Python function between. Whatever else is given (lists, a State,
// nothing for the present state, another method) goes to the Python function of that name, which knows it all and says what is wrong.
#include <array>
#include <cstddef>
#include <memory>
#include <optional>

#include <pybind11/typing.h>

#include "bindings/direct_call_table.h"
#include "bindings/direct_calls.h"
#include "bindings/plain_arrays.h"
#include "dynamics/batch_dynamics.h"
#include <structmember.h>  // after Python.h

namespace pycraft {

using namespace direct;

namespace {

// ---- the callable

struct Callable {
  PyObject_HEAD
  vectorcallfunc vectorcall;
  PyObject* function;      // takes what is not plain
  PyObject* dynamics;      // prepared: of one model; else that of the model that comes first
  const DirectCall* call;
  Options options;         // of calls that are not prepared: the defaults
  PyObject* frame;         // prepared: whose Jacobian or pose; else null
  PyObject* made;          // of calls with three results: the kind of tuple that holds them; else null
  int states;              // prepared: a batch of so many, -1: one state; else -2: any
};
static_assert(std::is_trivially_copyable_v<Options>);  // Python makes it and lets it go, without constructor and destructor

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

// An option of a call that was not prepared, by its commonest values; false: another option, or by others.
bool takes(const DirectCall& call, Options& options, PyObject* name, PyObject* value) {
  const auto is = [&](const char* text) { return PyUnicode_Check(value) && named(value, text); };
  if (named(name, "precision")) return call.takes & takes_precision && is("double");
  if (named(name, "method")) return call.takes & takes_method && is("articulated");
  if (named(name, "form") && call.takes & takes_coriolis) {
    options.skew = is("skew");
    return options.skew || is("christoffel");
  }
  if (!(call.takes & takes_solving)) return false;
  if (named(name, "form")) {
    for (const auto& [form, text] : {std::pair{Form::fast, "fast"}, std::pair{Form::ud, "ud"}, std::pair{Form::square_root, "square-root"}})
      if (is(text)) {
        options.how.form = form;
        return true;
      }
    return false;
  }
  if (named(name, "refine")) {
    int beyond;
    return PyLong_CheckExact(value) && PyLong_AsLongAndOverflow(value, &beyond) == 0 && !beyond;
  }
  return (named(name, "residual") && is("same")) || (named(name, "on_singular") && is("raise"));
}

// What follows the arrays.
bool take_options(const Callable& c, Asked& asked, PyObject* const* values, PyObject* names) {
  const py::ssize_t count = names ? PyTuple_GET_SIZE(names) : 0;
  for (py::ssize_t i = 0; i < count; ++i) {
    PyObject* const name = PyTuple_GET_ITEM(names, i);
    if (named(name, "out") && !c.made)
      asked.out = values[i] == Py_None ? nullptr : values[i];
    else if (c.dynamics || !takes(*c.call, asked.options, name, values[i]))
      return false;
  }
  return true;
}

bool take_frame(Asked& asked, PyObject* name) {
  if (!PyUnicode_Check(name)) return false;
  py::ssize_t length;
  const char* const text = PyUnicode_AsUTF8AndSize(name, &length);
  if (!text) throw py::error_already_set();
  const Multibody& model = asked.dynamics->model();
  asked.node = model.node(model.node_index(std::string(text, length)));
  return true;
}

// One state stands for all of a batch.
bool take_arrays(const DirectCall& call, Asked& asked, PyObject* const* arrays) {
  const Multibody& model = asked.dynamics->model();
  const int nq = model.nq(), nv = model.nv(), count = call.given();
  for (int i = 0; i < count; ++i) {
    const auto given = plain_argument(arrays[i], call.arrays[i], i == 0 ? nq : nv);
    if (!given) return false;
    if (given->batch >= 0) {
      if (asked.states >= 0 && asked.states != given->batch) return false;
      asked.states = given->batch;
    }
    asked.given[i] = *given;
  }
  return true;
}

// The array that is written to: a new one, or out=. Nothing where out= does not fit or lies in the memory of an argument.
py::object result_of(const DirectCall& call, const Asked& asked) {
  py::ssize_t lengths[3], size = 1;
  int axes = 0;
  if (asked.states >= 0) lengths[axes++] = asked.states;
  for (int i = 0; i < call.result.count; ++i) {
    const int length = call.result.lengths[i];
    lengths[axes++] = length == coordinates ? asked.dynamics->model().nv() : length;
  }
  if (!asked.out) {
    PyObject* const made = new_array(axes, lengths);
    if (!made) throw py::error_already_set();
    return py::reinterpret_steal<py::object>(made);
  }
  const auto out = plain(asked.out);
  if (!out || !out->writeable || out->axes != axes || !std::equal(lengths, lengths + axes, out->lengths)) return py::object();
  for (int i = 0; i < axes; ++i) size *= lengths[i];
  for (int i = 0; i < call.given(); ++i) {
    const Given& given = asked.given[i];
    if (overlap(out->data, size, given.data, size_t(given.width) * (given.batch < 0 ? 1 : given.batch))) return py::object();
  }
  return py::reinterpret_borrow<py::object>(asked.out);
}

// Three results in a tuple of the kind that the call has; nothing where it is not the plain case, or kernels are not sure.
py::object derivatives(const Callable& c, const Asked& asked) {
  const Options& options = asked.options;
  if (options.precision != Precision::double_ || options.how.form != Form::fast || options.how.refinement.steps != 0) return py::object();
  std::array<double*, 3> target;
  py::tuple all(3);
  for (int i = 0; i < 3; ++i) {
    py::object one = result_of(*c.call, asked);
    target[i] = reinterpret_cast<double*>(py::detail::array_proxy(one.ptr())->data);
    PyTuple_SET_ITEM(all.ptr(), i, one.release().ptr());
  }
  const auto sure = [&] { return asked.dynamics->derivatives(*c.call->derivatives, asked.given[0], asked.given[1], asked.given[2], target); };
  const Multibody& model = asked.dynamics->model();
  bool done;
  if (py::ssize_t(model.bodies()) * std::max(asked.states, 1) <= kept) {
    done = sure();
  } else {
    const Undisturbed undisturbed(model);
    done = sure();
  }
  if (!done) return py::object();
  const auto given = py::reinterpret_steal<py::object>(PyTuple_Pack(1, all.ptr()));
  PyObject* const made = given ? PyTuple_Type.tp_new(reinterpret_cast<PyTypeObject*>(c.made), given.ptr(), nullptr) : nullptr;
  if (!made) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(made);
}

// The result; nothing where something is not plain.
py::object computed(const Callable& c, PyObject* const* args, py::ssize_t count, PyObject* names) {
  const DirectCall& call = *c.call;
  Asked asked;
  asked.options = c.options;
  if (c.dynamics) {
    asked.dynamics = py::cast<BatchDynamics*>(py::handle(c.dynamics));
  } else {
    if (count == 0 || !(asked.dynamics = dynamics_of(args[0]))) return py::object();
    ++args, --count;
  }
  const bool of_frame = call.takes & takes_frame, frame_first = of_frame && !c.dynamics;
  if (count != call.given() + frame_first || !take_options(c, asked, args + count, names)) return py::object();
  if (of_frame && !take_frame(asked, frame_first ? args[0] : c.frame)) return py::object();
  if (!take_arrays(call, asked, args + frame_first)) return py::object();
  if (c.states != -2 && c.states != asked.states) return py::object();
  if (c.made) return derivatives(c, asked);
  py::object result = result_of(call, asked);
  if (!result) return result;
  auto* const target = reinterpret_cast<double*>(py::detail::array_proxy(result.ptr())->data);
  const Multibody& model = asked.dynamics->model();
  bool done;
  if (py::ssize_t(model.bodies()) * std::max(asked.states, 1) <= kept) {
    done = call.compute(asked, target);
  } else {
    const Undisturbed undisturbed(model);
    done = call.compute(asked, target);
  }
  return done ? result : py::object();
}

PyObject* called(PyObject* self, PyObject* const* args, size_t flags, PyObject* names) {
  const auto& c = *reinterpret_cast<Callable*>(self);
  try {
    if (py::object result = computed(c, args, PyVectorcall_NARGS(flags), names)) return result.release().ptr();
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

// What tells a reader of it (help(), inspect.signature, functools.wraps) is the Python function's; the rest is an object's own.
PyObject* told(PyObject* self, void* name) {
  return PyObject_GetAttrString(reinterpret_cast<Callable*>(self)->function, static_cast<const char*>(name));
}
constexpr PyGetSetDef told_as(const char* name) { return {name, told, nullptr, nullptr, const_cast<char*>(name)}; }

// The module too, which the type has a name of in the way.
PyObject* attribute(PyObject* self, PyObject* name) {
  static char module[] = "__module__";
  return named(name, module) ? told(self, module) : PyObject_GenericGetAttr(self, name);
}

int visit(PyObject* self, visitproc visit, void* arg) {
  const auto& c = *reinterpret_cast<Callable*>(self);
  Py_VISIT(Py_TYPE(self));
  Py_VISIT(c.function);
  Py_VISIT(c.dynamics);
  Py_VISIT(c.frame);
  Py_VISIT(c.made);
  return 0;
}
int clear(PyObject* self) {
  auto& c = *reinterpret_cast<Callable*>(self);
  Py_CLEAR(c.function);
  Py_CLEAR(c.dynamics);
  Py_CLEAR(c.frame);
  Py_CLEAR(c.made);
  return 0;
}
void destroy(PyObject* self) {
  PyObject_GC_UnTrack(self);
  clear(self);
  PyTypeObject* const type = Py_TYPE(self);
  type->tp_free(self);
  Py_DECREF(type);
}

PyMemberDef members[] = {{"__vectorcalloffset__", T_PYSSIZET, offsetof(Callable, vectorcall), READONLY, nullptr},
                         {"__wrapped__", T_OBJECT_EX, offsetof(Callable, function), READONLY, nullptr},
                         {nullptr, 0, 0, 0, nullptr}};
PyGetSetDef told_of_function[] = {told_as("__name__"),     told_as("__qualname__"),   told_as("__doc__"), told_as("__annotations__"),
                                  told_as("__defaults__"), told_as("__kwdefaults__"), {nullptr, nullptr, nullptr, nullptr, nullptr}};
PyType_Slot slots[] = {{Py_tp_call, reinterpret_cast<void*>(PyVectorcall_Call)},
                       {Py_tp_descr_get, reinterpret_cast<void*>(bound)},
                       {Py_tp_getattro, reinterpret_cast<void*>(attribute)},
                       {Py_tp_traverse, reinterpret_cast<void*>(visit)},
                       {Py_tp_clear, reinterpret_cast<void*>(clear)},
                       {Py_tp_dealloc, reinterpret_cast<void*>(destroy)},
                       {Py_tp_members, members},
                       {Py_tp_getset, told_of_function},
                       {0, nullptr}};
PyType_Spec spec = {"pycraft._core.DirectCall", sizeof(Callable), 0,
                    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_HAVE_VECTORCALL | Py_TPFLAGS_METHOD_DESCRIPTOR | Py_TPFLAGS_DISALLOW_INSTANTIATION, slots};

py::object callable(const py::object& function, const DirectCall& call, py::object dynamics, const Options& options, py::object frame, int states, py::object made = py::object()) {
  static PyObject* const type = PyType_FromSpec(&spec);
  auto* const c = type ? PyObject_GC_New(Callable, reinterpret_cast<PyTypeObject*>(type)) : nullptr;
  if (!c) throw py::error_already_set();
  c->vectorcall = called;
  c->function = function.inc_ref().ptr();
  c->dynamics = dynamics.release().ptr();
  c->call = &call;
  c->options = options;
  c->frame = frame.release().ptr();
  c->made = made.release().ptr();
  c->states = states;
  PyObject_GC_Track(c);
  return py::reinterpret_steal<py::object>(reinterpret_cast<PyObject*>(c));
}

using Names = py::typing::Tuple<py::str, py::ellipsis>;

template <class Texts>
Names names_of(const Texts& texts) {
  py::list names;
  for (const char* const text : texts)
    if (text) names.append(text);
  return py::tuple(names);
}

}  // namespace

void register_direct_calls(py::module_& m) {
  m.def("direct_calls", [] {
    py::typing::Dict<py::str, py::typing::Tuple<Names, Names>> all;
    for (const DirectCall& call : direct_calls) all[call.name] = py::make_tuple(names_of(call.arrays), names_of(call.options()));
    return all;
  }, "By name: the arrays of each direct call, and the options that it is prepared with.");
  m.def("direct_call", [](const py::function& function, const std::optional<py::type>& made) {
    const DirectCall& call = direct_call(py::cast<std::string>(function.attr("__name__")));
    if (made.has_value() != call.derivatives.has_value() || (made && !PyType_IsSubtype(reinterpret_cast<PyTypeObject*>(made->ptr()), &PyTuple_Type)))
      throw EvaluationError("calls with three results, and they alone, say in which kind of tuple they are");
    return callable(function, call, py::object(), Options{}, py::object(), -2, made ? py::object(*made) : py::object());
  }, py::arg("function"), py::arg("made") = py::none(), "The direct call of this name: its plain case in the core, everything else by the function. made: the tuple of its three results.");
  m.def("prepared_call", [](const py::object& function, const std::string& name, const py::object& dynamics, std::optional<int> batch, const std::optional<py::type>& made,
                            const py::str& frame, const py::object& form, const py::object& refine, const std::string& residual, Precision precision,
                            const std::string& on_singular) {
    const DirectCall& call = direct_call(name);
    Options options{{Form::fast, refinement(refine, residual, precision), on_singular_from_name(on_singular)}, precision};
    if (!form.is_none() && call.takes & takes_coriolis)
      options.skew = is_skew(py::cast<std::string>(form));
    else if (!form.is_none())
      options.how.form = py::cast<Form>(form);
    return callable(function, call, dynamics, options, frame, batch.value_or(-1), made ? py::object(*made) : py::object());
  }, py::arg("function"), py::arg("name"), py::arg("dynamics"), py::arg("batch"), py::arg("made"), py::kw_only(), py::arg("frame") = "", py::arg("form") = py::none(),
     py::arg("refine") = 0, py::arg("residual") = "same", py::arg("precision") = Precision::double_, py::arg("on_singular") = "raise",
     "A direct call of one model with its options, as `prepare` gives it. made: the tuple of three results.");
}

}  // namespace pycraft
