// Factors with pivots beside the sizes of rows: solutions and those of the adjoint, rows that are exchanged, units, noise, and growth that is none.
#define BOOST_TEST_MODULE row_pivots
#include <boost/test/included/unit_test.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "numerics/row_pivots.h"

using namespace pycraft;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

std::vector<double> sizes_of(const std::vector<double>& A, int n) {
  std::vector<double> sizes(n, 0.0);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) sizes[i] = std::max(sizes[i], std::abs(A[size_t(i) * n + j]));
  return sizes;
}

}  // namespace

BOOST_AUTO_TEST_CASE(both_solutions_of_a_matrix_whose_rows_are_exchanged) {
  const std::vector<double> whole = {1e-17, 1, 1, 1, 1, 2, 1, 2, 1};
  std::vector<double> A = whole, work(6), b = {2, 1, 4, 0, 4, -1}, c = {3, 0, -2};  // two right sides, row by row
  const std::vector<double> sizes = sizes_of(A, 3), b0 = b, c0 = c;
  RowPivotLU<double> lu;
  BOOST_REQUIRE(lu.factor(A.data(), 3, sizes.data()));
  lu.solve(b.data(), 2, work.data());
  lu.solve_transposed(c.data());
  for (int i = 0; i < 3; ++i) {
    double left[2] = {b0[2 * i], b0[2 * i + 1]}, of_adjoint = c0[i];
    for (int j = 0; j < 3; ++j) left[0] -= whole[3 * i + j] * b[2 * j], left[1] -= whole[3 * i + j] * b[2 * j + 1], of_adjoint -= whole[3 * j + i] * c[j];
    for (const double off : {left[0], left[1], of_adjoint}) BOOST_TEST(std::abs(off) < 32 * eps);
  }
}

BOOST_AUTO_TEST_CASE(units_of_rows_decide_about_no_pivot) {
  std::vector<double> A = {3, 1, 2, 1, 4, 1, 2, 1, 5}, B = A, work(3), x = {1, 2, 3}, y = x;
  const double unit[] = {std::ldexp(1.0, 40), std::ldexp(1.0, -30), 1.0};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) B[3 * i + j] *= unit[i];
    y[i] *= unit[i];
  }
  const std::vector<double> sizes = sizes_of(A, 3), others = sizes_of(B, 3);
  RowPivotLU<double> lu;
  BOOST_REQUIRE(lu.factor(A.data(), 3, sizes.data()));
  lu.solve(x.data(), 1, work.data());
  BOOST_REQUIRE(lu.factor(B.data(), 3, others.data()));
  lu.solve(y.data(), 1, work.data());
  for (int i = 0; i < 3; ++i) BOOST_TEST(x[i] == y[i]);
}

BOOST_AUTO_TEST_CASE(what_rounding_leaves_is_no_pivot) {
  for (const double off : {0.0, eps}) {
    std::vector<double> A = {1, 2, 3, 4, 5, 6, 7, 8, 9 + off};
    const std::vector<double> sizes = sizes_of(A, 3);
    RowPivotLU<double> lu;
    BOOST_TEST(!lu.factor(A.data(), 3, sizes.data()));
  }
  std::vector<double> zero(4, 0.0);
  const std::vector<double> one(2, 1.0);
  BOOST_TEST(!RowPivotLU<double>().factor(zero.data(), 2, one.data()));
  BOOST_TEST(RowPivotLU<double>().factor(zero.data(), 0, one.data()));
}
