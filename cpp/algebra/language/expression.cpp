#include "algebra/language/expression.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "algebra/language/display.h"
#include "algebra/language/memo.h"
#include "algebra/language/mixed_hash.h"
#include "algebra/language/nodes.h"
#include "algebra/language/properties.h"
#include "algebra/language/source.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

using Node = Expression::Node;

std::string owner_note(const Space& a, const Space& b) {
  const std::string x = a.layout().owner_name, y = b.layout().owner_name;
  if (a.layout().owner == b.layout().owner || x.empty() || y.empty()) return "";
  return x == y ? " They belong to two different models, both named '" + x + "'."
                : " They belong to two different models, '" + x + "' and '" + y + "'.";
}

}  // namespace

// ------------------------------------------------------------------ leaves

Expression make_symbol(const SymbolDefinition& definition, std::shared_ptr<SkoSource> source, SymbolArguments arguments, std::string argument_text) {
  if (!fits(definition.takes, arguments)) throw EvaluationError("'" + definition.ascii + "' is not of what it was given");
  Node n{NodeKind::symbol, source->space(definition.domain, arguments), source->space(definition.codomain, arguments), {}};
  n.symbol = Symbol{&definition, std::move(source), nullptr, std::move(arguments), std::move(argument_text)};
  return make_node(std::move(n));
}

Expression make_symbol(SymbolId id, std::shared_ptr<SkoSource> source, std::shared_ptr<const Binding> binding) {
  const SymbolDefinition& d = sko_symbol(id);
  Node n{NodeKind::symbol, source->space(d.domain, {}), source->space(d.codomain, {}), {}};
  n.symbol = Symbol{&d, std::move(source), std::move(binding), {}, {}};
  return make_node(std::move(n));
}

Expression make_vector(const std::string& name, const Space& space) {
  Node n{NodeKind::vector, Space::euclidean(1), space, {}};
  n.name = name;
  return make_node(std::move(n));
}

Expression identity() {
  return make_node(Node{NodeKind::identity, Space(), Space(), {}});
}

Expression identity(const Space& space) {
  return make_node(Node{NodeKind::identity, space, space, {}});
}

Expression zero(const Space& domain, const Space& codomain) {
  return make_node(Node{NodeKind::zero, domain, codomain, {}});
}

Expression constant(std::vector<double> dense, const Space& domain, const Space& codomain, const std::string& name) {
  const int rows = codomain.dimension(), columns = domain.dimension();
  if (static_cast<int>(dense.size()) != rows * columns)
    throw SpaceError("constant '" + name + "' has " + std::to_string(dense.size()) + " entries; from " + domain.description() + " to " +
                     codomain.description() + " it takes " + std::to_string(rows) + " x " + std::to_string(columns));
  auto data = std::make_shared<ConstantData>();
  data->name = name;
  data->symmetric = domain == codomain.dual();
  for (int i = 0; i < rows && data->symmetric; ++i)
    for (int j = 0; j < i && data->symmetric; ++j) data->symmetric = dense[i * columns + j] == dense[j * columns + i];
  if (cut_alike(domain, codomain)) {  // block diagonal over the bodies: every entry outside its body's block is zero
    std::vector<int> row_body(rows), column_body(columns);
    for (const auto& b : codomain.layout().blocks) std::fill_n(row_body.begin() + b.offset, b.size, b.body);
    for (const auto& b : domain.layout().blocks) std::fill_n(column_body.begin() + b.offset, b.size, b.body);
    bool diagonal = true;
    for (int i = 0; i < rows && diagonal; ++i)
      for (int j = 0; j < columns && diagonal; ++j) diagonal = row_body[i] == column_body[j] || dense[i * columns + j] == 0;
    if (diagonal) {
      const int bodies = static_cast<int>(domain.layout().of_body.size());
      for (int k = 0; k < bodies; ++k) {
        std::vector<double> block;
        for (int bi : codomain.layout().of_body[k])
          for (int i = 0; i < codomain.layout().blocks[bi].size; ++i)
            for (int bj : domain.layout().of_body[k])
              for (int j = 0; j < domain.layout().blocks[bj].size; ++j)
                block.push_back(dense[(codomain.layout().blocks[bi].offset + i) * columns + domain.layout().blocks[bj].offset + j]);
        data->blocks.push_back(std::move(block));
      }
      dense.clear();
    }
  }
  data->dense = std::move(dense);
  Node n{NodeKind::constant, domain, codomain, {}};
  n.constant = std::move(data);
  return make_node(std::move(n));
}

Expression constant_blocks(std::vector<std::vector<double>> blocks, const Space& domain, const Space& codomain, const std::string& name) {
  const size_t bodies = domain.layout().of_body.size();
  if (!cut_alike(domain, codomain) || blocks.size() != bodies)
    throw SpaceError("constant '" + name + "': " + std::to_string(blocks.size()) + " blocks do not fit " + domain.description() + " to " +
                     codomain.description() + "; give one block per body");
  auto data = std::make_shared<ConstantData>();
  data->name = name;
  data->symmetric = domain == codomain.dual();
  for (size_t k = 0; k < bodies; ++k) {
    const size_t r = codomain.body_size(k), c = domain.body_size(k);
    if (blocks[k].size() != r * c)
      throw SpaceError("constant '" + name + "': block " + std::to_string(k) + " has " + std::to_string(blocks[k].size()) + " entries, not " +
                       std::to_string(r) + " x " + std::to_string(c));
    for (size_t i = 0; i < r && data->symmetric; ++i)
      for (size_t j = 0; j < i && data->symmetric; ++j) data->symmetric = blocks[k][i * c + j] == blocks[k][j * c + i];
  }
  data->blocks = std::move(blocks);
  Node n{NodeKind::constant, domain, codomain, {}};
  n.constant = std::move(data);
  return make_node(std::move(n));
}

Expression external(std::shared_ptr<const ExternalData> data, const Space& domain, const Space& codomain) {
  Node n{NodeKind::external, domain, codomain, {}};
  n.external = std::move(data);
  return make_node(std::move(n));
}

// ------------------------------------------------------------------ arithmetic

Expression with_space(const Expression& e, const Space& space) {
  if (!e.floating()) return e;
  // Every floating node in the space, and in its dual for what is below a transpose.
  std::unordered_map<const Node*, std::pair<Expression, Expression>> made;
  const Space dual = space.dual();
  each_from_below(e, [&](const Expression& x) {
    const auto in = [&](bool dual_space) {
      if (!x.floating()) return x;
      Node n = x.node();
      n.domain = n.codomain = dual_space ? dual : space;
      for (Expression& c : n.children) c = (dual_space != (n.kind == NodeKind::transpose)) ? made.at(c.get()).second : made.at(c.get()).first;
      return make_node(std::move(n));
    };
    made.emplace(x.get(), std::make_pair(in(false), in(true)));
  });
  return made.at(e.get()).first;
}

// Sums and products are kept flat; a doubling repeated is soon larger than any memory.
constexpr size_t most_parts = 1000000;
[[noreturn]] static void throw_too_many_parts(const char* what, double parts) {
  throw EvaluationError(std::string(what) + " of " + std::to_string(static_cast<long long>(parts)) + " parts: an expression is written out flat, up to " +
                        std::to_string(most_parts) + "; evaluate a part of it, and go on with it as a constant");
}

Expression sum_of(std::vector<Expression> terms) {
  const Expression* spaced = nullptr;
  for (const Expression& t : terms)
    if (!t.floating()) {
      spaced = &t;
      break;
    }
  std::vector<Expression> flat;
  for (const Expression& t : terms) {
    Expression term = t;
    if (spaced) {
      if (term.floating()) {
        if (!(spaced->domain() == spaced->codomain()))
          throw SpaceError("I cannot be added to " + label(*spaced) + ", which maps " + spaced->domain().description() + " to " +
                           spaced->codomain().description() + ": an identity maps a space to itself");
        term = with_space(term, spaced->domain());
      }
      if (!(term.domain() == spaced->domain()) || !(term.codomain() == spaced->codomain())) {
        term.check_current();
        spaced->check_current();
        throw SpaceError(label(*spaced) + " maps " + spaced->domain().description() + " to " + spaced->codomain().description() + "; " + label(term) +
                         " maps " + term.domain().description() + " to " + term.codomain().description() + ": they cannot be added." +
                         owner_note(spaced->domain(), term.domain()));
      }
    }
    if (term.kind() == NodeKind::sum)
      flat.insert(flat.end(), term.children().begin(), term.children().end());
    else
      flat.push_back(term);
  }
  if (flat.size() == 1) return flat[0];
  if (flat.size() > most_parts) throw_too_many_parts("a sum", double(flat.size()));
  return make_node(Node{NodeKind::sum, flat[0].domain(), flat[0].codomain(), std::move(flat)});
}

Expression product_of(std::vector<Expression> factors) {
  // An identity without a space takes it from its neighbour, from the right first.
  for (size_t i = factors.size(); i-- > 0;)
    if (factors[i].floating() && i + 1 < factors.size() && !factors[i + 1].floating()) factors[i] = with_space(factors[i], factors[i + 1].codomain());
  for (size_t i = 1; i < factors.size(); ++i)
    if (factors[i].floating() && !factors[i - 1].floating()) factors[i] = with_space(factors[i], factors[i - 1].domain());
  std::vector<Expression> flat;
  for (size_t i = 0; i < factors.size(); ++i) {
    const Expression& f = factors[i];
    if (i && !f.floating() && !(factors[i - 1].domain() == f.codomain())) {
      const Expression& before = factors[i - 1];
      before.check_current();
      f.check_current();
      throw SpaceError(label(before) + " maps " + before.domain().description() + " to " + before.codomain().description() + "; it cannot follow " +
                       label(f) + ", which ends in " + f.codomain().description() + "." + owner_note(before.domain(), f.codomain()));
    }
    if (f.kind() == NodeKind::product)
      flat.insert(flat.end(), f.children().begin(), f.children().end());
    else
      flat.push_back(f);
  }
  if (flat.size() == 1) return flat[0];
  if (flat.size() > most_parts) throw_too_many_parts("a product", double(flat.size()));
  const Space domain = flat.back().domain(), codomain = flat.front().codomain();
  return make_node(Node{NodeKind::product, domain, codomain, std::move(flat)});
}

Expression operator+(const Expression& a, const Expression& b) { return sum_of({a, b}); }
Expression operator-(const Expression& a) { return -1.0 * a; }
Expression operator-(const Expression& a, const Expression& b) { return sum_of({a, -b}); }
Expression operator*(const Expression& a, const Expression& b) { return product_of({a, b}); }

Expression operator*(const Coefficient& c, const Expression& a) {
  Node n{NodeKind::scaled, a.domain(), a.codomain(), {a}};
  n.coefficient = c;
  return make_node(std::move(n));
}

Expression Expression::T() const {
  if (floating()) return make_node(Node{NodeKind::transpose, Space(), Space(), {*this}});
  return make_node(Node{NodeKind::transpose, codomain().dual(), domain().dual(), {*this}});
}

Expression Expression::inv() const {
  if (!floating() && domain().dimension() != codomain().dimension())
    throw SpaceError(label(*this) + " maps " + domain().description() + " to " + codomain().description() + ": it is not square and has no inverse");
  return make_node(Node{NodeKind::inverse, codomain(), domain(), {*this}}, node().memo()->of_inverse());
}

Expression block_diagonal(const Expression& a) {
  if (a.floating()) return a;
  if (!cut_alike(a.domain(), a.codomain()))
    throw SpaceError("blockdiag(" + label(a) + "): " + a.domain().description() + " and " + a.codomain().description() + " are not cut into the same bodies");
  return make_node(Node{NodeKind::block_diagonal, a.domain(), a.codomain(), {a}});
}

Expression square_root_of(const Expression& a) {
  if (a.kind() == NodeKind::identity) return a;
  const Space domain = a.domain().dual() == a.domain() ? a.domain() : Space(SpaceKind::Whitened, a.domain().layout_pointer());
  return make_node(Node{NodeKind::square_root, domain, a.codomain(), {a}});
}

Expression block_function(const SymbolDefinition& function, std::shared_ptr<SkoSource> source, std::shared_ptr<const Binding> binding, const Expression& operand) {
  Node n{NodeKind::block_function, source->space(function.domain, {}), source->space(function.codomain, {}), {operand}};
  n.symbol = Symbol{&function, std::move(source), std::move(binding), {}, {}};
  return make_node(std::move(n));
}

Expression lower_half(const Expression& a) {
  static const SymbolDefinition definition{SymbolId::lower_half_of, "lower_half", "lower½", "\\operatorname{lower}_{1/2}", "lower triangle with half its diagonal",
                                           SpaceKind::Theta, SpaceKind::Theta, Pattern::function};
  Node n{NodeKind::block_function, a.domain(), a.codomain(), {a}};
  n.symbol.definition = &definition;
  return make_node(std::move(n));
}

Expression power(const Expression& a, int exponent) {
  constexpr int largest_exponent = 1000;
  if (exponent > largest_exponent || exponent < -largest_exponent)
    throw EvaluationError("a power of " + label(a) + " is a product of as many factors: exponents go to " + std::to_string(largest_exponent) +
                          "; evaluate one, and go on with it as a constant");
  if (!a.floating() && !(a.domain() == a.codomain()) && exponent != 1 && exponent != -1)
    throw SpaceError(label(a) + " maps " + a.domain().description() + " to " + a.codomain().description() + ": only a map of a space to itself has powers");
  if (exponent == 0) return a.floating() ? identity() : identity(a.domain());
  const Expression factor = exponent < 0 ? a.inv() : a;
  return product_of(std::vector<Expression>(std::abs(exponent), factor));
}

// ------------------------------------------------------------------ walks

namespace {

// Nodes met, in a table with open addressing: a walk looks up every part of every node, and does little else.
class Met {
 public:
  // Whether it was not there.
  bool add(const Node* node) {
    if (2 * count_ >= places_.size()) grow();
    const Node*& place = place_of(node);
    if (place == node) return false;
    place = node;
    return ++count_;
  }

 private:
  const Node*& place_of(const Node* node) {
    size_t at = mix(0, reinterpret_cast<size_t>(node)) >> 16;
    while (places_[at & (places_.size() - 1)] && places_[at & (places_.size() - 1)] != node) ++at;
    return places_[at & (places_.size() - 1)];
  }
  void grow() {
    std::vector<const Node*> before(2 * places_.size());
    before.swap(places_);
    for (const Node* node : before)
      if (node) place_of(node) = node;
  }
  std::vector<const Node*> places_ = std::vector<const Node*>(64);  // a power of two, half of them empty
  size_t count_ = 0;
};

}  // namespace

void visit(const Expression& e, const std::function<void(const Expression&)>& f) {
  if (e.children().empty()) return f(e);
  // Derivatives share most of their parts: each is visited once.
  Met seen;
  std::vector<const Expression*> todo = {&e};
  while (!todo.empty()) {
    const Expression& x = *todo.back();
    todo.pop_back();
    if (!x.children().empty() && !seen.add(x.get())) continue;
    f(x);
    for (auto c = x.children().rbegin(); c != x.children().rend(); ++c) todo.push_back(&*c);
  }
}

Expression Expression::at(std::shared_ptr<const Binding> binding) const {
  std::unordered_map<const Node*, Expression> moved;
  bool bound_before = false;
  each_from_below(*this, [&](const Expression& e) {
    const bool binds = e.children().empty() || e.kind() == NodeKind::block_function;  // leaves without numbers, too: a batch is a batch
    bound_before |= binds && e.node().symbol.binding;
    bool changed = binds && !e.node().symbol.binding;
    for (const Expression& c : e.children()) changed |= moved.at(c.get()).get() != c.get();
    if (!changed) {
      moved.emplace(e.get(), e);
      return;
    }
    Node n = e.node();
    if (binds && !n.symbol.binding) n.symbol.binding = binding;
    for (Expression& c : n.children) c = moved.at(c.get());
    const bool whole = e.get() == get() && !bound_before;
    moved.emplace(e.get(), make_node(std::move(n), whole ? std::make_shared<Memo>(node().memo()) : nullptr));
  });
  return moved.at(get());
}

std::vector<Context> contexts(const Expression& e) {
  std::vector<Context> found;
  visit(e, [&](const Expression& x) {
    const Context c{x.node().symbol.source, x.node().symbol.binding};
    if (c.source && std::find(found.begin(), found.end(), c) == found.end()) found.push_back(c);
  });
  return found;
}

namespace {

// Of the symbols where one is bound; else of the leaves whose numbers hang on no state.
std::shared_ptr<const Binding> batch_binding(const Expression& e) {
  std::shared_ptr<const Binding> of_symbols, of_leaves;
  bool symbols_bound = false;
  visit(e, [&](const Expression& x) {
    const auto& b = x.node().symbol.binding;
    if (!b) return;
    const bool symbol = x.node().symbol.source != nullptr;
    symbols_bound |= symbol;
    if (b->batch < 0) return;
    auto& found = symbol ? of_symbols : of_leaves;
    if (symbol && found && found->batch != b->batch)
      throw EvaluationError("batches of " + std::to_string(found->batch) + " and " + std::to_string(b->batch) + " states in one expression");
    if (!found) found = b;
  });
  return symbols_bound ? of_symbols : of_leaves;
}

}  // namespace

int batch_of(const Expression& e) {
  const auto binding = batch_binding(e);
  return binding ? binding->batch : -1;
}

Expression with_batch_of(const Expression& typed, const Expression& made) {
  const auto binding = batch_binding(typed);
  if (!binding || batch_of(made) >= 0) return made;
  const Expression bound = zero(made.domain(), made.codomain()).at(binding);
  return made.kind() == NodeKind::zero ? bound : made + bound;
}

void Expression::check_current() const {
  visit(*this, [](const Expression& x) {
    if (x.kind() == NodeKind::symbol) x.node().symbol.source->check_current();
  });
}

}  // namespace pycraft
