// Rows eliminated one after the other: solutions and those of the adjoint, what spans the null space, pivots that are allowed, and rows of rounding.
#define BOOST_TEST_MODULE sparse_elimination
#include <boost/test/included/unit_test.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "numerics/sparse_elimination.h"

using namespace pycraft;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();
constexpr int n = 3, m = 5;
// Row 0 needs another column than the first, row 2 fills in.
const double A[n][m] = {{1e-17, 2, 0, 0, 1}, {3, 1, 0, -1, 0}, {1, 0, 4, 0, 2}};
const std::vector<double> ones(m, 1.0);

int enter(SparseElimination<double>& of, const double* row, const char* allowed = nullptr, double tolerance = 0) {
  for (int c = 0; c < m; ++c)
    if (row[c] != 0) of.entry(c, row[c]);
  return of.eliminate(ones.data(), allowed, tolerance);
}

}  // namespace

BOOST_AUTO_TEST_CASE(solutions_of_rows_and_of_their_adjoint) {
  SparseElimination<double> of;
  of.begin(m);
  std::vector<int> pivots;
  for (const auto& row : A) pivots.push_back(enter(of, row));
  BOOST_TEST(of.rows() == n);
  BOOST_TEST(pivots[0] == 1);
  double b[n] = {1, -2, 3}, x[m] = {}, taken[m] = {1, 2, 3, 4, 5}, lambda[n];
  const double b0[n] = {1, -2, 3}, taken0[m] = {1, 2, 3, 4, 5};
  of.solve(b, x);
  of.solve_transposed(taken, lambda);
  for (int i = 0; i < n; ++i) {
    double left = b0[i], of_adjoint = taken0[pivots[i]];
    for (const int c : pivots) left -= A[i][c] * x[c];
    for (int j = 0; j < n; ++j) of_adjoint -= A[j][pivots[i]] * lambda[j];
    BOOST_TEST(std::abs(left) < 64 * eps);
    BOOST_TEST(std::abs(of_adjoint) < 64 * eps);
  }
}

BOOST_AUTO_TEST_CASE(columns_that_rows_take_to_zero) {
  SparseElimination<double> of;
  of.begin(m);
  std::vector<char> pivot(m, 0);
  for (const auto& row : A) pivot[enter(of, row)] = 1;
  constexpr int r = m - n;
  double X[m * r] = {};
  for (int c = 0, a = 0; c < m; ++c)
    if (!pivot[c]) X[c * r + a++] = 1;
  of.complete(X, r);
  for (const auto& row : A)
    for (int a = 0; a < r; ++a) {
      double sum = 0;
      for (int c = 0; c < m; ++c) sum += row[c] * X[c * r + a];
      BOOST_TEST(std::abs(sum) < 64 * eps);
    }
}

BOOST_AUTO_TEST_CASE(pivots_are_the_largest_of_those_allowed_beside_their_weights) {
  SparseElimination<double> of;
  of.begin(m);
  const char allowed[m] = {1, 0, 1, 1, 0};
  BOOST_TEST(enter(of, A[1], allowed) == 0);
  of.begin(m);
  const std::vector<double> weights = {100, 1, 1, 0.5, 1};
  for (int c = 0; c < m; ++c)
    if (A[1][c] != 0) of.entry(c, A[1][c]);
  BOOST_TEST(of.eliminate(weights.data(), nullptr, 0) == 3);
}

BOOST_AUTO_TEST_CASE(a_row_that_hangs_on_others_is_forgotten) {
  SparseElimination<double> of;
  of.begin(m);
  for (const auto& row : A) enter(of, row);
  double sum[m];
  for (int c = 0; c < m; ++c) sum[c] = A[0][c] / 3 + A[1][c] - 2 * A[2][c] + (c == 3 ? 4 * eps : 0);
  BOOST_TEST(enter(of, sum, nullptr, 64 * eps) == -1);
  BOOST_TEST(of.rows() == n);
  double b[n] = {1, 0, 0}, x[m] = {};
  of.solve(b, x);  // as before
  BOOST_TEST(std::isfinite(x[1]));
}
