#include "algebra/plan.h"

#include "bindings/bindings.h"

namespace pycraft {

void register_plans(py::module_& m) {
  m.def("epsilons", [] {
    py::dict d;
    d["double"] = to_double(epsilon<double>());
    d["extended"] = to_double(epsilon<Extended>());
    d["quad"] = to_double(epsilon<Quad>());
    return d;
  }, "Epsilon of each precision by name.");
  py::class_<PassCounts>(m, "PassCounts", "What the last run of a plan executed.")
      .def_readonly("values", &PassCounts::values)
      .def_readonly("gathers", &PassCounts::gathers)
      .def_readonly("scatters", &PassCounts::scatters)
      .def_readonly("kernels", &PassCounts::kernels)
      .def_readonly("eliminations", &PassCounts::eliminations)
      .def_readonly("dense", &PassCounts::dense)
      .def("__repr__", [](const PassCounts& c) {
        return "<passes: " + std::to_string(c.kernels) + " kernels, " + std::to_string(c.gathers) + " gathers, " + std::to_string(c.scatters) +
               " scatters, " + std::to_string(c.eliminations) + " eliminations, " + std::to_string(c.dense) + " dense>";
      });
  declared<py::class_<ExecutionPool, std::shared_ptr<ExecutionPool>>>(m, "Plan")
      .def("__str__",
           [](const ExecutionPool& p) {
             std::string text = explain(p.plan());
             for (const std::string& note : p.run_notes()) text += "  in the last run: " + note + "\n";
             return text;
           })
      .def("__repr__", [](const ExecutionPool& p) { return "<plan of " + p.plan().text + ": " + std::to_string(p.plan().steps.size()) + " steps>"; })
      .def_property_readonly("flops", [](const ExecutionPool& p) { return p.plan().flops(); }, "Floating-point operations, for one column.")
      .def_property_readonly("memory", [](const ExecutionPool& p) { return p.plan().bytes(); }, "Bytes of the registers written.")
      .def_property_readonly("has_dense_step", [](const ExecutionPool& p) { return p.plan().has_dense_step(); })
      .def_property_readonly("notes", [](const ExecutionPool& p) { return p.plan().notes; }, "Theorems used, and the reason of a dense step.")
      .def_property_readonly("passes", &ExecutionPool::last_counts, "Counters of the last run.")
      .def_property_readonly("run_notes", &ExecutionPool::run_notes)
      .def_property_readonly(
          "steps",
          [](const ExecutionPool& p) {
            static const char* tiers[] = {"values", "kernel", "sweep", "elimination", "dense"};
            py::list steps;
            for (const Step& s : p.plan().steps) {
              py::dict d;
              d["text"] = s.text;
              d["tier"] = tiers[s.tier];
              d["flops"] = s.flops;
              d["memory"] = s.bytes;
              steps.append(d);
            }
            return steps;
          },
          "The steps as dictionaries: text, tier, flops, memory.");
}

}  // namespace pycraft
