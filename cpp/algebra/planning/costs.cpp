// What steps cost, in floating-point operations per column: what the block policy of each body says, and two operations an entry of H, G, D, P, R, Υ.
#include "algebra/planning/costs.h"

#include <algorithm>

#include "algebra/planning/planner.h"
#include "algebra/planning/realization.h"

namespace pycraft {

namespace {

template <class F>
double over_bodies(const SkoStructure& t, F f) {
  double sum = 0;
  for (int k = 0; k < t.bodies(); ++k) sum += f(k);
  return sum;
}

}  // namespace

double symbol_flops(const Symbol& symbol) {
  const SkoSource& s = *symbol.source;
  const SkoStructure& t = s.structure();
  switch (symbol.definition->id) {
    case SymbolId::E: return over_bodies(t, [&](int k) { return s.costs(k).shift; });
    case SymbolId::H:
    case SymbolId::G: return over_bodies(t, [&](int k) { return 2.0 * t.size[k] * t.dof[k]; });
    case SymbolId::J:
    case SymbolId::D: return over_bodies(t, [&](int k) { return 2.0 * t.dof[k] * t.dof[k]; });
    case SymbolId::M: return over_bodies(t, [&](int k) { return s.costs(k).inertia; });
    default: return over_bodies(t, [&](int k) { return 2.0 * t.size[k] * t.size[k]; });
  }
}

double resolvent_flops(const Symbol& symbol) {
  const SkoSource& s = *symbol.source;
  const SkoStructure& t = s.structure();
  const bool hinges = symbol.definition->id == SymbolId::psi;
  return over_bodies(t, [&](int k) { return s.costs(k).shift + (hinges ? 4.0 * t.size[k] * t.dof[k] : 0.0); });
}

double group_flops(const SkoSource& s, unsigned group) {
  if (group == Group::inverse) return group_flops(s, Group::kinematics) + group_flops(s, Group::articulated);  // at most: what it is in any numbers
  const SkoStructure& t = s.structure();
  return over_bodies(t, [&](int k) {
    const double a = t.size[k], n = t.dof[k];
    const BlockCosts c = s.costs(k);
    switch (group) {
      case Group::kinematics: return c.kinematics + c.kinematics_of_coordinate * n;
      case Group::articulated: return c.congruence + 2 * a * a * n + a * a * n + n * n * n / 3;
      case Group::composite: return c.congruence;
      case Group::compliance: return c.congruence + 4 * a * a * n;
      default: return 120.0;
    }
  });
}

double group_bytes(const SkoSource& s, unsigned group) {
  if (group == Group::inverse) return group_bytes(s, Group::kinematics) + group_bytes(s, Group::articulated);
  const SkoStructure& t = s.structure();
  return 8 * over_bodies(t, [&](int k) {
    const double a = t.size[k], n = t.dof[k];
    const BlockCosts c = s.costs(k);
    switch (group) {
      case Group::kinematics: return c.kinematic_numbers + n * a + n;
      case Group::articulated: return 2 * c.square_numbers + n * a + 2 * n * n;
      case Group::composite:
      case Group::compliance: return c.square_numbers;
      default: return 24.0;
    }
  });
}

double mass_matrix_flops(const SkoSource& s, bool inverse) {
  const SkoStructure& t = s.structure();
  return over_bodies(t, [&](int k) {
    const double a = t.size[k], n = t.dof[k];
    const BlockCosts c = s.costs(k);
    return inverse ? 2 * c.shift + 8 * a * n + 2 * n * n : 2 * c.shift + 4 * a * n + c.inertia;
  });
}

double mass_matrix_dense_flops(const SkoSource& s) {
  const SkoStructure& t = s.structure();
  std::vector<double> depth(t.bodies());
  double sum = 0;
  for (int k = 0; k < t.bodies(); ++k) {
    depth[k] = t.parent[k] < 0 ? 1 : depth[t.parent[k]] + 1;
    sum += depth[k] * t.dof[k] * (s.costs(k).shift + 2.0 * t.size[k] * t.dof[k]);
  }
  return sum;
}

// ------------------------------------------------------------------ realizations

std::vector<int> Realization::body_states() const {
  std::vector<int> sizes(tree->structure().bodies(), 0);
  for (const Space& s : states)
    if (s.belongs_to_bodies())
      for (size_t k = 0; k < sizes.size(); ++k) sizes[k] += s.body_size(static_cast<int>(k));
  return sizes;
}

namespace {

// Columns that a body shares with its parent: the states that travel along the edges.
double interface_size(const Realization& r) {
  std::vector<char> up(r.equations.size(), 0), down(r.states.size(), 0);
  for (const auto& t : r.terms) {
    if (t.shift == Shift::up) up[t.row] = 1;
    if (t.shift == Shift::down) down[t.column] = 1;
  }
  const double six = 6;
  return six * (std::count(up.begin(), up.end(), 1) + std::count(down.begin(), down.end(), 1)) / 2.0;
}

}  // namespace

double Realization::factor_flops() const {
  double sum = 0;
  const double c = interface_size(*this);
  for (int n : body_states()) sum += 2.0 * n * n * n / 3 + 2.0 * n * n * c + 2.0 * c * c * n;
  return sum;
}
double Realization::solve_flops() const {
  double sum = 0;
  const double c = interface_size(*this);
  for (int n : body_states()) sum += 2 * (2.0 * n * n + 4.0 * n * c);  // twice: one refinement
  return sum;
}
double Realization::entries() const {
  double sum = 0;
  const double c = interface_size(*this);
  for (int n : body_states()) sum += 2 * (double(n) * n + 2 * n * c);
  return sum;
}

}  // namespace pycraft
