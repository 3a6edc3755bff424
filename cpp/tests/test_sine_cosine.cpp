// The kernels' sine and cosine against the C library's in extended precision, of one number and of several.
#define BOOST_TEST_MODULE sine_cosine
#include <boost/test/included/unit_test.hpp>

#include <cmath>
#include <limits>
#include <random>

#define PYCRAFT_INSTRUCTION_SET tested
#include "lanes/sine_cosine.h"

using namespace pycraft::kernels::tested;

namespace {

// The largest error over angles up to `range`, in units of the last place of the value, or of `least` where that is larger.
template <class S>
double worst_error(double range, double least) {
  using T = typename S::Scalar;
  std::mt19937_64 generator(1);
  std::uniform_real_distribution<double> uniform(-range, range);
  long double worst = 0;
  for (int i = 0; i < 100000; ++i) {
    S x;
    for (int b = 0; b < S::width; ++b) x.set(b, T(uniform(generator)));
    const SineCosine<S> of = sine_cosine(x);
    for (int b = 0; b < S::width; ++b) {
      const long double angle = x.lane(b), exact[] = {sinl(angle), cosl(angle)};
      const T found[] = {of.sine.lane(b), of.cosine.lane(b)};
      for (int k = 0; k < 2; ++k) {
        const long double size = std::max(std::abs(exact[k]), static_cast<long double>(least));
        worst = std::max(worst, std::abs(found[k] - exact[k]) / (std::ldexp(1.0L, std::ilogb(size)) * std::numeric_limits<T>::epsilon()));
      }
    }
  }
  return static_cast<double>(worst);
}

}  // namespace

BOOST_AUTO_TEST_CASE(in_double_below_one_unit_in_the_last_place) {
  if (std::numeric_limits<long double>::digits <= 53) return;  // nothing to compare with
  for (const double range : {1e-8, 0.1, 3.2, 100.0, 524288.0}) {
    BOOST_TEST((worst_error<Lanes<double, 1>>(range, 0) < 0.85), "up to " << range);
    BOOST_TEST((worst_error<Lanes<double, 4>>(range, 0) < 0.85), "up to " << range);
  }
}

// A float's own distance from a multiple of π is as large as the last place of one half.
BOOST_AUTO_TEST_CASE(in_single) {
  for (const double range : {1e-3, 3.2, 100.0, 4096.0}) BOOST_TEST((worst_error<Lanes<float, 8>>(range, 0.5) < 2), "up to " << range);
}

BOOST_AUTO_TEST_CASE(larger_angles_are_the_librarys) {
  Lanes<double, 4> x;
  const double angles[] = {1e6, -1e18, 1e300, 0.3};
  for (int b = 0; b < 4; ++b) x.set(b, angles[b]);
  const auto of = sine_cosine(x);
  for (int b = 0; b < 3; ++b) {
    BOOST_TEST(of.sine.lane(b) == std::sin(angles[b]));
    BOOST_TEST(of.cosine.lane(b) == std::cos(angles[b]));
  }
  BOOST_TEST(of.sine.lane(3) == sine_cosine(Lanes<double, 1>(0.3)).sine.lane(0));
}

BOOST_AUTO_TEST_CASE(exact_values_and_signs) {
  const auto zero = sine_cosine(Lanes<double, 1>(0.0));
  BOOST_TEST(zero.sine.lane(0) == 0.0);
  BOOST_TEST(zero.cosine.lane(0) == 1.0);
  for (int quarter = -9; quarter <= 9; ++quarter) {
    const double x = quarter * 1.5707963267948966;
    const auto of = sine_cosine(Lanes<double, 1>(x));
    BOOST_TEST(std::abs(of.sine.lane(0) - std::sin(x)) <= 1.2e-16);
    BOOST_TEST(std::abs(of.cosine.lane(0) - std::cos(x)) <= 1.2e-16);
  }
}
