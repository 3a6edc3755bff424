// Numbers of 50 and of 100 decimal digits: Boost's cpp_bin_float, its arithmetic compiled once (digits.cpp). Written out wherever a sweep adds
// and multiplies, these two scalars of six were half of a build.
#pragma once

#include <concepts>
#include <cstddef>
#include <limits>

#include "numerics/builtin_scalars.h"

namespace pycraft {

template <unsigned decimals>
class Digits {
 public:
  Digits();  // zero
  Digits(double x);
  Digits(Single x) : Digits(static_cast<double>(x)) {}
  Digits(Extended x);
  Digits(const Quad& x);
  template <std::integral I>
  Digits(I x) : Digits(static_cast<Extended>(x)) {}
  template <unsigned others>
    requires(others < decimals)
  Digits(const Digits<others>& x);
  template <unsigned others>
    requires(others > decimals)
  explicit Digits(const Digits<others>& x);

  explicit operator double() const;
  explicit operator Single() const;
  explicit operator Extended() const;
  explicit operator Quad() const;
  explicit operator int() const { return static_cast<int>(static_cast<double>(*this)); }

  Digits& operator+=(const Digits& b) { return *this = sum(*this, b); }
  Digits& operator-=(const Digits& b) { return *this = difference(*this, b); }
  Digits& operator*=(const Digits& b) { return *this = product(*this, b); }
  Digits& operator/=(const Digits& b) { return *this = quotient(*this, b); }
  friend Digits operator+(const Digits& a, const Digits& b) { return sum(a, b); }
  friend Digits operator-(const Digits& a, const Digits& b) { return difference(a, b); }
  friend Digits operator*(const Digits& a, const Digits& b) { return product(a, b); }
  friend Digits operator/(const Digits& a, const Digits& b) { return quotient(a, b); }
  friend Digits operator+(const Digits& a) { return a; }
  friend Digits operator-(const Digits& a) { return a.negative(); }
  friend bool operator<(const Digits& a, const Digits& b) { return less(a, b); }
  friend bool operator>(const Digits& a, const Digits& b) { return less(b, a); }
  friend bool operator<=(const Digits& a, const Digits& b) { return at_most(a, b); }
  friend bool operator>=(const Digits& a, const Digits& b) { return at_most(b, a); }
  friend bool operator==(const Digits& a, const Digits& b) { return equal(a, b); }

  friend Digits abs(const Digits& a) { return a.magnitude(); }
  friend Digits sqrt(const Digits& a) { return a.root(); }
  friend Digits sin(const Digits& a) { return a.sine(); }
  friend Digits cos(const Digits& a) { return a.cosine(); }
  friend Digits exp(const Digits& a) { return a.exponential(); }
  friend Digits log(const Digits& a) { return a.logarithm(); }
  friend Digits log10(const Digits& a) { return a.decimal_logarithm(); }
  friend Digits pow(const Digits& a, const Digits& b) { return a.power(b); }
  friend Digits atan2(const Digits& y, const Digits& x) { return y.angle(x); }
  friend Digits floor(const Digits& a) { return a.whole(); }
  friend Digits ldexp(const Digits& a, int n) { return a.scaled(n); }
  friend Digits frexp(const Digits& a, int* n) { return a.fraction(*n); }
  friend int ilogb(const Digits& a) {
    int n;
    a.fraction(n);
    return n - 1;
  }
  friend bool isfinite(const Digits& a) { return a.finite(); }

  // Where the number of Boost's lies whose bytes these are; digits_value.h has its type.
  const void* bytes() const { return bytes_; }
  void* bytes() { return bytes_; }
  static constexpr std::size_t size = decimals == 50 ? 64 : 80;

 private:
  static Digits sum(const Digits& a, const Digits& b);
  static Digits difference(const Digits& a, const Digits& b);
  static Digits product(const Digits& a, const Digits& b);
  static Digits quotient(const Digits& a, const Digits& b);
  static bool less(const Digits& a, const Digits& b);
  static bool at_most(const Digits& a, const Digits& b);
  static bool equal(const Digits& a, const Digits& b);
  Digits negative() const;
  Digits magnitude() const;
  Digits root() const;
  Digits sine() const;
  Digits cosine() const;
  Digits exponential() const;
  Digits logarithm() const;
  Digits decimal_logarithm() const;
  Digits power(const Digits& b) const;
  Digits angle(const Digits& x) const;
  Digits whole() const;
  Digits scaled(int n) const;
  Digits fraction(int& n) const;
  bool finite() const;

  alignas(16) unsigned char bytes_[size];
};

using Digits50 = Digits<50>;
using Digits100 = Digits<100>;

}  // namespace pycraft

template <unsigned decimals>
struct std::numeric_limits<pycraft::Digits<decimals>> {
  using Number = pycraft::Digits<decimals>;
  static constexpr bool is_specialized = true, is_signed = true, is_integer = false, is_exact = false, has_infinity = true, has_quiet_NaN = true;
  static constexpr int radix = 2, digits = decimals == 50 ? 168 : 334, digits10 = decimals, max_digits10 = decimals + 3;
  static constexpr int max_exponent = decimals == 50 ? 2147483311 : 2147482979, min_exponent = decimals == 50 ? -2147483312 : -2147482980;
  static Number epsilon() { return ldexp(Number(1), 1 - digits); }
  static Number min() { return ldexp(Number(1), min_exponent - 1); }
  static Number max() { return ldexp(Number(1) - ldexp(Number(1), -digits), max_exponent); }
  static Number lowest() { return -max(); }
  static Number infinity() { return Number(std::numeric_limits<double>::infinity()); }
  static Number quiet_NaN() { return Number(std::numeric_limits<double>::quiet_NaN()); }
};

#if !defined(PYCRAFT_FLOAT128)
// To Boost's own quad they are no numbers whose parts it could take: they convert by themselves.
template <unsigned decimals>
struct boost::multiprecision::number_category<pycraft::Digits<decimals>> : std::integral_constant<int, boost::multiprecision::number_kind_unknown> {};
#endif
