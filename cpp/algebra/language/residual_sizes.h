// The sizes of the terms that a residual adds up, by which its rounding is bounded: algebra/trees/sweeps/residual_rounding.h.
#pragma once

#include <vector>

#include "algebra/language/structure.h"
#include "numerics/arithmetic.h"

namespace pycraft {

// u of the motions and of the forces, which may be gathered in a wider scalar: half an epsilon, what one operation rounds. Poses and hinge
// maps are rounded as motions are, and forces that are carried by them are off by as much in any scalar.
template <class S>
struct RoundingUnits {
  S motion, force;
};
template <class S>
inline RoundingUnits<S> units_of(const Refinement& how) {
  const S own = epsilon<S>() / S(2), up = static_cast<S>(epsilon<Wider<S>>()) / S(2);
  return {how.wider() ? up : own, how.residual == ResidualPrecision::same ? own : up};
}

// The sizes u A, u F and u T, of m columns each, and room for the functions of residual_rounding.h.
template <class S>
struct ResidualSizes {
  std::vector<S> motion, force, coordinate, y, g, f;
  void resize(const SkoStructure& tree, int m) {
    const size_t rows = size_t(tree.dimension()) * m, coordinates = size_t(tree.coordinates()) * m;
    for (auto* v : {&motion, &force, &g, &f})
      if (v->size() < rows) v->resize(rows);
    for (auto* v : {&coordinate, &y})
      if (v->size() < coordinates) v->resize(coordinates);
  }
};

}  // namespace pycraft
