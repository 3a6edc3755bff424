// Arrays as what direct calls are given (dynamics/batches.h), with an optional leading batch axis, and the arrays that they write.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "bindings/bindings.h"
#include "dynamics/batches.h"
#include "runtime/errors.h"

namespace pycraft {

// One argument. `name` must outlive it.
struct Argument {
  const char* name = "";
  Array array;
  Given given() const { return {name, array.data(), static_cast<int>(array.shape(array.ndim() - 1)), array.ndim() == 2 ? static_cast<int>(array.shape(0)) : -1}; }
};

inline Argument argument(const py::object& given, const char* name, const Multibody& model) {
  const bool of_q = name == std::string("q"), of_state = of_q || name == std::string("v");
  Argument a{name, numbers(of_state ? part_of_state(given, name) : given, name)};
  const int width = of_q ? model.nq() : model.nv();
  const py::ssize_t axes = a.array.ndim();
  if (axes < 1 || axes > 2 || a.array.shape(axes - 1) != width) throw_width(model, name, width);
  constexpr int most = std::numeric_limits<int>::max();  // the core counts states by int
  if (axes == 2 && a.array.shape(0) > most)
    throw ModelError(std::string(name) + " of '" + model.name() + "' has " + std::to_string(a.array.shape(0)) + " states; one call takes at most " +
                     std::to_string(most) + ": give them in parts");
  return a;
}

// What a call is given, and the arrays that hold it.
struct Arguments {
  std::vector<Argument> held;
  Arguments(const Multibody& model, const std::vector<std::pair<const char*, py::object>>& all) {
    for (const auto& [name, object] : all) held.push_back(argument(object, name, model));
    batch = common_batch(given());
  }
  std::vector<Given> given() const {
    std::vector<Given> all;
    for (const Argument& a : held) all.push_back(a.given());
    return all;
  }
  Given operator[](size_t i) const { return held[i].given(); }
  int batch;

  // An argument in the memory that the result is written to would change while it is read: it is copied first.
  void keep_apart(const py::array_t<double>& out) {
    for (Argument& a : held) {
      const double *from = a.array.data(), *to = out.data();
      if (from >= to + out.size() || to >= from + a.array.size()) continue;
      a.array = Array(std::vector<py::ssize_t>(a.array.shape(), a.array.shape() + a.array.ndim()), from);
    }
  }
};

inline py::array_t<double> output(const py::object& out, int batch, std::vector<py::ssize_t> shape) {
  if (batch >= 0) shape.insert(shape.begin(), batch);
  if (out.is_none()) return py::array_t<double>(shape);
  constexpr int aligned = py::detail::npy_api::NPY_ARRAY_ALIGNED_;
  const bool fits = py::isinstance<py::array_t<double>>(out) && (py::cast<py::array>(out).flags() & aligned) && (py::cast<py::array>(out).flags() & py::array::c_style) && py::cast<py::array>(out).writeable() &&
                    py::cast<py::array>(out).ndim() == static_cast<py::ssize_t>(shape.size()) &&
                    std::equal(shape.begin(), shape.end(), py::cast<py::array>(out).shape());
  if (!fits) {
    std::string text;
    for (py::ssize_t n : shape) text += (text.empty() ? "" : ", ") + std::to_string(n);
    throw ModelError("out= takes a writeable C-ordered float64 array of shape (" + text + ")");
  }
  return py::cast<py::array_t<double>>(out);
}

// Between what was checked and the result nobody edits the model, and other threads of Python run.
struct Undisturbed {
  explicit Undisturbed(const Multibody& model) : use(model) {}
  ModelInUse use;
  ReleasedGil release;
};

// What f(target) writes: out=, or a new array of this shape a state.
template <class F>
py::array_t<double> written(const Multibody& model, Arguments& arguments, const py::object& out, const std::vector<py::ssize_t>& shape, F f) {
  py::array_t<double> result = output(out, arguments.batch, shape);
  arguments.keep_apart(result);
  double* target = result.mutable_data();
  const Undisturbed undisturbed(model);
  f(target);
  return result;
}

// Which Coriolis matrix a form is: Hφ(MJ̇ + 𝓑J), or Christoffel's.
inline bool is_skew(const std::string& form) {
  if (form == "christoffel" || form == "skew") return form == "skew";
  throw EvaluationError("form '" + form + "' of the Coriolis matrix is not there; there are 'christoffel' and 'skew'");
}

// f(workspace, numbers, y) state after state, see Batches::run.
template <template <class> class Workspace, class F>
py::array_t<double> run(Batches<Workspace>& d, Precision precision, Arguments& arguments, const py::object& out, const std::vector<py::ssize_t>& shape, F f) {
  int size = 1;
  for (py::ssize_t n : shape) size *= static_cast<int>(n);
  return written(d.model(), arguments, out, shape, [&](double* target) { d.run(precision, arguments.given(), size, target, f); });
}

}  // namespace pycraft
