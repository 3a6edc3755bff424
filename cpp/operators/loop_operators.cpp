#include "operators/loop_operators.h"

#include <algorithm>
#include <set>
#include <string>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "model/checks.h"
#include "operators/alphabet.h"
#include "operators/loop_values.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// NodesF: the rows by body. A letter of one's own source, with numbers of its own.
const std::vector<SymbolDefinition>& records() {
  using S = SpaceKind;
  using namespace loop_letters;
  constexpr auto diagonal = Pattern::block_diagonal;
  static const std::vector<SymbolDefinition> table = {
      {Q, "Q", "Q", "Q", "rows of loops by velocities, body by body", S::Theta, S::NodesF, diagonal},
      {dQ, "dQ", "∂Q", "\\partial Q", "derivative of Q along coordinates, twists in hinges or time", S::Theta, S::NodesF, diagonal, {.takes = Takes::direction}},
      {A, "A", "A", "A", "rows of loops by motions of their ends, body by body", S::NodesV, S::NodesF, diagonal},
      {dA, "dA", "∂A", "\\partial A", "derivative of A along coordinates, twists in hinges or time", S::NodesV, S::NodesF, diagonal, {.takes = Takes::direction}},
      {ddQ, "ddQ", "∂²Q", "\\partial^2 Q", "second derivative of Q, along one after the other", S::Theta, S::NodesF, diagonal, {.takes = Takes::direction}},
      {ddA, "ddA", "∂²A", "\\partial^2 A", "second derivative of A, along one after the other", S::NodesV, S::NodesF, diagonal, {.takes = Takes::direction}},
  };
  return table;
}

}  // namespace

int LoopOperators::place_of(const std::string& frame) {
  if (frame.empty()) return -1;
  const Multibody& model = *base_->model();
  const int index = model.node_index(frame), nodes = static_cast<int>(model.nodes().size());
  if (model.node(index).body < 0) return -1;
  const int node = index < nodes ? index : -1 - (index - nodes);
  const auto known = std::find(ends_.begin(), ends_.end(), node);
  if (known != ends_.end()) return static_cast<int>(known - ends_.begin());
  ends_.push_back(node), end_names_.push_back(frame);
  return static_cast<int>(ends_.size()) - 1;
}

LoopOperators::LoopOperators(std::shared_ptr<MultibodyOperators> base, std::shared_ptr<LoopSet> loops)
    : DerivedOperators(base->structure(), base->name() + ", loops", base), loops_(std::move(loops)), rows_(structure().bodies()) {
  share_bodies_with(*base_);
  share_coordinates_with(*base_);
  const auto resolved = loops_->resolved();
  auto layout = std::make_shared<SpaceLayout>();
  std::vector<std::vector<std::pair<int, const ResolvedLoop*>>> at(structure().bodies());
  for (const ResolvedLoop& loop : resolved->loops) {
    declared_.push_back(loop.loop);
    std::set<int> bodies;
    for (const auto* side : {&loop.path.up, &loop.path.down})
      for (const FrameStep& step : *side)
        if (step.kind == FrameStep::Kind::hinge) bodies.insert(step.number);
    for (int i : loop.v) bodies.insert(static_cast<int>(std::upper_bound(structure().dof_offset.begin(), structure().dof_offset.end(), i) - structure().dof_offset.begin()) - 1);
    if (!loop.loop->is_coupling()) {
      const Ends ends{place_of(loop.loop->pair.a), place_of(loop.loop->pair.b)};
      ends_of_[loop.loop->name] = ends;
      for (int place : {ends.a, ends.b})
        if (place >= 0) bodies.insert(ends_[place] >= 0 ? model().node(ends_[place]).body : -1 - ends_[place]);
    }
    for (int k : bodies) at[k].emplace_back(loop.first_row, &loop);
  }
  layout->owner = this, layout->owner_name = name();
  layout->bodies = motions().layout().bodies;
  layout->of_body.resize(structure().bodies());
  for (int k = 0; k < structure().bodies(); ++k)
    for (const auto& [first, loop] : at[k]) {
      if (!loop->rows) continue;
      layout->of_body[k].push_back(static_cast<int>(layout->blocks.size()));
      layout->blocks.push_back({k, layout->dimension, loop->rows, loop->loop->name});
      layout->dimension += loop->rows;
      for (int i = 0; i < loop->rows; ++i) rows_[k].push_back(first + i);
    }
  row_layout_ = layout;
  const int rows = resolved->rows, parts = static_cast<int>(layout->dimension);
  std::vector<double> ones(size_t(rows) * parts, 0.0);
  int part = 0;
  for (const std::vector<int>& own : rows_)
    for (int row : own) ones[size_t(row) * parts + part++] = 1;
  sums_ = constant(std::move(ones), Space(SpaceKind::NodesF, row_layout_), Space::euclidean(rows), "Σ");
}

Space LoopOperators::space(SpaceKind kind, const SymbolArguments& arguments) const {
  if (kind == SpaceKind::NodesF) return Space(kind, row_layout_);
  if (kind == SpaceKind::NodesV) return base_->space(kind, OfNodes{ends_});
  return SkoSource::space(kind, arguments);
}

void LoopOperators::check_current() const {
  base_->check_current();
  const auto now = loops_->resolved();
  const bool same = std::equal(now->loops.begin(), now->loops.end(), declared_.begin(), declared_.end(), [](const ResolvedLoop& a, const auto& b) { return a.loop == b; });
  if (!same) throw StaleOperatorError("these operators were made before the loops of '" + base_->name() + "' changed; take them anew, soa.Q, soa.A");
}

Expression LoopOperators::letter(const std::string& ascii, const SymbolArguments& arguments, const std::string& text) const {
  for (const SymbolDefinition& d : records())
    if (d.ascii == ascii) return make_symbol(d, std::const_pointer_cast<SkoSource>(shared_from_this()), arguments, text);
  throw EvaluationError("'" + ascii + "' is no letter of loops: there are Q and A");
}

Expression LoopOperators::whole(const std::string& ascii) const {
  if (row_layout_->dimension == 0 || (ascii == "A" && ends_.empty())) return zero(ascii == "Q" ? base_->theta() : Space::euclidean(0), sums_.codomain());
  return sums_ * letter(ascii);
}

std::optional<Expression> LoopOperators::by_ends() const {
  if (row_layout_->dimension == 0 || ends_.empty() || std::any_of(declared_.begin(), declared_.end(), [](const auto& loop) { return loop->is_coupling(); })) return std::nullopt;
  std::string names;
  for (const std::string& name : end_names_) names += (names.empty() ? "" : ", ") + name;
  const std::shared_ptr<SkoSource> tree = base_;
  const Expression B = make_symbol(definition_of(SymbolId::B), tree, OfNodes{ends_}, names);
  return whole("A") * B.T() * make_symbol(definition_of(SymbolId::phi), tree).T() * make_symbol(definition_of(SymbolId::H), tree).T();
}

Expression LoopOperators::tangent(const Expression& e, const std::optional<OfDirection>& along, const std::function<Expression()>& accelerations) const {
  if (!along) return zero(e.domain(), e.codomain());
  const Symbol& s = e.node().symbol;
  const SymbolId id = s.definition->id;
  const bool of_Q = s.definition->domain == SpaceKind::Theta;
  const auto made = [&](const char* ascii, const OfDirection& of, const std::string& text) {
    const Expression whole = letter(ascii, of, text);
    return s.binding ? whole.at(s.binding) : whole;
  };
  const auto once = [&](const OfDirection& of) { return made(of_Q ? "dQ" : "dA", of, of.time ? "time" : text_of(of.twists)); };
  if (id == loop_letters::Q || id == loop_letters::A) return once(*along);
  if (id != loop_letters::dQ && id != loop_letters::dA)
    throw EvaluationError("rows of loops are differentiated twice: '" + s.definition->ascii + "' has no derivative; differences of it at nearby states have");
  // ∂∂ is linear in either direction.
  const auto each = [](const OfDirection& of) { return of.time ? Twists{{1.0, along_time}} : of.twists; };
  const OfDirection& first = std::get<OfDirection>(s.arguments);
  std::vector<Expression> terms = {zero(e.domain(), e.codomain())};
  for (const auto& one : each(first))
    for (const auto& other : each(*along))
      terms.push_back(one.first * other.first * made(of_Q ? "ddQ" : "ddA", {false, {{1.0, one.second}, {1.0, other.second}}}, text_of({{1.0, one.second}}) + ", " + text_of({{1.0, other.second}})));
  if (first.time && along->time) {
    const OfDirection change = along_numbers(accelerations());
    if (!change.twists.empty()) terms.push_back(once(change));
  }
  return lowered_sum(terms, e.domain(), e.codomain());
}

// Accelerations that are numbers, as a direction.
OfDirection LoopOperators::along_numbers(const Expression& vdot) const {
  if (vdot.kind() == NodeKind::zero) return {};
  if (vdot.kind() != NodeKind::constant)
    throw EvaluationError("the second time derivative of rows of loops takes accelerations that are numbers: .dot(vdot=array), not " + show(vdot));
  const std::vector<double>& given = vdot.node().constant->dense;
  OfDirection along;
  for (size_t i = 0; i < given.size(); ++i)
    if (given[i] != 0) along.twists.emplace_back(given[i], OfCoordinate{static_cast<int>(i)});
  return along;
}

std::string LoopOperators::text_of(const Twists& twists) const {
  static const char* components[] = {"rx", "ry", "rz", "x", "y", "z"};
  std::string text;
  for (const auto& [c, place] : twists) {
    if (!text.empty()) text += " + ";
    if (c != 1) text += short_number(c) + " ";
    if (const auto* of = std::get_if<OfCoordinate>(&place)) text += of->coordinate < 0 ? "time" : structure().coordinate_names[of->coordinate];
    if (const auto* of = std::get_if<OfTwist>(&place)) text += structure().hinge_names[of->body] + "@" + std::to_string(of->position) + "." + components[of->component];
  }
  return text;
}

#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> LoopOperators::make_values(S) const { return std::make_unique<LoopValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

}  // namespace pycraft
