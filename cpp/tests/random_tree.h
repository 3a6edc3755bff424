// Random SKO trees of mixed block sizes, and a dense evaluation of expressions by Eigen to compare with. Seeded.
#pragma once

#include <Eigen/Dense>
#include <random>

#include "algebra/engine/engine.h"
#include "algebra/engine/evaluate.h"
#include "algebra/theorems/theorems.h"
#include "algebra/trees/matrix_tree.h"

namespace pycraft::testing {

inline std::vector<double> random_block(std::mt19937& g, int rows, int columns, double scale = 1) {
  std::normal_distribution<double> normal;
  std::vector<double> b(size_t(rows) * columns);
  for (double& x : b) x = scale * normal(g);
  return b;
}

inline std::vector<double> random_positive(std::mt19937& g, int n) {
  const std::vector<double> a = random_block(g, n, n);
  std::vector<double> m(size_t(n) * n, 0.0);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = i == j ? 1.0 : 0.0;
      for (int k = 0; k < n; ++k) sum += a[size_t(i) * n + k] * a[size_t(j) * n + k];
      m[size_t(i) * n + j] = m[size_t(j) * n + i] = sum;
    }
  return m;
}

// Blocks of 3, 6 and 9 rows; hinges of 0 to 3 coordinates.
inline std::shared_ptr<MatrixTree> random_tree(unsigned seed, std::vector<int> parents, bool with_J = false) {
  std::mt19937 g(seed);
  SkoStructure s;
  s.parent = std::move(parents);
  std::vector<std::vector<double>> E, H, M, J;
  for (size_t k = 0; k < s.parent.size(); ++k) {
    s.size.push_back(3 * (1 + static_cast<int>(g() % 3)));
    s.dof.push_back(k == 2 ? 0 : 1 + static_cast<int>(g() % 3));
  }
  for (size_t k = 0; k < s.parent.size(); ++k) {
    const int size = s.size[k], n = s.dof[k];
    E.push_back(s.parent[k] < 0 ? std::vector<double>{} : random_block(g, s.size[s.parent[k]], size, 0.4));
    H.push_back(random_block(g, n, size));
    M.push_back(random_positive(g, size));
    if (with_J) J.push_back(random_positive(g, n));
  }
  s.finish();
  return std::make_shared<MatrixTree>(std::move(s), "random tree", E, H, M, J);
}

using Dense = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

inline Dense dense(const Expression& e, bool rules = true) {
  Result r;
  evaluate(e, Request::dense, r, rules);
  return Eigen::Map<const Dense>(r.values.data(), r.rows, r.columns);
}

inline double largest(const Dense& A) { return A.size() ? A.cwiseAbs().maxCoeff() : 0.0; }

// |A - B| relative to the larger of the two.
inline double difference(const Dense& A, const Dense& B) {
  return largest(A - B) / std::max({largest(A), largest(B), 1e-300});
}

}  // namespace pycraft::testing
