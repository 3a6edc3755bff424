// Hybrid dynamics on arrays: which coordinates are prescribed is said once, by an object that is called.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bindings/direct_calls.h"
#include "bindings/plain_arrays.h"
#include "dynamics/batch_hybrid_dynamics.h"
#include "simulation/selection.h"

namespace pycraft {

namespace {

// Per coordinate, of names of hinges or coordinates; hinges that have none, locked or welds, are where they are told to be. ModelError for a name
// that is not there, and for what is named twice. option: which one the names are of, for errors.
std::vector<char> prescribed_by(const Multibody& model, const std::vector<std::string>& names, const std::string& option = "prescribed") {
  std::vector<char> prescribed(model.nv(), 0);
  for (const std::string& name : names)
    for (int j : coordinates_named(model, Names({name}), option, true)) {
      if (prescribed[j])
        throw ModelError(option + ": coordinate '" + model.structure().coordinate_names[j] + "' is " + (option == "prescribed" ? option : "named") +
                         " twice, the second time as '" + name + "'");
      prescribed[j] = 1;
    }
  return prescribed;
}

// Calls in loops: options are read once, and arrays are taken that are plain.
struct PreparedHybrid {
  py::object owner;  // of what computes
  BatchHybridDynamics* dynamics;
  Solving how;
  Precision precision;
  int states;          // -1: one
  std::uint64_t made;  // for these parameters of the model

  // (v̇, T); None where something is not plain, there are other states than was said, or the model was edited since.
  py::object call(py::handle q, py::handle v, py::handle tau, py::handle vdot) const {
    const Multibody& model = dynamics->model();
    if (model.parameters() != made) return py::none();
    const int nv = model.nv();
    const std::optional<Given> given[] = {plain_argument(q.ptr(), "q", model.nq()), plain_argument(v.ptr(), "v", nv), plain_argument(tau.ptr(), "tau", nv), plain_argument(vdot.ptr(), "vdot", nv)};
    int batch = -1;
    for (const auto& one : given) {
      if (!one || (one->batch >= 0 && one->batch != states)) return py::none();
      batch = std::max(batch, one->batch);
    }
    if (batch != states) return py::none();
    py::array_t<double> accelerations = output(py::none(), states, {nv}), forces = output(py::none(), states, {nv});
    double *const to_accelerations = accelerations.mutable_data(), *const to_forces = forces.mutable_data();
    const auto compute = [&] { dynamics->run(*given[0], *given[1], *given[2], *given[3], how, precision, to_accelerations, to_forces); };
    if (model.bodies() * std::max(states, 1) <= kept) {
      compute();
    } else {
      const Undisturbed undisturbed(model);
      compute();
    }
    return py::make_tuple(accelerations, forces);
  }
  static constexpr long kept = 64;  // bodies times states below which letting the GIL go would cost more than it gives to others
};

}  // namespace

void register_hybrid_dynamics(py::module_& m) {
  m.def("prescribed_by", [](const Multibody& model, const std::vector<std::string>& names, const std::string& option) {
    const std::vector<char> prescribed = prescribed_by(model, names, option);
    return std::vector<bool>(prescribed.begin(), prescribed.end());
  }, py::arg("model"), py::arg("names"), py::arg("option") = "prescribed", "Whether each coordinate is prescribed, by names of hinges, coordinates or patterns; ModelError for one that is named twice.");
  py::class_<PreparedHybrid> prepared(m, "PreparedHybridDynamics", "Hybrid dynamics whose options were read once.");
  unpicklable(prepared).def("__call__", &PreparedHybrid::call, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("vdot"),
                            "Accelerations and forces; None where an argument is not a plain array, there are other states than was said, or the model was edited since.");
  py::class_<BatchHybridDynamics> hybrid(m, "HybridDynamics");
  unpicklable(hybrid)
      .def(py::init([](std::shared_ptr<Multibody> model, const std::vector<std::string>& names) {
        std::vector<char> prescribed = prescribed_by(*model, names);
        return std::make_unique<BatchHybridDynamics>(std::move(model), std::move(prescribed));
      }), py::arg("model"), py::arg("names"))
      .def_property_readonly("prescribed", [](const BatchHybridDynamics& d) { return std::vector<bool>(d.prescribed().begin(), d.prescribed().end()); }, "Whether each coordinate is.")
      .def("prepared", [](const py::object& self, Form form, const py::object& refine, const std::string& residual, Precision precision, int states) {
        auto& d = py::cast<BatchHybridDynamics&>(self);
        return PreparedHybrid{self, &d, {form, refinement(refine, residual, precision), OnSingular::raise}, precision, states, d.model().parameters()};
      }, py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"), py::arg("states"), "For loops, of one state (-1) or so many a call.")
      .def("__call__", [](BatchHybridDynamics& d, const py::object& q, const py::object& v, const py::object& tau, const py::object& vdot, Form form, const py::object& refine,
                          const std::string& residual, Precision precision, int threads) {
        const Multibody& model = d.model();
        Arguments given(model, {{"q", q}, {"v", v}, {"tau", tau}, {"vdot", vdot}});
        const Solving how{form, refinement(refine, residual, precision), OnSingular::raise};
        py::array_t<double> accelerations = output(py::none(), given.batch, {model.nv()}), forces = output(py::none(), given.batch, {model.nv()});
        double *to_accelerations = accelerations.mutable_data(), *to_forces = forces.mutable_data();
        {
          const Undisturbed undisturbed(model);
          d.run(given[0], given[1], given[2], given[3], how, precision, to_accelerations, to_forces, threads);
        }
        return py::make_tuple(accelerations, forces);
      }, py::arg("q"), py::arg("v"), py::arg("tau"), py::arg("vdot"), py::arg("form"), py::arg("refine"), py::arg("residual"), py::arg("precision"), py::arg("threads"));
}

}  // namespace pycraft
