#include "algebra/planning/plan.h"

#include <cstdint>

#include "algebra/engine/packs.h"
#include "algebra/engine/written_plan.h"
#include "algebra/language/values.h"
#include "algebra/planning/explain.h"
#include "algebra/planning/realization.h"
#include "bindings/bindings.h"
#include "bindings/tapes.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class T>
std::uintptr_t identity_of(const std::shared_ptr<T>& p) {
  return reinterpret_cast<std::uintptr_t>(p.get());
}

py::object space_or_none(const Space& s) { return s ? py::cast(s) : py::object(py::none()); }

py::object constant_as_data(const std::shared_ptr<const ConstantData>& c) {
  if (!c) return py::none();
  py::dict d;
  d["id"] = identity_of(c);
  d["name"] = c->name;
  d["dense"] = to_numpy(c->dense);
  py::list blocks;
  for (const std::vector<double>& b : c->blocks) blocks.append(to_numpy(b));
  d["blocks"] = blocks;
  return d;
}

py::object symbol_as_data(const Symbol& s) {
  if (!s.definition) return py::none();
  py::dict d;
  d["name"] = s.definition->ascii;
  d["arguments"] = arguments_as_data(s);
  d["argument_text"] = s.argument_text;
  return d;
}

py::list terms_as_data(const std::vector<Realization::Term>& terms) {
  static const char* shifts[] = {"none", "up", "down"};
  py::list all;
  for (const Realization::Term& t : terms) {
    py::dict d;
    d["row"] = t.row, d["column"] = t.column, d["coefficient"] = t.coefficient, d["right"] = t.right, d["left"] = t.left;
    d["shift"] = shifts[static_cast<int>(t.shift)];
    d["context"] = t.context;
    all.append(d);
  }
  return all;
}

py::object realization_as_data(const std::shared_ptr<const Realization>& r) {
  if (!r) return py::none();
  py::dict d;
  d["id"] = identity_of(r);
  d["states"] = r->states;
  d["equations"] = r->equations;
  d["terms"] = terms_as_data(r->terms);
  d["inputs"] = terms_as_data(r->inputs);
  d["outputs"] = terms_as_data(r->outputs);
  py::list border;
  for (const Realization::Border& b : r->border_terms) {
    py::dict t;
    t["row"] = b.row, t["column"] = b.column, t["coefficient"] = b.coefficient, t["constant"] = constant_as_data(b.constant), t["transposed"] = b.transposed;
    border.append(t);
  }
  d["border"] = border;
  d["domain"] = r->domain;
  d["codomain"] = r->codomain;
  d["parents"] = r->tree->structure().parent;
  return d;
}

// A plan as lists and dictionaries: what it does, in which order, on which registers. No number but the user's constants.
py::dict plan_as_data(const Plan& p) {
  static const char* requests[] = {"apply", "dense", "blockdiag", "diagonal", "trace", "logdet", "norm"};
  static const char* kinds[] = {"vector", "blocks", "factor", "dense", "scalar"};
  py::dict d;
  d["request"] = requests[static_cast<int>(p.request)];
  d["text"] = p.text;
  d["domain"] = space_or_none(p.domain);
  d["codomain"] = space_or_none(p.codomain);
  d["notes"] = p.notes;
  d["precision"] = p.precision;
  d["batch"] = p.batched ? p.batch : -1;
  d["columns_of_identity"] = p.columns_of_identity;
  d["input"] = p.input;
  d["output"] = p.output;
  d["vectors"] = p.vectors;
  d["flops"] = p.flops();
  py::list contexts, registers, steps;
  for (size_t c = 0; c < p.contexts.size(); ++c) {
    py::dict t;
    t["source"] = p.contexts[c].source;
    t["binding"] = identity_of(p.contexts[c].binding);
    t["hinge_diagonal"] = static_cast<bool>(p.hinge_diagonal[c]);
    contexts.append(t);
  }
  for (const Register& r : p.registers) {
    py::dict t;
    t["kind"] = kinds[static_cast<int>(r.kind)];
    t["space"] = space_or_none(r.space);
    t["columns"] = space_or_none(r.columns);
    t["wide"] = r.wide;
    t["shared"] = r.shared;
    registers.append(t);
  }
  for (const Step& s : p.steps) {
    py::dict t;
    t["kind"] = step_kind_name(s.kind);
    t["out"] = s.out, t["in"] = s.in, t["context"] = s.context, t["symbol"] = symbol_as_data(s.symbol);
    t["transposed"] = s.transposed, t["inverted"] = s.inverted, t["flag"] = s.flag, t["groups"] = s.groups;
    t["coefficients"] = s.coefficients;
    t["constant"] = constant_as_data(s.constant);
    t["external"] = s.external ? py::cast(s.external->name) : py::object(py::none());
    t["realization"] = realization_as_data(s.realization);
    t["operand"] = s.operand ? py::object(plan_as_data(*s.operand)) : py::object(py::none());
    t["text"] = s.text;
    steps.append(t);
  }
  d["contexts"] = contexts, d["registers"] = registers, d["steps"] = steps;
  return d;
}

ValuesInUse<double> values_at(const Context& c, unsigned groups, int state) {
  if (!c.binding) return c.source->current_values<double>(groups);
  if (c.binding->batch < 0) return c.binding->values<double>(c.source, groups);
  if (state < 0 || state >= c.binding->batch)
    throw EvaluationError("state " + std::to_string(state) + " of a batch of " + std::to_string(c.binding->batch));
  std::shared_ptr<SkoValues<double>> values = c.source->make_values(double());
  values->use(c.binding->arithmetic.form);
  values->move_to(c.binding->q.data() + size_t(state) * c.binding->nq, c.binding->v.data() + size_t(state) * c.binding->nv);
  values->require(groups);
  return ValuesInUse<double>(std::move(values));
}

// The numbers of a symbol at a context's state: a vector, or one block per body (None where an edge symbol has none).
py::object numbers_of(const Plan& p, size_t context, const std::string& name, const py::tuple& data, int state) {
  const Context& c = p.contexts.at(context);
  c.source->check_current();
  const Expression letter = symbol_again(c.source, name, data, "");
  const Symbol& symbol = letter.node().symbol;
  const SymbolDefinition& d = *symbol.definition;
  const auto values = values_at(c, d.groups, state);
  const Space& rows = letter.codomain();
  if (d.pattern == Pattern::vector) {
    std::vector<double> v(rows.dimension());
    values->vector(symbol, v.data());
    return to_numpy(v);
  }
  if (d.pattern != Pattern::block_diagonal && d.pattern != Pattern::edges) throw EvaluationError(name + " has no blocks");
  const Space& columns = letter.domain();
  py::list blocks;
  for (int k = 0; k < c.source->structure().bodies(); ++k) {
    const int p = d.pattern == Pattern::edges ? c.source->structure().parent[k] : k;
    if (p < 0) {
      blocks.append(py::none());
      continue;
    }
    py::array_t<double> b({rows.body_size(p), columns.body_size(k)});
    if (b.size()) values->block(symbol, k, b.mutable_data());
    blocks.append(b);
  }
  return blocks;
}

py::tuple plain_plan(const WrittenPlan& made) {
  static const char* reads[] = {"q", "v", "x", "vector"};
  py::list arrays;
  for (const WrittenPlan::Array& a : made.arrays) arrays.append(py::make_tuple(reads[static_cast<int>(a.what)], a.name, a.width));
  return py::make_tuple(plain_tape(made.tape), arrays, made.rows, made.columns);
}

}  // namespace

void register_plans(py::module_& m) {
  m.def("epsilons", [] {
    py::dict d;
    for (const Precision p : precisions)
      at_precision(p, [&]<class S>(S) { d[py::cast(p)] = to_double(epsilon<S>()); });
    return d;
  }, "Epsilon of each precision by name.");
#if defined(PYCRAFT_FLOAT128)
  m.attr("float128") = true;  // quad is the compiler's own type
#else
  m.attr("float128") = false;
#endif
  m.def("precisions", [] { return std::vector<Precision>(std::begin(precisions), std::end(precisions)); }, "The precisions, from narrow to wide.");
  m.def("forms", [] { return std::vector<Form>(std::begin(forms), std::end(forms)); }, "The forms of the articulated-inertia sweep.");
  m.def("wider", [](Precision precision) { return precision == Precision::digits100 ? py::object(py::none()) : py::cast(precisions[static_cast<int>(precision) + 1]); },
        py::arg("precision"), "The next wider precision, None for the widest.");
  m.def("record_from", &Packs::record_from, py::arg("states"),
        "From how many states on a batch is recorded, whatever that takes; 0: as is best. Returns how it was before.");
  m.def("step_kinds", [] {
    std::vector<std::string> names;
    for (int i = 0; i < step_kinds; ++i) names.push_back(step_kind_name(static_cast<StepKind>(i)));
    return names;
  }, "The kinds of steps that plans are made of.");
  py::class_<PassCounts> counts(m, "PassCounts", "What the last run of a plan executed.");
  unpicklable(counts)
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
  m.def("scalar_tape", [](const Scalar& s, size_t most) { return plain_plan(written(s, most)); }, py::arg("scalar"), py::arg("most"), "As Plan.tape, of a scalar.");
  auto plan = declared<py::class_<ExecutionPool, std::shared_ptr<ExecutionPool>>>(m, "Plan");
  unpicklable(plan)
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
      .def("tape", [](const std::shared_ptr<ExecutionPool>& p, size_t most) { return plain_plan(written({p, &p->plan()}, most)); }, py::arg("most"),
           "What the plan does, operation by operation, at states that are decided as the one that it is bound to, a batch of one (tapes.h); the arrays\n"
           "that it reads, each (\"q\", \"v\", \"x\" or \"vector\", name, width), by number; rows and columns of the result.")
      .def_property_readonly("program", [](const ExecutionPool& p) { return plan_as_data(p.plan()); },
                             "The plan as plain data: contexts, registers and steps in dictionaries; pycraft.recursions writes them out.")
      .def("numbers", [](const ExecutionPool& p, size_t context, const std::string& name, const py::tuple& arguments, int state) {
        return numbers_of(p.plan(), context, name, arguments, state);
      }, py::arg("context"), py::arg("name"), py::arg("arguments") = py::tuple(), py::arg("state") = 0,
           "A symbol's numbers at a context's state: a vector, or one block per body; `state` picks one of a batch.")
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
