// The pivots of small factorizations: which row is taken, what counts as noise, and couplings that are next to nothing.
#define BOOST_TEST_MODULE small_lu
#include <boost/test/included/unit_test.hpp>
#include <cmath>
#include <limits>
#include <vector>

#include "numerics/small_lu.h"

using namespace pycraft;

namespace {
constexpr double eps = std::numeric_limits<double>::epsilon();
}

BOOST_AUTO_TEST_CASE(couplings_of_1e_minus_170_take_no_row_out_of_the_range_of_numbers) {
  // A chain of blocks, each joined to the next by an entry so small that scales which made all entries alike would be 2^565 apart.
  for (int blocks : {2, 4, 8}) {
    const int n = 2 * blocks;
    std::vector<double> A(size_t(n) * n, 0.0), b(n), work(n);
    for (int k = 0; k < blocks; ++k) {
      double* own = A.data() + size_t(2 * k) * n + 2 * k;
      own[0] = 2, own[1] = 1, own[n] = 1, own[n + 1] = 3;
      if (k > 0) own[-2] = own[n - 1] = 1e-170;  // below the block before, nothing above it
    }
    const std::vector<double> whole = A;
    for (int i = 0; i < n; ++i) b[i] = i % 2 ? 4 : 3;  // of x = 1, but for 1e-170
    SmallLU<double> lu;
    BOOST_REQUIRE(lu.factor(A.data(), n, nullptr));
    lu.solve(b.data(), 1, work.data());
    for (int i = 0; i < n; ++i) BOOST_TEST(std::abs(b[i] - 1) < 4 * eps);
    BOOST_TEST(std::abs(lu.determinant().log() - blocks * std::log(5.0)) < 4 * n * eps);
  }
}

BOOST_AUTO_TEST_CASE(rows_are_exchanged_where_a_pivot_is_small) {
  // Without, nothing of what the last two rows say would be left.
  std::vector<double> A = {1e-17, 1, 1, 1, 1, 2, 1, 2, 1}, b = {2, 4, 4}, work(3);
  SmallLU<double> lu;
  BOOST_REQUIRE(lu.factor(A.data(), 3, nullptr));
  lu.solve(b.data(), 1, work.data());
  for (int i = 0; i < 3; ++i) BOOST_TEST(std::abs(b[i] - 1) < 16 * eps);
  BOOST_TEST(std::abs(lu.determinant().log() - std::log(2.0)) < 4 * eps);  // |1·2 - 0|, but for 1e-17
}

BOOST_AUTO_TEST_CASE(what_is_left_of_larger_numbers_is_no_pivot) {
  SmallLU<double> lu;
  std::vector<double> A = {1, 1, 1, 1 + 2 * eps};
  BOOST_TEST(!lu.factor(A.data(), 2, nullptr));
  A = {1, 1, 1, 1 + 1e-12};
  BOOST_TEST(lu.factor(A.data(), 2, nullptr));
  A = {1e-16, 0, 0, 1};  // of numbers as large as 1, or of none
  const double sizes[] = {1, 0, 0, 1};
  BOOST_TEST(!lu.factor(A.data(), 2, sizes));
  A = {1e-16, 0, 0, 1};
  BOOST_TEST(lu.factor(A.data(), 2, nullptr));
}
