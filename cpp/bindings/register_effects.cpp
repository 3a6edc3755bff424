// Effects of scenes as the core has them: made by functions, for a model; pycraft.effects is their face.
#include <limits>

#include "bindings/python_effects.h"
#include "simulation/effects/bushing.h"
#include "simulation/effects/coulomb_friction.h"
#include "simulation/effects/damping.h"
#include "simulation/effects/fixman.h"
#include "simulation/effects/fluid_drag.h"
#include "simulation/effects/gravity.h"
#include "simulation/effects/gravity_compensation.h"
#include "simulation/effects/gravity_gradient.h"
#include "simulation/effects/implicit_damping.h"
#include "simulation/effects/implicit_spring.h"
#include "simulation/effects/langevin.h"
#include "simulation/effects/limits.h"
#include "simulation/effects/motor.h"
#include "simulation/effects/node_damper.h"
#include "simulation/effects/node_spring.h"
#include "simulation/effects/nose_hoover.h"
#include "simulation/effects/point_mass_gravity.h"
#include "simulation/effects/prescribed_motion.h"
#include "simulation/effects/quadratic_damping.h"
#include "simulation/effects/rotor_inertia.h"
#include "simulation/effects/servo.h"
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
  m.def("harmonic", [shared](Bounds amplitude, Bounds frequency, Bounds phase, Bounds offset) {
    return shared(harmonic(std::move(amplitude), std::move(frequency), std::move(phase), std::move(offset)));
  }, py::arg("amplitude"), py::arg("frequency"), py::arg("phase"), py::arg("offset"));
  m.def("python_function_of_time", [](const py::object& call, int size, const std::string& what) {
    return std::shared_ptr<FunctionOfTime>(std::make_shared<PythonFunctionOfTime>(call, size, what));
  }, py::arg("call"), py::arg("size"), py::arg("what"));
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
  m.def("point_mass_gravity_effect", [effect](const Multibody& model, double mu, const py::object& position, const Names& bodies) {
    return effect(std::make_shared<PointMassGravity>(model, mu, to_vector3(position, "point_mass_gravity: position"), bodies));
  }, py::arg("model"), py::arg("mu"), py::arg("position"), py::arg("bodies"));
  m.def("gravity_gradient_effect", [effect](const Multibody& model, double mu, const py::object& position, const Names& bodies) {
    return effect(std::make_shared<GravityGradient>(model, mu, to_vector3(position, "gravity_gradient: position"), bodies));
  }, py::arg("model"), py::arg("mu"), py::arg("position"), py::arg("bodies"));
  m.def("gravity_compensation_effect", [effect](const Multibody& model, const Names& bodies, const std::vector<double>& share, const std::vector<double>& points, const py::object& g) {
    return effect(std::make_shared<GravityCompensation>(model, bodies, share, points, to_vector3(g, "gravity_compensation: g")));
  }, py::arg("model"), py::arg("bodies"), py::arg("share"), py::arg("points"), py::arg("g"));
  m.def("fluid_drag_effect", [effect](const Multibody& model, double density, double viscosity, const py::object& wind, const std::vector<std::string>& nodes,
                                      const std::vector<py::array_t<double>>& placements, const std::vector<py::object>& sizes) {
    std::vector<BoxInFluid> boxes;
    for (size_t i = 0; i < nodes.size(); ++i) {
      const Node node = node_named(model, nodes[i], "fluid_drag");
      if (node.body < 0) throw ModelError("fluid_drag: '" + nodes[i] + "' is on the base, which no fluid moves");
      const auto X = placements[i].unchecked<2>();
      Pose<double> pose;
      for (int r = 0; r < 3; ++r) {
        pose.p[r] = X(r, 3);
        for (int c = 0; c < 3; ++c) pose.R(r, c) = X(r, c);
      }
      boxes.push_back({node.body, node.pose * pose, to_vector3(sizes[i], "fluid_drag: sizes")});
    }
    return effect(std::make_shared<FluidDrag>(density, viscosity, to_vector3(wind, "fluid_drag: wind"), std::move(boxes)));
  }, py::arg("model"), py::arg("density"), py::arg("viscosity"), py::arg("wind"), py::arg("nodes"), py::arg("placements"), py::arg("sizes"));
  m.def("quadratic_damping_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& coefficient) {
    return effect(std::make_shared<QuadraticDamping>(model, hinges, coefficient));
  }, py::arg("model"), py::arg("hinges"), py::arg("coefficient"));
  m.def("coulomb_friction_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& level, double smoothing) {
    return effect(std::make_shared<CoulombFriction>(model, hinges, level, smoothing));
  }, py::arg("model"), py::arg("hinges"), py::arg("level"), py::arg("smoothing"));
  m.def("implicit_damping_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& coefficient) {
    return effect(std::make_shared<ImplicitDamping>(model, hinges, coefficient));
  }, py::arg("model"), py::arg("hinges"), py::arg("coefficient"));
  m.def("implicit_spring_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& rest) {
    return effect(std::make_shared<ImplicitSpring>(model, hinges, stiffness, rest));
  }, py::arg("model"), py::arg("hinges"), py::arg("stiffness"), py::arg("rest"));
  m.def("rotor_inertia_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& inertia, const std::vector<double>& gear_ratio) {
    return effect(std::make_shared<RotorInertia>(model, hinges, inertia, gear_ratio));
  }, py::arg("model"), py::arg("hinges"), py::arg("inertia"), py::arg("gear_ratio"));
  m.def("node_spring_effect", [effect](const Multibody& model, const std::string& a, const std::string& b, double stiffness, double length) {
    return effect(std::make_shared<NodeSpring>(model, a, b, stiffness, length));
  }, py::arg("model"), py::arg("node_a"), py::arg("node_b"), py::arg("stiffness"), py::arg("length"));
  m.def("node_damper_effect", [effect](const Multibody& model, const std::string& a, const std::string& b, double coefficient) {
    return effect(std::make_shared<NodeDamper>(model, a, b, coefficient));
  }, py::arg("model"), py::arg("node_a"), py::arg("node_b"), py::arg("coefficient"));
  m.def("bushing_effect", [effect](const Multibody& model, const std::string& a, const std::string& b, const Array& stiffness, const Array& damping, const py::object& rotation, const py::object& position) {
    const auto all = [](const Array& x) { return std::vector<double>(x.data(), x.data() + x.size()); };
    const Pose<double> rest{to_matrix3(rotation, "bushing: rest"), to_vector3(position, "bushing: rest")};
    return effect(std::make_shared<Bushing>(model, a, b, all(stiffness), all(damping), rest));
  }, py::arg("model"), py::arg("node_a"), py::arg("node_b"), py::arg("stiffness"), py::arg("damping"), py::arg("rotation"), py::arg("position"));
  m.def("servo_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& damping,
                                 const std::shared_ptr<FunctionOfTime>& target, const Bounds& effort, const Bounds& speed, double band) {
    return effect(std::make_shared<Servo>(model, hinges, stiffness, damping, target, DriveLimits{effort, speed, band}));
  }, py::arg("model"), py::arg("hinges"), py::arg("stiffness"), py::arg("damping"), py::arg("target"), py::arg("effort_limit"), py::arg("speed_limit"), py::arg("speed_band"));
  m.def("motor_effect", [effect](const Multibody& model, const Names& hinges, const std::shared_ptr<FunctionOfTime>& command, const std::vector<double>& stall_torque,
                                 const std::vector<double>& no_load_speed, const std::vector<double>& gear_ratio, const std::vector<double>& rotor_inertia, const Bounds& effort, const Bounds& speed,
                                 double band) {
    return effect(std::make_shared<Motor>(model, hinges, command, MotorNumbers{stall_torque, no_load_speed, gear_ratio, rotor_inertia}, DriveLimits{effort, speed, band}));
  }, py::arg("model"), py::arg("hinges"), py::arg("command"), py::arg("stall_torque"), py::arg("no_load_speed"), py::arg("gear_ratio"), py::arg("rotor_inertia"), py::arg("effort_limit"),
     py::arg("speed_limit"), py::arg("speed_band"));
  m.def("limits_effect", [effect](const Multibody& model, const Names& hinges, const std::vector<double>& stiffness, const std::vector<double>& dissipation, const std::vector<double>& lower,
                                  const std::vector<double>& upper) {
    return effect(std::make_shared<Limits>(model, hinges, stiffness, dissipation, lower, upper));
  }, py::arg("model"), py::arg("hinges"), py::arg("stiffness"), py::arg("dissipation"), py::arg("lower"), py::arg("upper"));
  m.def("langevin_effect", [effect](const Multibody& model, const Names& hinges, double kT, const std::vector<double>& friction, double period, std::uint64_t seed) {
    return effect(std::make_shared<Langevin>(model, hinges, kT, friction, period, seed));
  }, py::arg("model"), py::arg("hinges"), py::arg("kT"), py::arg("friction"), py::arg("period"), py::arg("seed"));
  m.def("nose_hoover_effect", [effect](const Multibody& model, const Names& hinges, double kT, double time_constant, int chain) {
    return effect(std::make_shared<NoseHoover>(model, hinges, kT, time_constant, chain));
  }, py::arg("model"), py::arg("hinges"), py::arg("kT"), py::arg("time_constant"), py::arg("chain"), py::keep_alive<0, 1>());
  m.def("fixman_effect", [effect](const Multibody& model, double kT) { return effect(std::make_shared<Fixman>(model, kT)); }, py::arg("model"), py::arg("kT"), py::keep_alive<0, 1>());
  m.def("python_effect", [effect](const Multibody& model, const std::string& kind, std::vector<int> coordinates, const py::object& forces, const py::object& rates, std::vector<double> states,
                                  const py::object& sample, double period) {
    return effect(std::make_shared<PythonEffect>(kind, model.nq(), model.nv(), std::move(coordinates), forces, rates, std::move(states), sample, period));
  }, py::arg("model"), py::arg("kind"), py::arg("coordinates"), py::arg("forces"), py::arg("rates"), py::arg("states"), py::arg("sample"), py::arg("period"));
}

}  // namespace pycraft
