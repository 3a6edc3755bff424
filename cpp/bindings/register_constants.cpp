// A user's own operators: arrays, and linear operators from outside.
#include <cmath>

#include "bindings/bindings.h"
#include "bindings/users_function.h"
#include "numerics/finite.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

void require_finite(const Array& a, const std::string& name) {
  for (py::ssize_t i = 0; i < a.size(); ++i)
    if (!std::isfinite(a.data()[i])) throw EvaluationError("constant '" + name + "' has an entry that is not a finite number");
}

Expression constant_operator(const py::object& given, const py::object& domain, const py::object& codomain, const std::string& name) {
  const auto space = [](const py::object& s) { 
    if (py::isinstance<Space>(s)) return s.cast<Space>();
    return py::module_::import("pycraft._core").attr("euclidean")(s).cast<Space>();
  };
  const Space in = space(domain), out = space(codomain);
  if (py::isinstance<py::list>(given) && py::len(given) > 0 && py::isinstance<py::array>(py::list(given)[0]) && in.belongs_to_bodies() &&
      py::len(given) == in.layout().of_body.size()) {
    std::vector<std::vector<double>> blocks;
    for (const auto& item : py::list(given)) {
      const Array b = real_array(py::reinterpret_borrow<py::object>(item));
      require_finite(b, name);
      blocks.emplace_back(b.data(), b.data() + b.size());
    }
    return constant_blocks(std::move(blocks), in, out, name);
  }
  const Array a = real_array(given);
  require_finite(a, name);
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
  const auto wrap = [&name](const py::object& f, int in, int out) -> std::function<void(const double*, double*, int)> {
    if (f.is_none()) return nullptr;
    auto held = std::make_shared<Callable>(f);
    return [held, in, out, name](const double* x, double* y, int m) {
      py::gil_scoped_acquire gil;
      py::array_t<double> a({static_cast<py::ssize_t>(in), static_cast<py::ssize_t>(m)});
      std::copy_n(x, size_t(in) * m, a.mutable_data());
      const std::string what = "the result of '" + name + "', an operator from outside,";
      const Array r = numbers(of_user("the operator from outside '" + name + "'", [&] { return held->f(a); }), what.c_str());
      const bool fits = (r.ndim() == 2 && r.shape(0) == out && r.shape(1) == m) || (r.ndim() == 1 && m == 1 && r.shape(0) == out);
      if (!fits)
        throw EvaluationError(what + " is " + shape_text(r) + "; of an array (" + std::to_string(in) + ", " + std::to_string(m) + ") it is (" + std::to_string(out) +
                              ", " + std::to_string(m) + ")");
      if (!all_finite(r.data(), size_t(r.size()))) throw EvaluationError(what + " has an entry that is no finite number");
      std::copy_n(r.data(), r.size(), y);
    };
  };
  data->apply = wrap(product, domain.dimension(), codomain.dimension());
  data->apply_transposed = wrap(transposed, codomain.dimension(), domain.dimension());
  return external(std::move(data), domain, codomain);
}

}  // namespace

void register_constants(py::module_& m) {
  m.def("real_array", [](const py::object& value, const std::string& what) { return numbers(value, what.c_str()); }, py::arg("value"), py::arg("what"),
        "An array of doubles, or a ModelError that names `what`: complex numbers, text, dates, None and masked entries are none.");
  m.def("constant", &constant_operator, py::arg("array"), py::arg("domain"), py::arg("codomain"), py::arg("name") = "C",
        "An array as an operator from `domain` to `codomain` (spaces, or a size n for R^n): a matrix, one diagonal, or a list of one block per\n"
        "body. What is block diagonal over the bodies is kept so; what has low rank is found when a plan needs it.");
  m.def("external", &external_operator, py::arg("product"), py::arg("transposed"), py::arg("domain"), py::arg("codomain"), py::arg("name"));
}

}  // namespace pycraft
