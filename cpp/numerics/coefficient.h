// Coefficients: the numbers in front of operators and scalars, exact whatever the precision of the run. 1/3 is 1/3 in every one of them, and
// a double is the number that it is.
#pragma once

#include <cmath>
#include <concepts>
#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "numerics/scalar.h"

namespace pycraft {

class Coefficient {
 public:
  Coefficient(double value = 0) : value_(value) {}
  Coefficient(int value) : value_(value) {}
  // A ratio of whole numbers, each in decimal digits with or without a sign. Throws EvaluationError where the lower one is 0.
  static Coefficient ratio(const std::string& above, const std::string& below);
  // The sum of these doubles.
  static Coefficient sum(const std::vector<double>& parts);
  // ln|c| to more digits than any run has.
  static Coefficient log_of_size(const Coefficient& c);

  // The nearest double; infinite where it is larger than any.
  double nearest() const { return value_; }
  bool is_double() const { return !exact_; }
  bool is_zero() const { return !exact_ && value_ == 0; }
  int sign() const;
  // Whole numbers in decimal digits; only of what is finite.
  std::pair<std::string, std::string> as_ratio() const;
  // As few decimal digits as name it: of a double the shortest that names it among doubles; else 0.3 for 3/10, or the ratio.
  std::string text() const;

  // In the precision of a run.
  template <class S>
    requires(std::same_as<S, Single> || std::same_as<S, double> || std::same_as<S, Extended> || std::same_as<S, Quad> || std::same_as<S, Digits50> ||
             std::same_as<S, Digits100> || is_recorded<S>)
  explicit operator S() const {
    if constexpr (std::same_as<S, Single> || std::same_as<S, double> || is_recorded<S>) {
      return static_cast<S>(value_);
    } else {
      if (!exact_) return S(value_);
      using std::ldexp;
      S total = S(0);
      for (int i = digits - 1; i >= 0; --i) total += S(parts()[i]);
      return ldexp(total, exponent());
    }
  }

  friend Coefficient operator+(const Coefficient& a, const Coefficient& b);
  friend Coefficient operator-(const Coefficient& a, const Coefficient& b) { return a + -b; }
  friend Coefficient operator*(const Coefficient& a, const Coefficient& b);
  friend Coefficient operator/(const Coefficient& a, const Coefficient& b);
  friend Coefficient operator-(const Coefficient& a);
  Coefficient& operator+=(const Coefficient& b) { return *this = *this + b; }
  Coefficient& operator*=(const Coefficient& b) { return *this = *this * b; }
  friend Coefficient abs(const Coefficient& a) { return a.sign() < 0 ? -a : a; }
  friend bool operator==(const Coefficient& a, const Coefficient& b);
  friend bool operator<(const Coefficient& a, const Coefficient& b) { return (a - b).sign() < 0; }
  friend bool operator>(const Coefficient& a, const Coefficient& b) { return b < a; }

 private:
  static constexpr int digits = 8;   // doubles that an exact one is shown to a run as: 400 bits, with an exponent of their own
  struct Exact;
  const double* parts() const;
  int exponent() const;
  static Coefficient of(Exact exact);
  static Exact exactly(const Coefficient& c);

  double value_;
  std::shared_ptr<const Exact> exact_;   // where it is no double
};

struct CoefficientHash {
  size_t operator()(const Coefficient& c) const { return std::hash<double>()(c.nearest()); }
};

}  // namespace pycraft
