#include "algebra/theorems/rules.h"

#include <unordered_map>

#include "algebra/language/lower.h"
#include "algebra/language/values.h"
#include "algebra/theorems/theorems.h"
#include "runtime/errors.h"
#include "runtime/without_interrupts.h"

namespace pycraft {

namespace {

// Two bodies and nothing else: the theorems are stated on its letters once, to be compiled.
class Prototype final : public SkoSource {
 public:
  Prototype() : SkoSource(skeleton(), "prototype") {}
  Traits traits() const override { return {true, true, true, true, true, true}; }
  BlockCosts costs(int) const override { return {}; }
  int nq() const override { return 0; }
  int nv() const override { return 0; }
  void check_state(const double*, size_t, const double*, size_t) const override {}
  std::shared_ptr<const StateData> state() const override { return std::make_shared<StateData>(); }
  std::uint64_t parameters() const override { return 0; }
#define PYCRAFT_NO_VALUES(S) std::unique_ptr<SkoValues<S>> make_values(S) const override { return nullptr; }
  PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_NO_VALUES)
#undef PYCRAFT_NO_VALUES

 private:
  static SkoStructure skeleton() {
    SkoStructure s;
    s.parent = {-1, 0};
    s.size = {2, 2};
    s.dof = {1, 1};
    s.finish();
    return s;
  }
};

const std::shared_ptr<SkoSource>& prototype() {
  static const std::shared_ptr<SkoSource> source = std::make_shared<Prototype>();
  return source;
}

// A letter's code; only symbols and their transposes and inverses occur in rules.
int code_of(const Expression& atom) {
  bool transposed = false, inverted = false;
  const Expression* e = &atom;
  while (e->kind() != NodeKind::symbol) {
    (e->kind() == NodeKind::transpose ? transposed : inverted) ^= true;
    e = &e->children()[0];
  }
  return letter_code(e->node().symbol.definition->id, transposed, inverted);
}

std::vector<int> word_of(const Expression& e) {
  if (e.kind() == NodeKind::identity) return {};
  if (e.kind() == NodeKind::product) {
    std::vector<int> codes;
    for (const Expression& f : e.children()) codes.push_back(code_of(f));
    return codes;
  }
  return {code_of(e)};
}

Rule compile(const Expression& lhs, const Expression& rhs, const std::string& name) {
  Rule rule{word_of(lower(lhs, false)), {}, name};
  const Expression right = lower(rhs, false);
  const std::vector<Expression> terms = right.kind() == NodeKind::sum ? right.children() : std::vector<Expression>{right};
  for (const Expression& t : terms) {
    const Scaled s = split_scalar(t);
    rule.to.emplace_back(s.coefficient, word_of(s.expression));
  }
  return rule;
}

// A normal form whose letters are all of one model, by codes; with_J false: as on a model without hinge-diagonal term.
using Pattern_ = std::map<std::vector<int>, Coefficient>;
std::optional<Pattern_> codes_of(const Polynomial& p, const Alphabet& alphabet) {
  Pattern_ pattern;
  for (const auto& [word, c] : p) {
    std::vector<int> codes;
    for (int l : word) {
      if (alphabet.code(l) < 0) return std::nullopt;
      codes.push_back(alphabet.code(l));
    }
    pattern[codes] += c;
  }
  return pattern;
}

// f with a = f b.
std::optional<Coefficient> ratio(const Pattern_& a, const Pattern_& b) {
  if (a.size() != b.size() || a.empty()) return std::nullopt;
  const Coefficient f = a.begin()->second / b.begin()->second;
  for (auto i = a.begin(), j = b.begin(); i != a.end(); ++i, ++j)
    if (i->first != j->first || i->second != f * j->second) return std::nullopt;
  return f;
}

struct InversePattern {
  Pattern_ with_J, without_J;
  Expression inverse;    // in the letters of the prototype
  std::string theorem;
};

// An expression of the prototype's letters, in those of a model.
Expression in_letters_of(const Expression& e, const Context& model) {
  const auto& parts = e.children();
  switch (e.kind()) {
    case NodeKind::symbol: {
      const Expression letter = make_symbol(*e.node().symbol.definition, model.source);
      return model.binding ? letter.at(model.binding) : letter;
    }
    case NodeKind::identity: return identity();
    case NodeKind::transpose: return in_letters_of(parts[0], model).T();
    case NodeKind::inverse: return in_letters_of(parts[0], model).inv();
    case NodeKind::scaled: return e.node().coefficient * in_letters_of(parts[0], model);
    default: {
      Expression whole = in_letters_of(parts[0], model);
      for (size_t i = 1; i < parts.size(); ++i)
        whole = e.kind() == NodeKind::sum ? whole + in_letters_of(parts[i], model) : whole * in_letters_of(parts[i], model);
      return whole;
    }
  }
}

const std::vector<InversePattern>& inverse_patterns() {
  static const std::vector<InversePattern> patterns = [] {
    const WithoutInterrupts meanwhile;
    std::vector<InversePattern> list;
    const std::vector<Theorem> theorems = sko_theorems(prototype());
    const int j_code = letter_code(SymbolId::J, false, false);
    for (size_t i = 0; i < theorems.size(); ++i) {
      if (theorems[i].use != Use::inverse) continue;
      for (const bool rhs : {false, true})
        for (const bool t : {false, true}) {
          const Expression side = rhs ? std::get<Expression>(theorems[i].rhs) : std::get<Expression>(theorems[i].lhs).children()[0];
          Alphabet alphabet;
          const auto form = normal_form(t ? side.T() : side, alphabet);
          const Expression other = rhs ? std::get<Expression>(theorems[i].lhs).children()[0] : std::get<Expression>(theorems[i].rhs);
          InversePattern p{*codes_of(*form, alphabet), {}, t ? other.T() : other, theorems[i].name};
          for (const auto& [codes, c] : p.with_J)
            if (std::find(codes.begin(), codes.end(), j_code) == codes.end()) p.without_J[codes] = c;
          list.push_back(std::move(p));
        }
    }
    return list;
  }();
  return patterns;
}

}  // namespace

const std::vector<Rule>& rewrite_rules() {
  static const std::vector<Rule> rules = [] {
    const WithoutInterrupts meanwhile;
    std::vector<Rule> list;
    for (const Theorem& t : sko_theorems(prototype())) {
      if (t.use != Use::rewrite) continue;
      const Expression lhs = std::get<Expression>(t.lhs), rhs = std::get<Expression>(t.rhs);
      const Rule rule = compile(lhs, rhs, t.name), transposed = compile(lhs.T(), rhs.T(), t.name);
      list.push_back(rule);
      if (transposed.from == rule.from || t.one_way) continue;
      list.push_back(transposed);
    }
    return list;
  }();
  return rules;
}

const std::vector<const Rule*>& rewrite_rules_from(int letter_code) {
  static const std::unordered_map<int, std::vector<const Rule*>> by_first = [] {
    std::unordered_map<int, std::vector<const Rule*>> rules;
    for (const Rule& rule : rewrite_rules()) rules[rule.from.front()].push_back(&rule);
    return rules;
  }();
  static const std::vector<const Rule*> none;
  const auto found = by_first.find(letter_code);
  return found == by_first.end() ? none : found->second;
}

std::optional<Inverted> invert_by_theorem(const Expression& e) {
  if (!e.domain().belongs_to_bodies()) return std::nullopt;
  const auto models = contexts(e);
  if (models.size() != 1) return std::nullopt;
  Alphabet alphabet;
  const auto form = normal_form(e, alphabet);
  if (!form) return std::nullopt;
  const auto pattern = codes_of(*form, alphabet);
  if (!pattern) return std::nullopt;
  const bool with_J = models[0].source->traits().hinge_diagonal;
  for (const InversePattern& p : inverse_patterns()) {
    const auto f = ratio(*pattern, with_J ? p.with_J : p.without_J);
    if (!f) continue;
    Expression inverse = in_letters_of(p.inverse, models[0]);
    // Without rotor inertia the inverse of [I-HψK]*D⁻¹[I-HψK] is shown, and swept, as HφMφ*H*.
    if (!(inverse.domain() == e.codomain()) || !(inverse.codomain() == e.domain())) continue;
    inverse = lower(inverse, false);
    if (!with_J && inverse.kind() == NodeKind::sum && inverse.children().size() == 2 && inverse.children()[1].is(SymbolId::J)) inverse = inverse.children()[0];
    if (*f != 1) inverse = lower((1 / *f) * inverse, false);
    return Inverted{inverse, p.theorem};
  }
  return std::nullopt;
}

}  // namespace pycraft
