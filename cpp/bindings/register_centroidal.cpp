// What is about the centre of mass, on arrays: one block of numbers a state, which Python cuts.
#include "bindings/direct_calls.h"
#include "dynamics/centroidal.h"

namespace pycraft {

void register_centroidal(py::module_& m) {
  using Calls = Batches<Centroidal>;
  const py::arg q("q"), v("v"), precision("precision");
  py::class_<Calls> centroidal(m, "Centroidal", "Centre of mass of one model and what is about it.");
  unpicklable(centroidal)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("sums", [](Calls& d, const py::object& q, const py::object& v, Precision precision) {
        Arguments given(d.model(), {{"q", q}, {"v", v}});
        return run(d, precision, given, py::none(), {Centroidal<double>::sums}, [](auto& w, auto in, auto* y) { w.sum(in[0], in[1], y); });
      }, q, v, precision, "Centre of mass (3), its velocity (3), inertia about it (9), momentum about it (6).")
      .def("columns", [](Calls& d, const py::object& q, const py::object& v, Precision precision) {
        const int n = d.model().nv();
        Arguments given(d.model(), {{"q", q}, {"v", v}});
        return run(d, precision, given, py::none(), {3, 6, n}, [n](auto& w, auto in, auto* y) { w.columns(in[0], in[1], y, y + 6 * n, y + 12 * n); });
      }, q, v, precision, "The centroidal momentum matrix, its rate, and the momentum's derivative, (6, nv) each.");
}

}  // namespace pycraft
