#include "algebra/language/space.h"

#include <cstdint>
#include <limits>

#include "bindings/bindings.h"
#include "runtime/errors.h"

namespace pycraft {

void register_spaces(py::module_& m) {
  declared<py::class_<Space>>(m, "Space")
      .def_property_readonly("name", &Space::name)
      .def_property_readonly("dimension", &Space::dimension)
      .def_property_readonly("dual", &Space::dual)
      .def_property_readonly(
          "blocks",
          [](const Space& s) {
            py::list blocks;
            for (const auto& b : s.layout().blocks) blocks.append(py::make_tuple(b.label, py::slice(b.offset, b.offset + b.size, 1), b.body));
            return blocks;
          },
          "List of (label, slice, body number) in the order of a vector's entries; body -1 for none.")
      .def_property_readonly("bodies", [](const Space& s) { return s.belongs_to_bodies() ? s.layout().of_body.size() : 0; },
                             "Number of bodies that it is cut into; 0 for R^n.")
      .def_property_readonly("_owner", [](const Space& s) { return reinterpret_cast<std::uintptr_t>(s.layout().bodies); })
      .def("__len__", &Space::dimension)
      .def("__eq__", [](const Space& a, const Space& b) { return a == b; })
      .def("__eq__", [](const Space&, const py::object&) { return py::reinterpret_borrow<py::object>(Py_NotImplemented); })
      .def("__hash__", [](const Space& s) { return py::hash(py::make_tuple(static_cast<int>(s.kind()), s.dimension())); })
      .def("__reduce__", [](const Space& s) -> py::tuple {
        return py::make_tuple(py::module_::import("pycraft._core").attr("_space_from_parts"), py::make_tuple(space_parts(s)));
      })
      .def("__repr__", [](const Space& s) { return "<space " + s.description() + ">"; });
  m.def("_space_from_parts", &space_from_parts);
  m.def("euclidean", [](const py::object& dimension) {
    const int n = PyIndex_Check(dimension.ptr()) ? clipped(dimension) : -1;
    if (n < 0 || n == std::numeric_limits<int>::max()) throw SpaceError("euclidean(" + std::string(py::repr(dimension)) + "): the dimension is a whole number, zero or more");
    return Space::euclidean(n);
  }, py::arg("dimension"), "R^n, a space of a user's own: self-dual, cut into no bodies.");
}

}  // namespace pycraft
