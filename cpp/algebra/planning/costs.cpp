// What steps cost, in floating-point operations per column. Rigid blocks: a rotation of a vector 15, φ 45, a rigid inertia 45, an
// articulated one 66; any-size blocks: two operations an entry.
#include "algebra/planning/costs.h"
#include "algebra/planning/planner.h"

namespace pycraft {

namespace {

template <class F>
double over_bodies(const SkoStructure& t, F f) {
  double sum = 0;
  for (int k = 0; k < t.bodies(); ++k) sum += f(k);
  return sum;
}

double edge_flops(const SkoSource& s, int k) {
  const SkoStructure& t = s.structure();
  if (t.parent[k] < 0) return 0;
  return s.rigid() ? 45.0 : 2.0 * t.size[k] * t.size[t.parent[k]];
}

}  // namespace

double symbol_flops(const Symbol& symbol) {
  const SkoSource& s = *symbol.source;
  const SkoStructure& t = s.structure();
  switch (symbol.definition->id) {
    case SymbolId::E: return over_bodies(t, [&](int k) { return edge_flops(s, k); });
    case SymbolId::H:
    case SymbolId::G: return over_bodies(t, [&](int k) { return 2.0 * t.size[k] * t.dof[k]; });
    case SymbolId::J:
    case SymbolId::D: return over_bodies(t, [&](int k) { return 2.0 * t.dof[k] * t.dof[k]; });
    case SymbolId::M: return over_bodies(t, [&](int k) { return s.rigid() ? 45.0 : 2.0 * t.size[k] * t.size[k]; });
    default: return over_bodies(t, [&](int k) { return 2.0 * t.size[k] * t.size[k]; });
  }
}

double resolvent_flops(const Symbol& symbol) {
  const SkoSource& s = *symbol.source;
  const SkoStructure& t = s.structure();
  const bool hinges = symbol.definition->id == SymbolId::psi;
  return over_bodies(t, [&](int k) { return edge_flops(s, k) + (hinges ? 4.0 * t.size[k] * t.dof[k] : 0.0); });
}

double group_flops(const SkoSource& s, unsigned group) {
  const SkoStructure& t = s.structure();
  const auto congruence = [&](int k) {
    if (t.parent[k] < 0) return 0.0;
    const double a = t.size[k], b = t.size[t.parent[k]];
    return s.rigid() ? 250.0 : 2 * b * a * a + b * b * a;
  };
  return over_bodies(t, [&](int k) {
    const double a = t.size[k], n = t.dof[k];
    switch (group) {
      case Group::kinematics: return s.rigid() ? 60.0 + 30 * n : 0.0;
      case Group::articulated: return congruence(k) + 2 * a * a * n + a * a * n + n * n * n / 3;
      case Group::composite: return congruence(k);
      case Group::compliance: return congruence(k) + 4 * a * a * n;
      default: return 120.0;
    }
  });
}

double group_bytes(const SkoSource& s, unsigned group) {
  const SkoStructure& t = s.structure();
  return 8 * over_bodies(t, [&](int k) {
    const double a = t.size[k], n = t.dof[k], square = s.rigid() ? 21 : a * a;
    switch (group) {
      case Group::kinematics: return (s.rigid() ? 22.0 : a * a + (t.parent[k] < 0 ? 0.0 : a * t.size[t.parent[k]])) + n * a + n;
      case Group::articulated: return 2 * square + n * a + 2 * n * n;
      case Group::composite:
      case Group::compliance: return square;
      default: return 24.0;
    }
  });
}

double mass_matrix_flops(const SkoSource& s, bool inverse) {
  const SkoStructure& t = s.structure();
  return over_bodies(t, [&](int k) {
    const double a = t.size[k], n = t.dof[k];
    return inverse ? 2 * edge_flops(s, k) + 8 * a * n + 2 * n * n : 2 * edge_flops(s, k) + 4 * a * n + (s.rigid() ? 45.0 : 2 * a * a);
  });
}

double mass_matrix_dense_flops(const SkoSource& s) {
  const SkoStructure& t = s.structure();
  std::vector<double> depth(t.bodies());
  double sum = 0;
  for (int k = 0; k < t.bodies(); ++k) {
    depth[k] = t.parent[k] < 0 ? 1 : depth[t.parent[k]] + 1;
    sum += depth[k] * t.dof[k] * (edge_flops(s, k) + 2.0 * t.size[k] * t.dof[k]);
  }
  return sum;
}

}  // namespace pycraft
