// Forward dynamics by other methods than the articulated-body algorithm, for comparison.
#include "bindings/direct_calls.h"
#include "dynamics/methods.h"

namespace pycraft {

namespace {

using Methods = Batches<DynamicsMethods>;

}  // namespace

void register_methods(py::module_& m) {
  const py::arg q("q"), v("v"), tau("tau"), precision("precision");
  py::class_<Methods> methods_class(m, "Methods", "Forward dynamics of one model by 'cholesky', 'ldl', 'conjugate-gradients', 'inverse' or 'divide-and-conquer'.");
  unpicklable(methods_class)
      .def(py::init<std::shared_ptr<Multibody>>())
      .def("forward_dynamics", [](Methods& d, const std::string& method, const py::object& q, const py::object& v, const py::object& tau,
                                  Precision precision, const py::object& out, int threads) {
        const Method by = method_from_name(method);
        Arguments given(d.model(), {{"q", q}, {"v", v}, {"tau", tau}});
        return run(d, precision, given, out, {d.model().nv()}, [by, threads](auto& w, auto in, auto* y) { w.forward_dynamics(by, in[0], in[1], in[2], y, nullptr, threads); });
      }, py::arg("method"), q, v, tau, precision, py::arg("out"), py::arg("threads") = 1, "Accelerations (nv,) or (B, nv).")
      .def("conjugate_gradients", [](Methods& d, const py::object& q, const py::object& v, const py::object& tau, Precision precision) {
        const int nv = d.model().nv();
        Arguments given(d.model(), {{"q", q}, {"v", v}, {"tau", tau}});
        py::array_t<double> all = run(d, precision, given, py::none(), {nv + 2}, [nv](auto& w, auto in, auto* y) {
          w.forward_dynamics(Method::conjugate_gradients, in[0], in[1], in[2], y);
          y[nv] = w.iterations();
          y[nv + 1] = w.residual();
        });
        const auto part = [&](const py::object& index) { return py::array_t<double>(py::object(all[py::make_tuple(py::ellipsis(), index)])); };
        return std::make_tuple(part(py::slice(0, nv, 1)), part(py::int_(nv)), part(py::int_(nv + 1)));
      }, q, v, tau, precision, "(accelerations, iterations, relative residuals), each per state.")
      .def("memory", [](Methods& d, const std::string& method, Precision precision) {
        const Method by = method_from_name(method);
        size_t bytes = 0;
        const auto measure = [&]<class S>(S) { d.template each<S>(0, 1, 1, [&](DynamicsMethods<S>& w, int) { bytes = w.memory(by); }); };
        at_precision(precision, measure);
        return bytes;
      }, py::arg("method"), precision, "Bytes that a method reads and writes at one evaluation.");
  m.def("methods", [] {
    std::vector<std::string> names;
    for (const Method method : methods) names.push_back(method_name(method));
    return names;
  }, "The methods of forward dynamics that Methods has.");
}

}  // namespace pycraft
