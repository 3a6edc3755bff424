// Where operators come from: multibody models, trees of matrices, and the states that expressions are bound to.
#include <algorithm>

#include "algebra/trees/aggregated_tree.h"
#include "algebra/trees/matrix_tree.h"
#include "bindings/bindings.h"
#include "operators/alphabet.h"
#include "operators/derived_operators.h"
#include "operators/directions.h"
#include "operators/embedded_operators.h"
#include "operators/grouped_operators.h"
#include "operators/loop_operators.h"
#include "operators/rerooted_tree.h"
#include "runtime/of_state.h"

namespace pycraft {

namespace {

// Whose state an `at` binds: of the symbols that are not bound yet; where there are none, of the spaces of zeros, identities and
// constants. `anything`: whether there is something to bind.
std::vector<std::shared_ptr<SkoSource>> unbound_sources(const std::vector<Expression>& operands, bool& anything) {
  std::vector<std::shared_ptr<SkoSource>> of_symbols, of_spaces;
  const auto add = [](std::vector<std::shared_ptr<SkoSource>>& known, const std::shared_ptr<SkoSource>& s) {
    if (s && std::find(known.begin(), known.end(), s) == known.end()) known.push_back(s);
  };
  for (const Expression& e : operands)
    visit(e, [&](const Expression& x) {
      const Symbol& s = x.node().symbol;
      if (s.binding || !(x.children().empty() || s.source)) return;
      anything = true;
      if (s.source) return add(of_symbols, s.source);
      if (!x.floating())
        for (const Space& space : {x.domain(), x.codomain()}) add(of_spaces, source_owning(space));
    });
  return of_symbols.empty() ? of_spaces : of_symbols;
}

}  // namespace

// A symbol as it was pickled, its arguments as `arguments_as_data` has them.
Expression symbol_again(const std::shared_ptr<SkoSource>& source, const std::string& name, const py::tuple& arguments, const std::string& text) {
  if (py::len(arguments) > 0 && arguments[0].cast<std::string>() == "nodes") {
    std::vector<std::string> nodes;
    for (size_t i = 1; i < py::len(arguments); ++i) nodes.push_back(arguments[i].cast<std::string>());
    return source_symbol(source, name, nodes, -1);
  }
  source->check_current();
  if (const auto loops = std::dynamic_pointer_cast<LoopOperators>(source)) return loops->letter(name, arguments_from_data(arguments), text);
  return make_symbol(definition_named(name), source, arguments_from_data(arguments), text);
}

Expression source_symbol(const std::shared_ptr<SkoSource>& source, const std::string& name, const std::vector<std::string>& nodes, int coordinate) {
  if (const auto loops = std::dynamic_pointer_cast<LoopOperators>(source)) {
    source->check_current();
    return loops->letter(name);
  }
  const SymbolDefinition& d = definition_named(name);
  source->check_current();
  if (d.kind() == LetterKind::sko) return make_symbol(d, source);
  if (d.kind() == LetterKind::groups) {
    if (!std::dynamic_pointer_cast<GroupedOperators>(source)) throw EvaluationError("'" + name + "' is a letter of grouped bodies; '" + source->name() + "' has none");
    return make_symbol(d, source);
  }
  const auto embedded = std::dynamic_pointer_cast<EmbeddedOperators>(source);
  if (d.kind() == LetterKind::embedding) {
    if (!embedded) throw EvaluationError("'" + name + "' is a letter of embedded loops; '" + source->name() + "' has none");
    if (d.takes == Takes::nothing) return make_symbol(d, source);
    if (d.takes == Takes::direction) throw EvaluationError("'" + name + "' comes up in derivatives alone: X_r.diff(i, j)");
    if (coordinate < 0 || coordinate >= source->theta().dimension())
      throw ModelError("coordinate " + std::to_string(coordinate) + " of '" + source->name() + "', which has " + std::to_string(source->theta().dimension()));
    return make_symbol(d, source, OfCoordinate{coordinate}, source->structure().coordinate_names[coordinate]);
  }
  if (embedded) return embedded_letter(embedded, d, nodes, coordinate);
  if (!std::dynamic_pointer_cast<MultibodyOperators>(source) && !std::dynamic_pointer_cast<GroupedOperators>(source))
    throw EvaluationError("'" + name + "' is an operator of mechanics; '" + source->name() + (mechanics_of(source) ? "' has none" : "' is a bare tree of matrices"));
  switch (d.takes) {
    case Takes::nodes: return node_operator(d.id, source, nodes);
    case Takes::place: return delta_operator(source, coordinate);
    default: return mechanics_operator(d.id, source);
  }
}

std::shared_ptr<const Binding> make_binding(const std::vector<Expression>& operands, const py::object& q_given, const py::object& v_given,
                                            const Arithmetic& arithmetic, const py::object& threads) {
  auto binding = std::make_shared<Binding>();
  binding->arithmetic = arithmetic;
  const int count = thread_count(threads);
  bool anything = false;
  const auto sources = unbound_sources(operands, anything);
  if (!anything) return the_one_like(binding);
  if (sources.empty()) {  // between spaces R^n: only how many states there are counts
    if (!q_given.is_none() && !py::hasattr(q_given, "q")) {
      const Array a = real_array(q_given);
      if (a.ndim() == 2) binding->batch = static_cast<int>(a.shape(0));
    }
    return the_one_like(binding);
  }
  for (const auto& s : sources) s->check_current();
  int nq = 0, nv = 0;
  for (const auto& s : sources)
    if (s->nq() || s->nv()) nq = s->nq(), nv = s->nv();
  if (q_given.is_none()) {
    bool taken = false;
    for (const auto& s : sources) {
      if (!s->nq() && !s->nv()) continue;
      const auto now = s->state();
      const std::vector<double> q = now->q.copy(), v = v_given.is_none() ? now->v.copy() : one_state(v_given, "v");
      if (taken && (binding->q != q || binding->v != v)) throw EvaluationError("operators of two models: bind each with its own .at(q)");
      binding->q = q, binding->v = v, taken = true;
      s->check_state(binding->q.data(), binding->q.size(), binding->v.data(), binding->v.size());
    }
  } else {
    const py::object v = v_given.is_none() && py::hasattr(q_given, "q") && py::hasattr(q_given, "v") ? py::object(q_given.attr("v")) : part_of_state(v_given, "v");
    const Array a = numbers(part_of_state(q_given, "q"), "q");
    if (a.ndim() != 1 && a.ndim() != 2) throw ModelError("a state is an array (nq,), a batch of states (B, nq)");
    const py::ssize_t width = a.shape(a.ndim() - 1);
    binding->batch = a.ndim() == 2 ? static_cast<int>(a.shape(0)) : -1;
    const int states = std::max(binding->batch, a.ndim() == 2 ? 0 : 1);
    binding->q.assign(a.data(), a.data() + a.size());
    binding->v.assign(size_t(states) * nv, 0.0);
    if (!v.is_none()) {
      const Array w = numbers(v, "v");
      if (w.ndim() == 1 && w.shape(0) == nv) {
        for (int b = 0; b < states; ++b) std::copy_n(w.data(), nv, binding->v.begin() + size_t(b) * nv);
      } else if (w.ndim() == 2 && w.shape(0) == binding->batch && w.shape(1) == nv) {
        binding->v.assign(w.data(), w.data() + w.size());
      } else {
        throw ModelError("v has not the shape that goes with q: (" + std::to_string(nv) + ",) or (B, " + std::to_string(nv) + ")");
      }
    }
    for (const auto& s : sources)
      for (int b = 0; b < std::max(states, binding->batch == 0 ? 0 : 1); ++b)
        checking_state(b, states, [&] { s->check_state(binding->q.data() + size_t(b) * width, width, binding->v.data() + size_t(b) * nv, nv); });
    if (binding->batch == 0 && width != nq) throw ModelError("q takes " + std::to_string(nq) + " numbers a state, not " + std::to_string(width));
  }
  binding->nq = nq;
  binding->nv = nv;
  if (binding->batch >= 0) binding->threads = count;  // one state has nothing to share
  return the_one_like(binding);
}

void register_sources(py::module_& m) {
  declared<py::class_<Binding, std::shared_ptr<Binding>>>(m, "Binding")
      .def_readonly("threads", &Binding::threads, "How many share the states of a batch.")
      .def("__reduce__", [](const Binding& b) -> py::tuple {
        return py::make_tuple(py::module_::import("pycraft._core").attr("_binding_from_parts"),
                              py::make_tuple(b.batch, b.nq, b.nv, b.q, b.v, b.arithmetic.precision, b.arithmetic.form, b.arithmetic.refinement.steps,
                                             static_cast<int>(b.arithmetic.refinement.residual), b.threads));
      });
  m.def("_binding_from_parts", [](int batch, int nq, int nv, std::vector<double> q, std::vector<double> v, Precision precision, Form form, int steps, int residual, int threads) {
    auto b = std::make_shared<Binding>();
    b->batch = batch, b->nq = nq, b->nv = nv, b->q = std::move(q), b->v = std::move(v), b->arithmetic = {form, {steps, residual_precisions[residual]}, precision}, b->threads = threads;
    return std::const_pointer_cast<Binding>(the_one_like(b));
  });
  m.def("_binding", [](const Expression& e) {
    const auto all = contexts(e);
    return all.empty() ? std::shared_ptr<Binding>() : std::const_pointer_cast<Binding>(all[0].binding);
  });
  m.def("_bind", [](const std::vector<Expression>& operands, const py::object& q, const py::object& v, Form form, const py::object& refine,
                    const std::string& residual, Precision precision,
                    const py::object& threads) { return make_binding(operands, q, v, {form, refinement(refine, residual, precision), precision}, threads); },
        py::arg("operands"), py::arg("q"), py::arg("v"), py::arg("form") = Form::fast, py::arg("refine") = 0, py::arg("residual") = "same",
        py::arg("precision") = Precision::double_, py::arg("threads") = 1);

  auto any_source = declared<py::class_<SkoSource, std::shared_ptr<SkoSource>>>(m, "SkoSource");
  any_source
      .def("__reduce__", [](const SkoSource& s) -> py::tuple {
        const py::object made = py::module_::import("pycraft._core").attr("_derived_operators");
        if (const auto* grouped = dynamic_cast<const AggregatedTree*>(&s)) {
          grouped->base().check_current();
          return py::make_tuple(made, py::make_tuple(std::const_pointer_cast<SkoSource>(grouped->base().shared_from_this()), "bodies in pairs"));
        }
        if (const auto* grouped = dynamic_cast<const GroupedOperators*>(&s)) {
          grouped->base()->check_current();
          return py::make_tuple(made, py::make_tuple(grouped->base(), py::make_tuple("groups", grouped->groups())));
        }
        if (const auto* embedded = dynamic_cast<const EmbeddedOperators*>(&s)) {  // loops are the model's face's
          embedded->check_current();
          py::list sets;
          for (const EmbeddedLoops& set : embedded->sets()) sets.append(py::make_tuple(set.bodies, set.rows, set.dependent));
          return py::make_tuple(py::module_::import("pycraft._core").attr("_embedded_again"), py::make_tuple(embedded->base()->model(), sets));
        }
        if (const auto* loops = dynamic_cast<const LoopOperators*>(&s)) {  // loops are the model's face's
          loops->check_current();
          return py::make_tuple(py::module_::import("pycraft._core").attr("_loop_operators_again"), py::make_tuple(loops->base()->model()));
        }
        const auto* derived = dynamic_cast<const DerivedOperators*>(&s);
        if (!derived) throw py::type_error("operators of '" + s.name() + "' cannot be pickled or copied; make them anew where they are wanted");
        derived->base()->check_current();
        if (const auto* cut = dynamic_cast<const CutTree*>(derived)) return py::make_tuple(made, py::make_tuple(cut->base(), py::make_tuple("cut", cut->body())));
        if (const auto* turned = dynamic_cast<const RerootedTree*>(derived))
          return py::make_tuple(made, py::make_tuple(turned->base(), py::make_tuple("root", turned->root())));
        const auto* subset = dynamic_cast<const SomeCoordinates*>(derived);
        return py::make_tuple(made, py::make_tuple(derived->base(), subset ? py::cast(subset->kept()) : py::object(py::str("world frame"))));
      })
      .def_property_readonly("name", &SkoSource::name)
      .def_property_readonly("Theta", &SkoSource::theta)
      .def_property_readonly("V", &SkoSource::motions)
      .def_property_readonly("F", &SkoSource::forces)
      .def_property_readonly("parents", [](const SkoSource& s) { return s.structure().parent; })
      .def_property_readonly("sizes", [](const SkoSource& s) { return s.structure().size; })
      .def_property_readonly("dof", [](const SkoSource& s) { return s.structure().dof; })
      .def_property_readonly("body_names", [](const SkoSource& s) { return s.structure().body_names; })
      .def_property_readonly("hinge_names", [](const SkoSource& s) { return s.structure().hinge_names; })
      .def_property_readonly("coordinate_names", [](const SkoSource& s) {  // in the order of a vector's entries
        const auto* grouped = dynamic_cast<const GroupedOperators*>(&s);
        return grouped ? grouped->base()->structure().coordinate_names : s.structure().coordinate_names;
      })
      .def_property_readonly("model", [](const std::shared_ptr<SkoSource>& s) -> py::object {
        const auto* const pairs = dynamic_cast<const AggregatedTree*>(s.get());
        const auto of = mechanics_of(pairs ? std::const_pointer_cast<SkoSource>(pairs->base().shared_from_this()) : s);
        return of ? py::cast(of->model()) : py::object(py::none());
      }, "The multibody model whose operators these are; None for a tree of given matrices.")
      .def_property_readonly("derived_from", [](const SkoSource& s) -> py::object {
        const auto* derived = dynamic_cast<const DerivedOperators*>(&s);
        if (derived == nullptr) return py::none();
        const char* how = dynamic_cast<const WorldFrame*>(&s)         ? "world frame"
                          : dynamic_cast<const GroupedOperators*>(&s) ? "groups of bodies"
                          : dynamic_cast<const EmbeddedOperators*>(&s) ? "embedded loops"
                          : dynamic_cast<const LoopOperators*>(&s)    ? "loops"
                          : dynamic_cast<const CutTree*>(&s)          ? "cut tree"
                          : dynamic_cast<const RerootedTree*>(&s)     ? "another root"
                                                                      : "hinge subset";
        if (const auto* embedded = dynamic_cast<const EmbeddedOperators*>(&s)) return py::make_tuple(how, std::static_pointer_cast<SkoSource>(embedded->grouped()));
        return py::make_tuple(how, derived->base());
      }, "How this tree was made of a model's, \"hinge subset\", \"world frame\", \"cut tree\", \"another root\", \"loops\", \"groups of bodies\" or \"embedded loops\", and that model's source, of embedded loops that of the groups; None for a model's own.")
      .def_property_readonly("groups", [](const SkoSource& s) -> py::object {
        const auto* grouped = dynamic_cast<const GroupedOperators*>(&s);
        return grouped ? py::cast(grouped->groups()) : py::object(py::none());
      }, "Of grouped bodies: the numbers of the model's bodies in each group; None for other trees.")
      .def_property_readonly("traits", [](const SkoSource& s) {
        const Traits t = s.traits();
        py::dict d;
        d["serial chain"] = t.chain, d["single-DOF hinges"] = t.single_dof, d["constant H"] = t.constant_hinges, d["J = 0"] = !t.hinge_diagonal, d["blocks of one size"] = t.equal_blocks;
        return d;
      })
      .def("symbol", &source_symbol, py::arg("name"), py::arg("nodes") = std::vector<std::string>(), py::arg("coordinate") = -1)
      .def("_symbol_again", &symbol_again)
      .def("nodes_space", [](const std::shared_ptr<SkoSource>& s, const std::vector<std::string>& nodes, bool motions) {
        const Expression b = source_symbol(s, "B", nodes, -1);
        return motions ? b.domain().dual() : b.domain();
      })
      .def("check_current", &SkoSource::check_current);
  py::class_<MultibodyOperators, SkoSource, std::shared_ptr<MultibodyOperators>>(m, "MultibodyOperators", "The operators' source of a multibody model.")
      .def("__reduce__", [](const MultibodyOperators& s) -> py::tuple {
        s.check_current();  // else its copy would be of the model as it is now
        return py::make_tuple(py::module_::import("pycraft._core").attr("operators_of"), py::make_tuple(py::cast(s.model())));
      });
  py::class_<GroupedOperators, SkoSource, std::shared_ptr<GroupedOperators>>(m, "GroupedOperators", "The source of a multibody model's operators with its bodies in groups.");
  py::class_<EmbeddedOperators, SkoSource, std::shared_ptr<EmbeddedOperators>>(m, "EmbeddedOperators", "The source of a multibody model's operators with its loops embedded.")
      .def_property_readonly("grouped", [](const EmbeddedOperators& s) { return s.grouped(); }, "The same groups of bodies, nothing embedded.")
      .def_property_readonly("independent", &EmbeddedOperators::independent, "The tree's coordinate of each of Θ.")
      .def_property_readonly("dependent", [](const EmbeddedOperators& s) {
        std::vector<std::vector<int>> all;
        for (const EmbeddedLoops& set : s.sets()) all.push_back(set.dependent);
        return all;
      }, "Of each set of loops that hang together: the tree's coordinates that follow from the others.")
      .def_property_readonly("rows", [](const EmbeddedOperators& s) {
        std::vector<std::vector<int>> all;
        for (const EmbeddedLoops& set : s.sets()) all.push_back(set.rows);
        return all;
      }, "Of each set: the rows of loops that these are solved from.");
  m.def("operators_of", &operators_of, py::arg("model"));
  m.def("unbound_sources", [](const std::vector<Expression>& operands) {
    bool anything = false;
    return unbound_sources(operands, anything);
  }, py::arg("operands"), "The sources whose state `at` would bind.");
  m.def("_grouped", &grouped_operators, py::arg("base"), py::arg("groups"));
  m.def("_some_coordinates", [](const std::shared_ptr<SkoSource>& base, const std::vector<bool>& kept) -> std::shared_ptr<SkoSource> {
    const auto robot = std::dynamic_pointer_cast<MultibodyOperators>(base);
    if (!robot) throw ModelError("coordinates of '" + base->name() + "' are not prescribed: it is no multibody model of its own");
    return std::make_shared<SomeCoordinates>(robot, std::vector<char>(kept.begin(), kept.end()));
  }, py::arg("base"), py::arg("kept"));
  // how: "bodies in pairs", "world frame", ("groups", the bodies of each), ("cut", at the hinge of which body), ("root", which body), or which coordinates move
  m.def("_derived_operators", [](const std::shared_ptr<SkoSource>& base, const py::object& how) -> std::shared_ptr<SkoSource> {
    const std::string kind = py::isinstance<py::str>(how) ? how.cast<std::string>() : "coordinates";
    if (kind == "bodies in pairs") return std::make_shared<AggregatedTree>(base);
    const auto model = std::dynamic_pointer_cast<MultibodyOperators>(base);
    if (!model) throw EvaluationError("'" + base->name() + "' is no multibody model");
    if (kind == "world frame") return std::make_shared<WorldFrame>(model);
    if (py::isinstance<py::tuple>(how) && how.cast<py::tuple>()[0].cast<std::string>() == "root")
      return std::make_shared<RerootedTree>(model, how.cast<py::tuple>()[1].cast<int>());
    if (py::isinstance<py::tuple>(how) && how.cast<py::tuple>()[0].cast<std::string>() == "cut")
      return std::make_shared<CutTree>(model, how.cast<py::tuple>()[1].cast<int>());
    if (py::isinstance<py::tuple>(how))
      return std::make_shared<GroupedOperators>(model, Grouping(model->structure(), model->name(), how.cast<py::tuple>()[1].cast<std::vector<std::vector<int>>>()));
    return std::make_shared<SomeCoordinates>(model, how.cast<std::vector<char>>());
  });
  py::class_<MatrixTree, SkoSource, std::shared_ptr<MatrixTree>>(m, "MatrixTree", "A tree whose blocks E, H, M, J are given as matrices of any size.")
      .def(py::init([](const std::vector<int>& parents, const std::vector<int>& sizes, const std::vector<int>& dof, std::vector<std::vector<double>> E,
                       std::vector<std::vector<double>> H, std::vector<std::vector<double>> M, std::vector<std::vector<double>> J,
                       const std::vector<std::string>& names, const std::string& name) {
             SkoStructure s;
             s.parent = parents, s.size = sizes, s.dof = dof, s.body_names = names;
             for (const std::string& n : names) s.hinge_names.push_back(n);
             s.finish();
             return std::make_shared<MatrixTree>(std::move(s), name, std::move(E), std::move(H), std::move(M), std::move(J));
           }),
           py::arg("parents"), py::arg("sizes"), py::arg("dof"), py::arg("E"), py::arg("H"), py::arg("M"), py::arg("J"), py::arg("names"), py::arg("name"))
      .def("__reduce__", [](const MatrixTree& t) -> py::tuple {
        const SkoStructure& s = t.structure();
        return py::make_tuple(py::module_::import("pycraft._core").attr("MatrixTree"),
                              py::make_tuple(s.parent, s.size, s.dof, t.E, t.H, t.M, t.J, s.body_names, t.name()));
      });

  static const char* const spaces[] = {"Θ", "V", "F", "W", "NodesV", "NodesF", "R^1", "Θ of the tree"};
  static const char* const takes[] = {"nothing", "nodes", "coordinate", "selection", "inertia", "direction"};
  py::class_<SymbolDefinition>(m, "SymbolDefinition", "What is said of a letter without numbers: names, spaces, what it is of.")
      .def_readonly("name", &SymbolDefinition::ascii, "In ASCII: the attribute of an operator set.")
      .def_readonly("text", &SymbolDefinition::unicode, "As it is shown.")
      .def_readonly("latex", &SymbolDefinition::latex)
      .def_property_readonly("domain", [](const SymbolDefinition& d) { return spaces[static_cast<int>(d.domain)]; })
      .def_property_readonly("codomain", [](const SymbolDefinition& d) { return spaces[static_cast<int>(d.codomain)]; })
      .def_readonly("meaning", &SymbolDefinition::meaning)
      .def_property_readonly("takes", [](const SymbolDefinition& d) { return takes[static_cast<int>(d.takes)]; },
                             "What it is called with: \"nothing\", \"nodes\", \"coordinate\"; what derivatives bring up: \"selection\", \"inertia\", \"direction\".")
      .def_property_readonly("is_vector", [](const SymbolDefinition& d) { return d.pattern == Pattern::vector; }, "Whether it is a vector that the model provides.")
      .def_readonly("is_symmetric", &SymbolDefinition::symmetric)
      .def("__repr__", [](const SymbolDefinition& d) { return "<letter " + d.unicode + ": " + d.meaning + ">"; });
  py::list symbols;
  for (const SymbolDefinition* d : alphabet())
    if (d->kind() == LetterKind::sko || d->kind() == LetterKind::mechanics) symbols.append(py::cast(d, py::return_value_policy::reference));
  m.attr("symbols") = py::tuple(symbols);
}

}  // namespace pycraft
