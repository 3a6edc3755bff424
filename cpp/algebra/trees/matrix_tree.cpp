#include "algebra/trees/matrix_tree.h"

#include <algorithm>
#include <cmath>

#include "algebra/trees/matrix_tree_values.h"
#include "runtime/errors.h"

namespace pycraft {

MatrixTree::MatrixTree(SkoStructure s, std::string name, std::vector<std::vector<double>> e, std::vector<std::vector<double>> h,
                       std::vector<std::vector<double>> m, std::vector<std::vector<double>> j)
    : SkoSource(std::move(s), std::move(name)), E(std::move(e)), H(std::move(h)), M(std::move(m)), J(std::move(j)) {
  const SkoStructure& t = structure();
  const size_t n = t.bodies();
  if (J.empty())
    for (size_t k = 0; k < n; ++k) J.emplace_back(size_t(t.dof[k]) * t.dof[k], 0.0);
  const auto check = [&](const char* what, const std::vector<double>& block, size_t k, int rows, int columns, bool symmetric) {
    const std::string where = std::string(what) + " of body '" + t.body_names[k] + "'";
    if (block.size() != size_t(rows) * columns)
      throw ModelError(where + " has " + std::to_string(block.size()) + " entries, not " + std::to_string(rows) + " x " + std::to_string(columns));
    for (double x : block)
      if (!std::isfinite(x)) throw ModelError(where + " has an entry that is not a number");
    if (symmetric)
      for (int i = 0; i < rows; ++i)
        for (int k2 = 0; k2 < i; ++k2)
          if (block[i * columns + k2] != block[k2 * columns + i])
            throw ModelError(where + " is not symmetric: entries (" + std::to_string(i) + ", " + std::to_string(k2) + ") differ; symmetrise it");
  };
  if (E.size() != n || H.size() != n || M.size() != n || J.size() != n)
    throw ModelError("'" + this->name() + "' has " + std::to_string(n) + " bodies; E, H, M and J take one block each");
  for (size_t k = 0; k < n; ++k) {
    if (t.parent[k] >= 0) check("E", E[k], k, t.size[t.parent[k]], t.size[k], false);
    check("H", H[k], k, t.dof[k], t.size[k], false);
    check("M", M[k], k, t.size[k], t.size[k], true);
    check("J", J[k], k, t.dof[k], t.dof[k], true);
  }
}

Traits MatrixTree::traits() const {
  bool with_J = false;
  for (const auto& block : J) with_J |= std::any_of(block.begin(), block.end(), [](double x) { return x != 0; });
  return {structure().is_chain(), structure().single_dof(), true, with_J, structure().free_root(), structure().equal_blocks()};
}

void MatrixTree::check_state(const double*, size_t nq, const double*, size_t nv) const {
  if (nq || nv) throw ModelError("'" + name() + "' is a tree of constant matrices and has no state");
}

#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> MatrixTree::make_values(S) const { return std::make_unique<MatrixTreeValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

}  // namespace pycraft
