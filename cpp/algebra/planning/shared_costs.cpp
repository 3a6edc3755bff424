#include "algebra/planning/shared_costs.h"

#include <algorithm>

#include "algebra/language/lower.h"
#include "algebra/language/source.h"
#include "algebra/planning/costs.h"

namespace pycraft {

namespace {

// Steps that are kept; with more than these it begins anew.
constexpr size_t most_kept = 50000;

}  // namespace

void SharedCosts::begin() {
  planner_ = Planner(PlanOptions{false});
  planner_.for_costs_ = true;
  planner_.one_cut_ = one_cut_;
  planner_.more_digits_ = model_.binding && model_.binding->arithmetic.precision > Precision::double_;
  planner_.most_ = most_kept + most_steps;
  planner_.plan_.request = Request::apply;
  inputs_.clear(), step_of_.clear(), counted_.clear(), groups_.clear();
  count_ = 0, seen_steps_ = 0;
}

int SharedCosts::input(const Space& space) {
  const auto known = std::find_if(inputs_.begin(), inputs_.end(), [&](const auto& i) { return i.first == space; });
  if (known != inputs_.end()) return known->second;
  inputs_.emplace_back(space, planner_.new_register(RegisterKind::vector, space, {}, true));
  return inputs_.back().second;
}

double SharedCosts::flops(const Expression& e) {
  if (planner_.plan_.steps.size() > most_kept) begin();
  const int y = planner_.apply(e, input(e.domain()));
  return flops_of_values(groups_of(e)) + flops_of_steps({y});
}

double SharedCosts::flops(const Polynomial& form, const Alphabet& alphabet, const Space& domain, const Space& codomain) {
  if (planner_.plan_.steps.size() > most_kept) begin();
  std::vector<int> ids(alphabet.codes().size(), -1), ends;
  unsigned groups = 0;
  for (const auto& [word, c] : form) {
    int x = input(domain);
    for (auto l = word.rbegin(); l != word.rend(); ++l) {
      const Expression& letter = alphabet.atom(*l);
      if (ids[*l] < 0) {
        ids[*l] = planner_.id_of(letter);
        groups |= groups_of(letter);
      }
      const auto known = planner_.vector_memo_.find({ids[*l], x});
      x = known != planner_.vector_memo_.end() ? known->second : planner_.apply(letter, x);
    }
    ends.push_back(x);
  }
  // As a plan has it: a word alone is scaled, or is all there is.
  double last = 2.0 * codomain.dimension() * double(form.size());
  if (form.size() == 1) last = form.begin()->second == 1 ? 0.0 : codomain.dimension();
  return flops_of_values(groups) + flops_of_steps(std::move(ends)) + last;
}

// Of the steps that make these registers, each once.
double SharedCosts::flops_of_steps(std::vector<int> registers) {
  const std::vector<Step>& steps = planner_.plan_.steps;
  step_of_.resize(planner_.plan_.registers.size(), -1);
  counted_.resize(steps.size(), 0);
  for (; seen_steps_ < steps.size(); ++seen_steps_) step_of_[steps[seen_steps_].out] = static_cast<int>(seen_steps_);
  ++count_;
  double sum = 0;
  while (!registers.empty()) {
    const int i = step_of_[registers.back()];
    registers.pop_back();
    if (i < 0 || counted_[i] == count_) continue;
    counted_[i] = count_;
    sum += steps[i].flops;
    each_register_read(steps[i], [&](int r) { registers.push_back(r); });
  }
  return sum;
}

double SharedCosts::flops_of_values(unsigned groups) const {
  double sum = 0;
  for (const unsigned group : {Group::kinematics, Group::articulated, Group::composite, Group::compliance, Group::velocities})
    if (groups & group) sum += group_flops(*model_.source, group);
  return sum;
}

// The values that the letters of e hang on.
unsigned SharedCosts::groups_of(const Expression& e) {
  planner_.id_of(e);  // which keeps it
  return groups_of_node(e);
}

unsigned SharedCosts::groups_of_node(const Expression& e) {
  const auto known = groups_.find(e.get());
  if (known != groups_.end()) return known->second;
  unsigned groups = 0;
  for (const Expression& c : e.children()) groups |= groups_of_node(c);
  const Symbol& symbol = e.node().symbol;
  if (e.kind() == NodeKind::block_function && symbol.source) groups |= Group::kinematics;
  if (e.kind() == NodeKind::symbol) {
    const SymbolDefinition& d = *symbol.definition;
    if (d.pattern != Pattern::compound || d.tangent_of_inverse) groups |= d.groups;
    if (d.pattern == Pattern::compound) {
      auto of_compound = groups_of_compounds_.find(&d);
      if (of_compound == groups_of_compounds_.end()) of_compound = groups_of_compounds_.emplace(&d, groups_of(lower(d.expand(symbol), true))).first;
      groups |= of_compound->second;
    }
  }
  return groups_[e.get()] = groups;
}

}  // namespace pycraft
