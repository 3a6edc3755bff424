// Expressions as plain parts and back: pickling, copying.
#include <unordered_map>

#include "algebra/planning/square_root.h"
#include "bindings/bindings.h"
#include "operators/alphabet.h"
#include "operators/directions.h"
#include "operators/embedded_operators.h"
#include "operators/grouped_operators.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// Where a symbol's source comes back from in Python: the model's operators.
py::object source_of(const Symbol& s) { return py::cast(s.source); }

py::object binding_of(const Symbol& s) { return s.binding ? py::cast(std::const_pointer_cast<Binding>(s.binding)) : py::none(); }

}  // namespace

std::vector<std::string> Letter::nodes() const {
  std::vector<std::string> names;
  const auto* of = std::get_if<OfNodes>(&symbol.arguments);
  if (!of) return names;
  const auto model = mechanics_of(symbol.source)->model();
  for (int a : of->nodes) names.push_back(a >= 0 ? model->node(a).name : model->body(-1 - a).name);
  return names;
}

namespace {

py::tuple place_as_data(const TwistPlace& place) {
  if (const auto* of = std::get_if<OfCoordinate>(&place)) return py::make_tuple("coordinate", of->coordinate);
  const OfTwist& of = std::get<OfTwist>(place);
  return py::make_tuple("twist", of.body, of.position, of.component);
}
TwistPlace place_from_data(const py::tuple& data) {
  if (data[0].cast<std::string>() == "coordinate") return OfCoordinate{data[1].cast<int>()};
  return OfTwist{data[1].cast<int>(), data[2].cast<int>(), data[3].cast<int>()};
}

}  // namespace

// What a letter is of: the word for it, then its numbers or the names of nodes; () where it is of nothing.
py::tuple arguments_as_data(const Symbol& symbol) {
  const SymbolArguments& given = symbol.arguments;
  py::list data;
  if (std::holds_alternative<OfNodes>(given)) {
    data.append("nodes");
    for (const std::string& name : Letter{symbol}.nodes()) data.append(name);
  } else if (std::holds_alternative<OfCoordinate>(given) || std::holds_alternative<OfTwist>(given)) {
    return place_as_data(place_in(given));
  } else if (const auto* of = std::get_if<OfSubhinges>(&given)) {
    return py::make_tuple("subhinges", of->body, of->from, of->to);
  } else if (const auto* of = std::get_if<OfInertia>(&given)) {
    data.append("inertia"), data.append(of->body);
    for (const InertiaParameter p : of->parameters) data.append(static_cast<int>(p));
  } else if (const auto* of = std::get_if<OfDirection>(&given)) {
    data.append("direction"), data.append(of->time);
    for (const auto& [amount, place] : of->twists) data.append(py::make_tuple(amount, place_as_data(place)));
  }
  return py::tuple(data);
}

// The same again; nodes are found by name (node_operator).
SymbolArguments arguments_from_data(const py::tuple& data) {
  if (py::len(data) == 0) return {};
  const auto word = data[0].cast<std::string>();
  const auto number = [&](size_t i) { return data[i].cast<int>(); };
  if (word == "coordinate" || word == "twist") return as_arguments(place_from_data(data));
  if (word == "subhinges") return OfSubhinges{number(1), number(2), number(3)};
  if (word == "inertia") {
    OfInertia of{number(1), {}};
    for (size_t i = 2; i < py::len(data); ++i) of.parameters.push_back(static_cast<InertiaParameter>(number(i)));
    return of;
  }
  if (word != "direction") throw EvaluationError("a letter is of nodes, a coordinate, a twist, subhinges, inertia or a direction, not of '" + word + "'");
  OfDirection of{data[1].cast<bool>(), {}};
  for (size_t i = 2; i < py::len(data); ++i) {
    const auto twist = data[i].cast<py::tuple>();
    of.twists.emplace_back(twist[0].cast<double>(), place_from_data(twist[1].cast<py::tuple>()));
  }
  return of;
}

// A space as its model and kind, so that it can be pickled and found again.
py::tuple space_parts(const Space& s) {
  if (s.kind() == SpaceKind::Euclidean) return py::make_tuple(py::none(), static_cast<int>(s.kind()), s.dimension(), py::list());
  auto source = source_owning(s);
  if (s.layout().bodies != s.layout().owner && !std::dynamic_pointer_cast<EmbeddedOperators>(source)) {  // coordinates and nodes of grouped bodies are the robot's, cut into groups
    auto cut = std::make_shared<SpaceLayout>(s.layout());
    cut->owner = s.layout().bodies;
    if (const auto grouped = std::dynamic_pointer_cast<GroupedOperators>(source_owning(Space(s.kind(), cut)))) source = grouped;
  }
  if (!source) throw StaleOperatorError("the model of " + s.description() + " is gone; a space is pickled and copied with its model");
  py::list names;
  for (const auto& b : s.layout().blocks)
    if (!s.layout().nodes.empty()) names.append(b.label);
  return py::make_tuple(py::cast(source), static_cast<int>(s.kind()), s.dimension(), names);
}

Space space_from_parts(const py::tuple& t) {
  const SpaceKind kind = static_cast<SpaceKind>(t[1].cast<int>());
  if (kind == SpaceKind::Euclidean) return Space::euclidean(t[2].cast<int>());
  const auto source = t[0].cast<std::shared_ptr<SkoSource>>();
  const auto names = t[3].cast<std::vector<std::string>>();
  if (!names.empty()) {
    const Space forces = source_symbol(source, "B", names, -1).domain();
    return kind == SpaceKind::NodesF ? forces : forces.dual();
  }
  if (kind == SpaceKind::Whitened) return Space(kind, source->forces().layout_pointer());
  return source->space(kind, {});
}

// (kind, payload, the binding of a leaf that is no symbol)
static py::tuple parts_of_node(const Expression& e) {
  const auto& n = e.node();
  py::object payload = py::none();
  switch (n.kind) {
    case NodeKind::symbol: {
      payload = py::make_tuple(source_of(n.symbol), n.symbol.definition->ascii, arguments_as_data(n.symbol), n.symbol.argument_text, binding_of(n.symbol));
      break;
    }
    case NodeKind::block_function:
      payload = n.symbol.source ? py::object(py::make_tuple(source_of(n.symbol), n.symbol.definition->ascii, binding_of(n.symbol))) : py::object(py::none());
      break;
    case NodeKind::vector: payload = py::make_tuple(n.name, space_parts(n.codomain)); break;
    case NodeKind::identity: payload = e.floating() ? py::object(py::none()) : py::object(space_parts(n.domain)); break;
    case NodeKind::zero: payload = py::make_tuple(space_parts(n.domain), space_parts(n.codomain)); break;
    case NodeKind::scaled: payload = py::cast(n.coefficient); break;
    case NodeKind::constant:
      payload = py::make_tuple(n.constant->dense, n.constant->blocks, space_parts(n.domain), space_parts(n.codomain), n.constant->name);
      break;
    case NodeKind::external: throw py::type_error("an operator from outside ('" + n.external->name + "') cannot be pickled");
    default: break;
  }
  return py::make_tuple(static_cast<int>(n.kind), payload, n.symbol.source ? py::object(py::none()) : binding_of(n.symbol));
}

py::tuple parts(const Expression& e) {
  const py::tuple own = parts_of_node(e);
  return py::make_tuple(own[0], own[1], py::cast(e.children()), own[2]);
}

py::list all_parts(const Expression& e) {
  py::list all;
  std::unordered_map<const Expression::Node*, py::ssize_t> number;
  each_from_below(e, [&](const Expression& x) {
    const py::tuple own = parts_of_node(x);
    py::list children;
    for (const Expression& c : x.children()) children.append(number.at(c.get()));
    number.emplace(x.get(), static_cast<py::ssize_t>(number.size()));
    all.append(py::make_tuple(own[0], own[1], children, own[2]));
  });
  return all;
}

void register_pickling(py::module_& m) {
  py::class_<Letter>(m, "Letter", "What stands behind a symbol of an expression: which letter, whose, of which nodes or coordinate, and at which state.")
      .def_property_readonly("name", [](const Letter& l) { return l.symbol.definition->ascii; }, "Its ASCII name.")
      .def_property_readonly("source", [](const Letter& l) { return l.symbol.source; }, "The operators that it is one of.")
      .def_property_readonly("arguments", [](const Letter& l) {
        return arguments_as_data(l.symbol);
      }, "What it is of: () for most letters, (\"nodes\", names...), (\"coordinate\", number); of what derivatives bring up (\"twist\", body, subhinge, component), "
         "(\"subhinges\", body, from, to), (\"inertia\", body, parameters...).")
      .def_property_readonly("text", [](const Letter& l) { return l.symbol.argument_text; }, "Its arguments as they are shown.")
      .def_property_readonly("binding", [](const Letter& l) { return binding_of(l.symbol); }, "The state that it is bound to; None where it is not.");
  m.def("_make", [](const std::string& kind, const std::vector<Expression>& children, const Coefficient& coefficient) {
    if (kind == "sum") return sum_of(children);
    if (kind == "product") return product_of(children);
    if (kind == "scaled") return coefficient * children[0];
    if (kind == "transpose") return children[0].T();
    if (kind == "inverse") return children[0].inv();
    if (kind == "blockdiag") return block_diagonal(children[0]);
    if (kind == "function") return lower_half(children[0]);
    return square_root(children[0]);
  });
  m.def("_function", [](const std::shared_ptr<SkoSource>& source, const std::string& name, const std::shared_ptr<Binding>& binding, const Expression& operand) {
    const SymbolDefinition& d = definition_named(name);
    if (d.pattern != Pattern::function) throw EvaluationError("'" + name + "' is no function");
    return block_function(d, source, binding, operand);
  });
  m.def("_leaf_from_parts", [](const std::string& kind, const py::object& payload) {
    if (kind == "identity") return payload.is_none() ? identity() : identity(space_from_parts(payload.cast<py::tuple>()));
    const py::tuple t = payload.cast<py::tuple>();
    if (kind == "vector") return make_vector(t[0].cast<std::string>(), space_from_parts(t[1].cast<py::tuple>()));
    if (kind == "zero") return zero(space_from_parts(t[0].cast<py::tuple>()), space_from_parts(t[1].cast<py::tuple>()));
    const Space domain = space_from_parts(t[2].cast<py::tuple>()), codomain = space_from_parts(t[3].cast<py::tuple>());
    auto dense = t[0].cast<std::vector<double>>();
    auto blocks = t[1].cast<std::vector<std::vector<double>>>();
    const auto name = t[4].cast<std::string>();
    return blocks.empty() ? constant(std::move(dense), domain, codomain, name) : constant_blocks(std::move(blocks), domain, codomain, name);
  });
}

}  // namespace pycraft
