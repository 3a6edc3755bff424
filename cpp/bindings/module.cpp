// The Python module: a table of contents.
#include "algebra/language/scalar_expression.h"
#include "algebra/planning/explain.h"
#include "bindings/bindings.h"
#include "bindings/plain_products.h"
#include "bindings/register_interbody_forces.h"
#include "bindings/register_loops.h"
#include "model/multibody.h"

namespace pycraft {

void declare_types(py::module_& m) {
  py::class_<Space>(m, "Space",
                    "A space that operators map between: Θ generalized coordinates, V and F stacked body motions and forces (dual), NodesV and\n"
                    "NodesF those of nodes (dual), R^n a user's own. Spaces compare by kind, model and blocks, never by size alone.");
  py::class_<Multibody, std::shared_ptr<Multibody>>(m, "Multibody", "A multibody model in the core; pycraft.Multibody is its Python face.");
  py::class_<SkoSource, std::shared_ptr<SkoSource>>(m, "SkoSource", "Where the blocks of operators come from: a model, or a bare tree of matrices.");
  py::class_<Binding, std::shared_ptr<Binding>>(m, "Binding", "A state, or a batch of them, that an expression is bound to.");
  py::class_<Expression>(m, "Operator",
                         "An operator expression: what was typed, as data. It holds no numbers and computes nothing until it is applied to an array\n"
                         "(`op @ x`) or asked for one (`dense()`, `diagonal()`, `trace()`, ...). Then rules, planner and engine evaluate it by sweeps\n"
                         "over the tree.");
  py::class_<Scalar>(m, "Scalar",
                     "A scalar made of operators (trace, ln|det|, norm and their sums): an expression, evaluated by float() or numpy.asarray.");
  py::class_<ExecutionPool, std::shared_ptr<ExecutionPool>>(
      m, "Plan", "A plan: what an expression becomes before any number is touched. `str(plan)` is the table that explain() shows.");
}

}  // namespace pycraft

PYBIND11_MODULE(_core, m) {
  m.doc() = "The compiled core of pycraft: operators, planner, engine and model. Use it through the package pycraft.";
  m.attr("_face") = pybind11::dict();  // see of_face
  pycraft::register_interrupts(m);
  pycraft::register_errors(m);
  pycraft::declare_types(m);
  pycraft::register_spaces(m);
  pycraft::register_multibody(m);
  pycraft::register_structure(m);
  pycraft::register_sources(m);
  pycraft::register_operators(m);
  pycraft::register_constants(m);
  pycraft::register_pickling(m);
  pycraft::register_scalars(m);
  pycraft::register_calculus(m);
  pycraft::register_plans(m);
  pycraft::register_dynamics(m);
  pycraft::register_hybrid_dynamics(m);
  pycraft::register_direct_calls(m);
  pycraft::register_compiled(m);
  pycraft::register_sensitivities(m);
  pycraft::register_frames(m);
  pycraft::register_centroidal(m);
  pycraft::register_methods(m);
  pycraft::register_integration(m);
  pycraft::register_effects(m);
  pycraft::register_loops(m);
  pycraft::register_scenes(m);
  pycraft::register_runs(m);
  pycraft::register_linearization(m);
  pycraft::register_interbody_forces(m);
  pycraft::register_theorems(m);
  pycraft::register_bench(m);
  pycraft::take_plain_products(m.attr("Operator"));  // last: what is defined on a type sets its slots anew
}
