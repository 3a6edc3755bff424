// Effects of scenes as the core has them: made by functions, for a model; pycraft.effects is their face.
#include <limits>

#include "bindings/python_effects.h"
#include "simulation/effects/damping.h"
#include "simulation/effects/gravity.h"
#include "simulation/effects/prescribed_motion.h"
#include "simulation/effects/spring.h"
#include "simulation/effects/torque_source.h"
#include "simulation/effects/wrench.h"

namespace pycraft {

namespace {

using EffectPointer = std::shared_ptr<const Effect>;
using Bounds = std::vector<double>;

}  // namespace

void register_effects(py::module_& m) {
  py::class_<FunctionOfTime, std::shared_ptr<FunctionOfTime>>(m, "FunctionOfTime", "Numbers as a function of time, with two derivatives.")
      .def_property_readonly("size", &FunctionOfTime::size)
      .def("__call__", [](const FunctionOfTime& f, double t) {
        py::array_t<double> all({3, f.size()});
        double* const x = all.mutable_data();
        f.at(t, x, x + f.size(), x + 2 * f.size());
        return all;
      }, py::arg("t"), "(3, size): values, rates and second derivatives.");
  const auto shared = [](const TimeFunction& f) { return std::const_pointer_cast<FunctionOfTime>(f); };
  m.def("constant_in_time", [shared](std::vector<double> values) { return shared(constant_in_time(std::move(values))); }, py::arg("values"));
  m.def("piecewise_polynomial", [shared](std::vector<double> breaks, const Array& coefficients, int size) {
    return shared(piecewise_polynomial(std::move(breaks), {coefficients.data(), coefficients.data() + coefficients.size()}, size));
  }, py::arg("breaks"), py::arg("coefficients"), py::arg("size"));
  m.def("harmonic", [shared](double amplitude, double frequency, double phase, double offset) { return shared(harmonic(amplitude, frequency, phase, offset)); }, py::arg("amplitude"),
        py::arg("frequency"), py::arg("phase"), py::arg("offset"));
  m.def("python_function_of_time", [](const py::object& call, int size) { return std::shared_ptr<FunctionOfTime>(std::make_shared<PythonFunctionOfTime>(call, size)); }, py::arg("call"),
        py::arg("size"));
  m.def("coordinates_named", [](const Multibody& model, const Names& names, const std::string& effect) { return coordinates_named(model, names, effect); }, py::arg("model"), py::arg("names"),
        py::arg("effect"), "Numbers of the coordinates that names of hinges, coordinates or patterns mean; None: all.");
  m.def("numbers_in_q", [](const Multibody& model, const std::vector<int>& coordinates) {
    int count = 0;
    for (const int j : coordinates) {
      const SubhingePlace at = subhinge_of_coordinate(model, j);
      if (at.v == j) count += record_of(at.kind).nq;
    }
    return count;
  }, py::arg("model"), py::arg("coordinates"), "How many numbers these coordinates' subhinges have in q.");

  py::class_<Effect, std::shared_ptr<Effect>>(m, "Effect", "An effect as the core has it; pycraft.effects makes them.")
      .def_property_readonly("kind", &Effect::kind)
      .def_property_readonly("potential", [](const Effect& e) { return e.declaration().potential || e.declaration().uniform_gravity; }, "Whether it has a potential energy.")
      .def_property_readonly("work", [](const Effect& e) { return e.declaration().work; }, "Whether some of its forces have none.")
      .def_property_readonly("coordinates", [](const Effect& e) { return e.declaration().coordinates; });
  const auto effect = [](auto made) { return std::shared_ptr<Effect>(std::move(made)); };
  m.def("gravity_effect", [effect](const py::object& g) { return effect(std::make_shared<Gravity>(to_vector3(g, "gravity: g"))); }, py::arg("g"));
  m.def("damping_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& coefficient) {
    return effect(std::make_shared<Damping>(model, hinges, coefficient));
  }, py::arg("model"), py::arg("hinges"), py::arg("coefficient"));
  m.def("spring_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& rest) {
    return effect(std::make_shared<Spring>(model, hinges, stiffness, rest));
  }, py::arg("model"), py::arg("hinges"), py::arg("stiffness"), py::arg("rest"));
  m.def("prescribed_effect", [effect](const Multibody& model, const Names& hinges, const std::shared_ptr<FunctionOfTime>& motion) {
    return effect(std::make_shared<PrescribedMotion>(model, hinges, motion));
  }, py::arg("model"), py::arg("hinges"), py::arg("motion"));
  m.def("wrench_effect", [effect](const Multibody& model, const std::string& node, const std::shared_ptr<FunctionOfTime>& wrench, const std::string& axes) {
    return effect(std::make_shared<Wrench>(model, node, wrench, axes));
  }, py::arg("model"), py::arg("node"), py::arg("wrench"), py::arg("axes"));
  m.def("torque_source_effect", [effect](const Multibody& model, const Names& hinges, const std::shared_ptr<FunctionOfTime>& torque, const Bounds& effort, const Bounds& speed, double band) {
    return effect(std::make_shared<TorqueSource>(model, hinges, torque, DriveLimits{effort, speed, band}));
  }, py::arg("model"), py::arg("hinges"), py::arg("torque"), py::arg("effort_limit"), py::arg("speed_limit"), py::arg("speed_band"));
  m.def("python_effect", [effect](const Multibody& model, const std::string& kind, std::vector<int> coordinates, const py::object& forces, const py::object& rates, std::vector<double> states,
                                  const py::object& sample, double period) {
    return effect(std::make_shared<PythonEffect>(kind, model.nq(), model.nv(), std::move(coordinates), forces, rates, std::move(states), sample, period));
  }, py::arg("model"), py::arg("kind"), py::arg("coordinates"), py::arg("forces"), py::arg("rates"), py::arg("states"), py::arg("sample"), py::arg("period"));
}

}  // namespace pycraft
