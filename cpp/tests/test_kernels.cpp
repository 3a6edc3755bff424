// Small kernels on their own, by what they promise: packs, bounds of pivots, equilibration, small factorizations, moves of a configuration.
#define BOOST_TEST_MODULE kernels
#include <boost/test/included/unit_test.hpp>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <random>

#include "algebra/trees/sweeps/factored_inertia.h"
#include "algebra/trees/sweeps/residual_rounding.h"
#include "algebra/trees/sweeps/singular_pivot.h"
#include "model/configuration.h"
#include "numerics/equilibration.h"
#include "numerics/gram_factors.h"
#include "numerics/pack.h"
#include "numerics/refinement.h"
#include "numerics/small_lu.h"
#include "recursions/kinematics.h"
#include "robot.h"
#include "spatial/wide_force.h"

using namespace pycraft;
using pycraft::testing::random_numbers;

namespace {

constexpr double eps = std::numeric_limits<double>::epsilon();

}  // namespace

BOOST_AUTO_TEST_CASE(a_comparison_of_packs_holds_in_every_lane) {
  using Four = Pack<double, 4>;
  for (int lane = 0; lane < 4; ++lane) {
    Four x(2.0), other(1.0);
    BOOST_TEST((x > Four(1.0)));
    BOOST_TEST((other == Four(1.0)));
    x.v[lane] = 1.0;
    other.v[lane] = 3.0;
    BOOST_TEST(!(x > Four(1.0)));
    BOOST_TEST(!(other == Four(1.0)));
    x.v[lane] = std::numeric_limits<double>::quiet_NaN();
    BOOST_TEST(!(x > Four(1.0)));
  }
  const Four q = ratio_or_zero(Four(3.0), [] { Four d(2.0); d.v[2] = 0; return d; }());
  BOOST_TEST((q.v[1] == 1.5 && q.v[2] == 0.0));
}

// (j + 1) Σ w(i)² x(i)² with w = (-D₁₁⁻¹ D₁ⱼ, 1), solved here by Cramer's rule.
BOOST_AUTO_TEST_CASE(the_reach_of_a_pivot) {
  const double L[] = {1, 0, 0, 0.5, 1, 0, -1.5, 0.25, 1}, d[] = {4, 1, 9};  // D = L d L*
  const double squares[] = {3, 5, 7};
  double D[9] = {}, work[3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int a = 0; a < 3; ++a) D[3 * i + j] += L[3 * i + a] * d[a] * L[3 * j + a];
  BOOST_TEST(pivot_reach(L, 3, 0, squares, work) == 3.0);
  const double w = -D[1] / D[0];
  BOOST_TEST(std::abs(pivot_reach(L, 3, 1, squares, work) / (2 * (w * w * 3 + 5)) - 1) < 8 * eps);
  const double det = D[0] * D[4] - D[1] * D[3], u = -(D[2] * D[4] - D[1] * D[5]) / det, v = -(D[0] * D[5] - D[3] * D[2]) / det;
  BOOST_TEST(std::abs(pivot_reach(L, 3, 2, squares, work) / (3 * (u * u * 3 + v * v * 5 + 7)) - 1) < 32 * eps);
}

namespace {

// |a(i,j)| 2^(r(i) + c(j)) < 2 everywhere, and n entries in rows and columns of their own are 1 or more.
void check_scales(const std::vector<double>& A, int n) {
  Equilibration scales;
  std::vector<double> sizes(A);
  for (double& x : sizes) x = std::abs(x);
  BOOST_REQUIRE(scales.find(sizes.data(), n));
  std::vector<std::vector<int>> large(n);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double scaled = std::ldexp(sizes[size_t(i) * n + j], scales.row(i) + scales.column(j));
      BOOST_TEST(scaled < 2);
      if (scaled >= 1) large[i].push_back(j);
    }
  std::vector<int> row_of(n, -1);
  std::vector<char> seen;
  const std::function<bool(int)> place = [&](int i) {
    for (int j : large[i]) {
      if (seen[j]) continue;
      seen[j] = 1;
      if (row_of[j] < 0 || place(row_of[j])) return row_of[j] = i, true;
    }
    return false;
  };
  int placed = 0;
  for (int i = 0; i < n; ++i) seen.assign(n, 0), placed += place(i);
  BOOST_TEST(placed == n);
}

}  // namespace

BOOST_AUTO_TEST_CASE(equilibration_bounds_every_entry) {
  for (int seed = 0; seed < 60; ++seed) {
    const int n = 2 + seed % 7;
    std::vector<double> A = random_numbers(n * n, seed), sizes = random_numbers(n * n, seed + 1000), holes = random_numbers(n * n, seed + 2000);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        double& a = A[size_t(i) * n + j];
        a = std::ldexp(a, static_cast<int>(80 * sizes[size_t(i) * n + j]));
        if (i != j && holes[size_t(i) * n + j] > 0.2) a = 0;  // the diagonal is a matching: there is one
      }
    check_scales(A, n);
  }
  const std::vector<double> crossed = {1, 1e3, 0, 1e-9, 1, 1e6, 1e12, 0, 1};
  check_scales(crossed, 3);
  Equilibration scales;
  const double singular[] = {1, 2, 0, 3, 4, 0, 5, 6, 0};
  BOOST_TEST(!scales.find(singular, 3));
}

namespace {

std::vector<double> times(const std::vector<double>& A, const std::vector<double>& x) {
  const int n = static_cast<int>(x.size());
  std::vector<double> y(n, 0.0);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) y[i] += A[size_t(i) * n + j] * x[j];
  return y;
}

}  // namespace

// Rows and columns times powers of two: every bit of the solution is the one before, times a power of two.
BOOST_AUTO_TEST_CASE(units_change_no_bit_of_a_small_solve) {
  for (int seed = 0; seed < 40; ++seed) {
    const int n = 2 + seed % 6;
    std::vector<double> A = random_numbers(n * n, seed), b = random_numbers(n, seed + 500);
    for (int i = 0; i < n; ++i)  // sparse and graded, so that rows are exchanged
      for (int j = 0; j < n; ++j)
        if ((i + 2 * j + seed) % 3 == 0 && i != (j + 1) % n) A[size_t(i) * n + j] = i == j ? 0 : std::ldexp(A[size_t(i) * n + j], 20 - 7 * j);
    const std::vector<double> r = random_numbers(n, seed + 900), c = random_numbers(n, seed + 901);
    std::vector<double> scaled = A, right = b, work(n);
    for (int i = 0; i < n; ++i) {
      right[i] = std::ldexp(b[i], static_cast<int>(60 * r[i]));
      for (int j = 0; j < n; ++j) scaled[size_t(i) * n + j] = std::ldexp(A[size_t(i) * n + j], static_cast<int>(60 * r[i]) + static_cast<int>(60 * c[j]));
    }
    const std::vector<double> whole = A;
    SmallLU<double> lu, other;
    BOOST_REQUIRE(lu.factor(A.data(), n, nullptr) == other.factor(scaled.data(), n, nullptr));
    std::vector<double> x = b, y = right;
    lu.solve(x.data(), 1, work.data());
    other.solve(y.data(), 1, work.data());
    for (int j = 0; j < n; ++j) BOOST_TEST(std::ldexp(y[j], static_cast<int>(60 * c[j])) == x[j]);
    // The residual is rounding of the largest term, rows taken in their units.
    const std::vector<double> back = times(whole, x);
    double size = 0;
    const auto row = [&](int i, double a) { return std::ldexp(std::abs(a), lu.scales().row(i)); };
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) size = std::max({size, row(i, whole[size_t(i) * n + j] * x[j]), row(i, b[i])});
    for (int i = 0; i < n; ++i) BOOST_TEST(row(i, back[i] - b[i]) < 100 * n * eps * size);
  }
}

BOOST_AUTO_TEST_CASE(factors_of_gram_matrices) {
  // Läuchli's matrix: X*X = [[1 + e², 1], [1, 1 + e²]] is singular in double, X is not. (X*X)⁻¹ (1, -1)* = (1, -1)*/e².
  const double e = 1e-9;
  GramFactors<double> gram;
  std::vector<double> X = {1, 1, e, 0, 0, e}, x = {1, -1};
  BOOST_REQUIRE(gram.factor(X, 3, 2));
  gram.solve(x.data(), 1);
  BOOST_TEST((std::abs(x[0] * e * e - 1) < 1e-6 && std::abs(x[1] * e * e + 1) < 1e-6));
  BOOST_TEST(std::abs(gram.determinant().log() - std::log(2 * e * e)) < 1e-6);
  X = {1, 2, 3, 6, -1, -2};  // the second column is twice the first
  BOOST_TEST(!gram.factor(X, 3, 2));
  X = {1, 2};
  BOOST_TEST(!gram.factor(X, 1, 2));  // fewer rows than columns
  // Rows of 1e-12 and of 1e12: least squares of the light ones keeps its digits. X = [[h, h], [1, 2], [1, -1]], h large: X*X x = X* b for
  // b = X (1, -1)* = (0, -1, 2)*.
  const double h = 1e12;
  X = {1, 2, h, h, 1, -1};
  BOOST_REQUIRE(gram.factor(X, 3, 2));
  x = {-1 + 2, -2 - 2};
  gram.solve(x.data(), 1);
  BOOST_TEST((std::abs(x[0] - 1) < 1e-3 && std::abs(x[1] + 1) < 1e-3), x[0] << ", " << x[1]);
  const double determinant = std::pow(1.0 - 2, 2) * h * h + 2 * 2 * h * h + 9;  // Σ of squared minors: (1,h), (h,1), (1,1)
  BOOST_TEST(std::abs(gram.determinant().log() - std::log(determinant)) < 1e-13);
}

namespace {

// x = b, solved with an error: δ = gain (b - x). What the rounding of the residual may make of δ: `rounding`.
struct Corrected {
  double x;
  size_t corrections;
};
Corrected corrected(double x, double b, double gain, double largest = 0, double rounding = 0) {
  RefinementWork<double> work;
  refine(&x, 1, 1, Refinement{Refinement::automatic}, Form::fast, largest, [] { return std::string("a number"); },
         [&](const double* at, double* r) { r[0] = b - at[0]; }, [&](const double* r, double* d) { d[0] = gain * r[0]; },
         [&](const double*, double* out) { out[0] = rounding; }, work);
  return {x, work.corrections.size()};
}

}  // namespace

BOOST_AUTO_TEST_CASE(corrections_end_where_they_no_longer_halve) {
  const Corrected slow = corrected(0.9, 1, 0.4), fast = corrected(0.9, 1, 0.6);  // the next is 0.6 of the last, and 0.4
  BOOST_TEST((slow.corrections == 2 && std::abs(slow.x - 0.94) < 4 * eps), slow.corrections << " " << slow.x);
  BOOST_TEST((fast.corrections > 10 && std::abs(fast.x - 1) < 1e-8), fast.corrections << " " << fast.x);
}

BOOST_AUTO_TEST_CASE(a_first_correction_above_three_tenths_is_refused) {
  BOOST_TEST(corrected(1, 1.29, 1).x == 1.29);
  BOOST_CHECK_THROW(corrected(1, 1.31, 1), RefinementError);
  BOOST_CHECK_THROW(corrected(1, 1.8, 1), RefinementError);
  // Unless it is rounding of terms that cancelled.
  BOOST_TEST(corrected(1e-16, 3e-16, 1, 1.0).x == 3e-16);
  BOOST_CHECK_THROW(corrected(1e-16, 3e-16, 1, 1e-4), RefinementError);
  BOOST_CHECK_THROW(corrected(1e-16, 3e-16, 1), RefinementError);
}

BOOST_AUTO_TEST_CASE(what_may_be_rounding_is_not_applied) {
  BOOST_TEST(corrected(1, 1.1, 1, 0, 0.2).x == 1);
  BOOST_TEST(corrected(1, 1.1, 1, 0, 0.01).x == 1.1);
}

// Rotors are in the residual r = b - (HφMφ*H* + J) x and nowhere in the forces: what they add to its rounding is u J |x|, coordinate by coordinate.
BOOST_AUTO_TEST_CASE(the_rounding_of_what_rotors_add) {
  const auto model = pycraft::testing::robot();
  const auto compiled = model->compiled<double>();
  const SkoStructure tree = model->structure();
  RigidBlocks<double> blocks(tree);
  const std::vector<double> q = model->state()->q, x = random_numbers(model->nv(), 4), b = random_numbers(model->nv(), 5);
  kinematics(*compiled, q.data(), blocks);
  const RoundingUnits<double> units{eps / 2, eps / 8};
  ResidualSizes<double> without, with;
  residual_sizes(tree, blocks, x.data(), b.data(), 1, units, without);
  for (int j = 0; j < model->nv(); ++j) blocks.J[j] = 1e3 + j;
  residual_sizes(tree, blocks, x.data(), b.data(), 1, units, with);
  for (int j = 0; j < model->nv(); ++j) {
    const double added = units.force * (1e3 + j) * std::abs(x[j]);
    BOOST_TEST(std::abs(with.coordinate[j] - without.coordinate[j] - added) <= 8 * eps * with.coordinate[j]);
  }
  BOOST_TEST((with.force == without.force && with.motion == without.motion));
}

// A move is a product of quaternions: |q| is kept, whatever it is.
BOOST_AUTO_TEST_CASE(moves_keep_the_length_of_quaternions) {
  CompiledModel<double> model;
  model.subhinges.resize(1);
  for (const SubhingeKind kind : {SubhingeKind::ball, SubhingeKind::free}) {
    model.subhinges[0].kind = kind;
    for (const double length : {1e-3, 1.0, 3.0, 1e160}) {
      std::vector<double> q = {0.5, -0.5, 0.1, 0.7, 0, 0, 0};
      const double own = std::sqrt(0.25 + 0.25 + 0.01 + 0.49);
      for (int i = 0; i < 4; ++i) q[i] *= length / own;
      for (int step = 0; step < 50; ++step) {
        const std::vector<double> u = random_numbers(6, step);
        move_configuration(model, q.data(), u.data(), q.data());
      }
      double squares = 0;
      for (int i = 0; i < 4; ++i) squares += (q[i] / length) * (q[i] / length);
      if (kind == SubhingeKind::ball || length < 1e100) BOOST_TEST(std::abs(std::sqrt(squares) - 1) < 50 * 4 * eps);
    }
  }
}

namespace {

SkoStructure tree_of_sixes(const std::vector<int>& parents) {
  SkoStructure tree;
  tree.parent = parents;
  tree.size.assign(parents.size(), 6), tree.dof.assign(parents.size(), 1);
  tree.finish();
  return tree;
}

std::vector<int> chain_of(int n) {
  std::vector<int> parents(n);
  for (int k = 0; k < n; ++k) parents[k] = k - 1;
  return parents;
}

}  // namespace

// 1.6 MB of 2000 bodies, which no cache near the processor holds, before bodies gave their room back.
BOOST_AUTO_TEST_CASE(columns_of_a_chain_take_the_room_of_two_bodies) {
  const auto room = [](const std::vector<int>& parents) { return FactoredInertia<double>(tree_of_sixes(parents)).scalars(); };
  BOOST_TEST(room(chain_of(2000)) == room(chain_of(3)));
  BOOST_TEST(room(chain_of(3)) > room(chain_of(1)));
  BOOST_TEST(room({-1, 0, 0, 0, 0}) > room({-1, 0, 0}));  // of a star all columns of the leaves meet
}

// A sweep as block policies make it, in bodies of six with one coordinate each: no body writes into the room of another that is open.
BOOST_AUTO_TEST_CASE(open_bodies_share_no_room) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<int> parents(1, -1);
    while (parents.size() < 12) {  // depth first, as models are: a child of the last body or of one above it
      int p = static_cast<int>(parents.size()) - 1;
      for (int up = random() % 3; up > 0 && p >= 0; --up) p = parents[p];
      parents.push_back(p);
    }
    const SkoStructure tree = tree_of_sixes(parents);
    FactoredInertia<double> factors(tree);
    const auto start = [&](int k) {
      factors.start(k);
      for (int c = 0; c < 6; ++c) factors.add(k, 1 + c, k, [&](int i) { return 100 * k + 10 * i + c; });
    };
    const auto unharmed = [&](int k) {
      for (int i = 0; i < 6; ++i)
        for (int c = 0; c < 6; ++c)
          if (factors.body_row(k, i)[c] != 100 * k + 10 * i + c || factors.weights(k)[c] != 1 + c) return false;
      return true;
    };
    for (int k = tree.bodies() - 1; k >= 0; --k) {
      if (tree.last_child[k] < 0) start(k);
      BOOST_TEST(unharmed(k));
      factors.fill_up(k);
      const int p = tree.parent[k];
      if (p < 0) continue;
      if (tree.last_child[p] == k) start(p);
      BOOST_TEST(unharmed(k));
      for (int c = 0; c < 6; ++c) factors.add(p, -1, -1, [](int) { return -1.0; });
    }
  }
}

// Rows that are filled up to whole fours, whichever way they are taken, against the same in packs, bit for bit.
BOOST_AUTO_TEST_CASE(orthogonal_rows_are_the_same_however_many_are_taken_at_a_time) {
  using Four = Pack<double, 4>;
  const int stride = 24, count = 8, pivots = 7;
  for (int m : {1, 5, 6, 11, 12, 13, 17, 22}) {
    std::vector<double> A(count * stride, 0), w(stride, 0), weighted(stride), L(count * pivots), d(pivots);
    std::vector<int> rows(count);
    std::iota(rows.begin(), rows.end(), 0);
    const std::vector<double> numbers = random_numbers(count * stride + m, m);
    for (int r = 0; r < count; ++r)
      for (int c = 0; c < m; ++c) A[r * stride + c] = numbers[r * stride + c];
    for (int c = 0; c < m; ++c) w[c] = std::abs(numbers[count * stride + c]);
    std::vector<Four> A4(A.begin(), A.end()), w4(w.begin(), w.end()), weighted4(stride), L4(L.size()), d4(pivots);
    std::vector<double> A1 = A, L1(L.size()), d1(pivots);
    weighted_gram_schmidt(A.data(), stride, rows.data(), count, pivots, m, w.data(), weighted.data(), L.data(), d.data());
    orthogonalise(A1.data(), stride, rows.data(), count, pivots, m, w.data(), weighted.data(), L1.data(), d1.data());
    weighted_gram_schmidt(A4.data(), stride, rows.data(), count, pivots, m, w4.data(), weighted4.data(), L4.data(), d4.data());
    for (size_t i = 0; i < L.size(); ++i) BOOST_TEST((L[i] == L1[i] && L[i] == L4[i].v[3]));
    for (int r = 0; r < pivots; ++r) BOOST_TEST((d[r] == d1[r] && d[r] == d4[r].v[0]));
  }
}

// Of masses as they are given, against the inertia about the origin in quad; rounded in T once an operation, never in double.
BOOST_AUTO_TEST_CASE(wide_forces_are_wide) {
  const auto near = [](Extended x, Quad exact, Quad size) { return abs(Quad(x) - exact) <= Quad(64) * Quad(epsilon<Extended>()) * size; };
  for (int seed = 0; seed < 20; ++seed) {
    const std::vector<double> x = random_numbers(40, seed);
    const MassProperties M{1 + x[0], {x[1], x[2], x[3]}, {2 + x[4], x[5], x[6], 2 + x[7], x[8], 2 + x[9]}};
    const Vector6<double> a{{x[10], x[11], x[12]}, {x[13], x[14], x[15]}};
    const Vector3<double> omega{x[16], x[17], x[18]};
    const RigidInertia<Quad> exact = rigid_inertia(Quad(M.mass), cast<Quad>(M.com), cast<Quad>(M.about_com));
    const Vector3<Quad> w = cast<Quad>(omega);
    const Vector6<Quad> rest = exact * cast<Quad>(a), moving = rest + Vector6<Quad>{cross(w, exact.rotational * w), cross(w, cross(w, exact.moment))};
    Vector6<Extended> f, g;
    wide_force<Extended, double>(M, a, nullptr, f);
    wide_force(M, a, &omega, g);
    const Pose<double> X{exp_rotation(Vector3<double>{x[20], x[21], x[22]}), {x[23], x[24], x[25]}};
    const Vector6<Quad> carried = force_to_parent(cast<Quad>(X), moving);
    Vector6<Extended> parent = Vector6<Extended>::zero();
    add_wide_to_parent(X, g, parent);
    add_wide_to_parent(X, g, parent);
    for (int i = 0; i < 6; ++i) {
      BOOST_TEST(near(f[i], rest[i], Quad(30)));
      BOOST_TEST(near(g[i], moving[i], Quad(60)));
      BOOST_TEST(near(parent[i], Quad(2) * carried[i], Quad(400)));
    }
    BOOST_TEST(near(wide_dot(a, g), dot(cast<Quad>(a), moving), Quad(400)));
  }
}
