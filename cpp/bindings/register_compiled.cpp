// Compiled functions (pycraft/compiled): what a kernel does for one model, to write source from, and the callable around what was built of it.
#include <memory>

#include <generated/kernel_headers.h>

#include "bindings/compiled_library.h"
#include "bindings/plain_arrays.h"
#include "bindings/tapes.h"
#include "kernels/link_model.h"
#include "kernels/taped_calls.h"
#include "model/multibody.h"
#include "recursions/recorded_frames.h"
#include <structmember.h>  // after Python.h

namespace pycraft {

namespace {

constexpr int most_inputs = 4;

// Takes contiguous arrays to the library; whatever else comes, and what is left in doubt, is for the Python object behind it.
struct CompiledCall {
  PyObject_HEAD
  vectorcallfunc vectorcall;
  PyObject* behind;
  CompiledRun run;
  int inputs, widths[most_inputs];
  int axes;
  py::ssize_t lengths[2], size;  // of one result
  py::ssize_t work;              // operations a state
};

// Operations below which the GIL is kept: letting it go and taking it again would cost more than it gives to others.
constexpr py::ssize_t kept = 1 << 15;

const CompiledCall& of(PyObject* self) { return *reinterpret_cast<CompiledCall*>(self); }

// The result; nothing where something is not plain or in doubt.
py::object computed(const CompiledCall& c, PyObject* const* args, py::ssize_t count, PyObject* names) {
  PyObject* given_out = nullptr;
  if (names && PyTuple_GET_SIZE(names) > 0) {
    if (PyTuple_GET_SIZE(names) != 1 || PyUnicode_CompareWithASCIIString(PyTuple_GET_ITEM(names, 0), "out") != 0) return py::object();
    if (args[count] != Py_None) given_out = args[count];
  }
  if (count != c.inputs) return py::object();
  const double* given[most_inputs];
  std::int64_t strides[most_inputs];
  int states = -1;
  for (int i = 0; i < c.inputs; ++i) {
    const auto a = plain_argument(args[i], "", c.widths[i]);
    if (!a || (a->batch >= 0 && states >= 0 && states != a->batch)) return py::object();
    if (a->batch >= 0) states = a->batch;
    given[i] = a->data, strides[i] = a->batch < 0 ? 0 : c.widths[i];
  }
  py::ssize_t lengths[3];
  int axes = 0;
  if (states >= 0) lengths[axes++] = states;
  for (int i = 0; i < c.axes; ++i) lengths[axes++] = c.lengths[i];
  const py::ssize_t all = states < 0 ? 1 : states, size = all * c.size;
  py::object result;
  double* out;
  if (given_out) {
    const auto a = plain(given_out);
    if (!a || !a->writeable || a->axes != axes || !std::equal(lengths, lengths + axes, a->lengths)) return py::object();
    for (int i = 0; i < c.inputs; ++i)
      if (overlap(a->data, size, given[i], c.widths[i] * (strides[i] ? all : 1))) return py::object();
    result = py::reinterpret_borrow<py::object>(given_out), out = a->data;
  } else {
    result = py::reinterpret_steal<py::object>(new_array(axes, lengths));
    if (!result) throw py::error_already_set();
    out = reinterpret_cast<double*>(py::detail::array_proxy(result.ptr())->data);
  }
  std::int64_t doubted;
  if (all * c.work <= kept) {
    doubted = c.run(given, strides, out, all);
  } else {
    const ReleasedGil released;
    doubted = c.run(given, strides, out, all);
  }
  return doubted == 0 ? result : py::object();
}

PyObject* called(PyObject* self, PyObject* const* args, size_t flags, PyObject* names) {
  const CompiledCall& c = of(self);
  try {
    if (py::object result = computed(c, args, PyVectorcall_NARGS(flags), names)) return result.release().ptr();
    return PyObject_Vectorcall(c.behind, args, flags & ~PY_VECTORCALL_ARGUMENTS_OFFSET, names);
  } catch (py::error_already_set& e) {
    e.restore();
  } catch (...) {
    py::detail::try_translate_exceptions();
  }
  return nullptr;
}

// Attributes, documentation and representation are those of the object behind it.
PyObject* attribute(PyObject* self, PyObject* name) {
  if (PyUnicode_CompareWithASCIIString(name, "__class__") == 0) return PyObject_GenericGetAttr(self, name);
  return PyObject_GetAttr(of(self).behind, name);
}
PyObject* representation(PyObject* self) { return PyObject_Repr(of(self).behind); }

int visit(PyObject* self, visitproc visit, void* arg) {
  Py_VISIT(Py_TYPE(self));
  Py_VISIT(of(self).behind);
  return 0;
}
int clear(PyObject* self) {
  Py_CLEAR(reinterpret_cast<CompiledCall*>(self)->behind);
  return 0;
}
void destroy(PyObject* self) {
  PyObject_GC_UnTrack(self);
  clear(self);
  PyTypeObject* const type = Py_TYPE(self);
  type->tp_free(self);
  Py_DECREF(type);
}

PyMemberDef members[] = {{"__vectorcalloffset__", T_PYSSIZET, offsetof(CompiledCall, vectorcall), READONLY, nullptr}, {nullptr, 0, 0, 0, nullptr}};
PyType_Slot slots[] = {{Py_tp_call, reinterpret_cast<void*>(PyVectorcall_Call)}, {Py_tp_getattro, reinterpret_cast<void*>(attribute)},
                       {Py_tp_repr, reinterpret_cast<void*>(representation)},   {Py_tp_traverse, reinterpret_cast<void*>(visit)},
                       {Py_tp_clear, reinterpret_cast<void*>(clear)},           {Py_tp_dealloc, reinterpret_cast<void*>(destroy)},
                       {Py_tp_members, members},                                {0, nullptr}};
PyType_Spec spec = {"pycraft._core.CompiledCall", sizeof(CompiledCall), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC | Py_TPFLAGS_HAVE_VECTORCALL | Py_TPFLAGS_DISALLOW_INSTANTIATION, slots};

py::object compiled_call(const py::object& behind, const std::string& library, const std::string& function, const std::vector<int>& widths, const std::vector<py::ssize_t>& lengths,
                         py::ssize_t work) {
  static PyObject* const type = PyType_FromSpec(&spec);
  if (widths.size() > most_inputs || lengths.size() > 2) throw EvaluationError("a compiled function takes at most four arrays and gives at most a matrix");
  const CompiledRun run = load_compiled(library, function);
  auto* const c = type ? PyObject_GC_New(CompiledCall, reinterpret_cast<PyTypeObject*>(type)) : nullptr;
  if (!c) throw py::error_already_set();
  c->vectorcall = called;
  c->behind = behind.inc_ref().ptr();
  c->run = run;
  c->inputs = static_cast<int>(widths.size()), std::copy(widths.begin(), widths.end(), c->widths);
  c->axes = static_cast<int>(lengths.size()), std::copy(lengths.begin(), lengths.end(), c->lengths);
  c->size = 1, c->work = work;
  for (const py::ssize_t n : lengths) c->size *= n;
  PyObject_GC_Track(c);
  return py::reinterpret_steal<py::object>(reinterpret_cast<PyObject*>(c));
}

py::object tape(const Multibody& model, const std::string& call) {
  using kernels::Call;
  const bool bias = call == "bias_forces", matrix = call == "mass_matrix" || call == "mass_matrix_inverse";
  const Call which = call == "forward_dynamics" ? Call::forward_dynamics : call == "mass_matrix" ? Call::mass_matrix : call == "mass_matrix_inverse" ? Call::mass_matrix_inverse : Call::inverse_dynamics;
  const auto links = kernels::LinkModel<double>::of(model);
  if (!links) return py::none();
  double gravity[3];
  for (int i = 0; i < 3; ++i) gravity[i] = model.gravity()[i];
  const kernels::Tape made = tape_of(links->links(), which, gravity, !bias, matrix ? model.nv() * model.nv() : model.nv());
  return plain_tape(made);
}

}  // namespace

void register_compiled(py::module_& m) {
  m.def("kernel_tape", &tape, py::arg("model"), py::arg("call"),
        "What the kernel of a direct call does for this model, operation by operation; None where no kernel knows the model's hinges.");
  m.def("frame_tape", [](const Multibody& model, const std::string& call, const std::string& frame, size_t most) {
    const Node node = model.node(model.node_index(frame));
    return plain_tape(call == "pose" ? recorded_pose(model, node, most) : recorded_jacobian(model, node, most));
  }, py::arg("model"), py::arg("call"), py::arg("frame"), py::arg("most"), "The pose (4, 4) or the Jacobian (6, nv) of a body or node, operation by operation.");
  m.def("compiled_call", &compiled_call, py::arg("behind"), py::arg("library"), py::arg("function"), py::arg("widths"), py::arg("lengths"), py::arg("work"),
        "The callable of a built library; `behind` is called where arguments are not contiguous float64 arrays, or results in doubt.");
  m.def("kernel_headers", [] {
    return py::dict(py::arg("lanes.h") = lanes_text, py::arg("sine_cosine.h") = sine_cosine_text);
  }, "The text of the headers that compiled source begins with.");
}

}  // namespace pycraft
