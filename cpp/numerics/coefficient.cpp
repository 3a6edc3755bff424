#include "numerics/coefficient.h"

#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/multiprecision/cpp_int.hpp>
#include <charconv>
#include <limits>

#include "runtime/errors.h"

namespace pycraft {

namespace {

using Whole = boost::multiprecision::cpp_int;
using Ratio = boost::multiprecision::cpp_rational;

// Numbers longer than this are cut to most_kept bits, thousands beyond any run: a product of a million coefficients stays affordable.
constexpr unsigned most_bits = 8192, most_kept = 4096;

// Below this the error of a product, as fma gives it, may itself be lost.
constexpr double smallest_sure = 1e-280;

Ratio ratio_of(double x) {
  int exponent = 0;
  const double mantissa = std::frexp(x, &exponent);
  const Whole whole(static_cast<long long>(std::ldexp(mantissa, 53)));
  exponent -= 53;
  return exponent >= 0 ? Ratio(whole << exponent) : Ratio(whole, Whole(1) << -exponent);
}

int bits_of(const Whole& x) { return x.is_zero() ? 0 : static_cast<int>(msb(x.sign() < 0 ? Whole(-x) : x)) + 1; }

// x ≈ 2^e with 2^(e-1) < |x| < 2^(e+1).
int exponent_of(const Ratio& x) { return bits_of(numerator(x)) - bits_of(denominator(x)); }

// x 2^shift rounded to the nearest whole number, ties to even.
Whole rounded(const Ratio& x, int shift) {
  Whole above = numerator(x), below = denominator(x);
  if (shift >= 0)
    above <<= shift;
  else
    below <<= -shift;
  const bool negative = above.sign() < 0;
  if (negative) above = -above;
  Whole quotient, rest;
  divide_qr(above, below, quotient, rest);
  const Whole twice = rest * 2;
  if (twice > below || (twice == below && bit_test(quotient, 0))) ++quotient;
  return negative ? Whole(-quotient) : quotient;
}

double nearest_double(const Ratio& x) {
  if (x.is_zero()) return 0;
  int e = exponent_of(x);
  const int lowest = std::numeric_limits<double>::min_exponent - 1 - 52;  // the last bit of the smallest normal numbers
  for (int last = std::max(e - 54, lowest);; ++last) {
    const Whole whole = rounded(x, -last);
    if (bits_of(whole) > 53 && !(bits_of(whole) == 54 && abs(whole) == (Whole(1) << 53))) continue;
    if (bits_of(whole) + last > std::numeric_limits<double>::max_exponent) return x.sign() < 0 ? -INFINITY : INFINITY;
    return std::ldexp(static_cast<double>(whole), last);
  }
}

}  // namespace

struct Coefficient::Exact {
  Ratio value;
  std::array<double, digits> parts{};
  int exponent = 0;
};

const double* Coefficient::parts() const { return exact_->parts.data(); }
int Coefficient::exponent() const { return exact_->exponent; }

Coefficient::Exact Coefficient::exactly(const Coefficient& c) { return c.exact_ ? Exact{c.exact_->value} : Exact{ratio_of(c.value_)}; }

Coefficient Coefficient::of(Exact exact) {
  Ratio& x = exact.value;
  if (static_cast<unsigned>(std::max(bits_of(numerator(x)), bits_of(denominator(x)))) > most_bits) {
    const int shift = static_cast<int>(most_kept) - exponent_of(x);
    const Whole whole = rounded(x, shift);
    x = shift >= 0 ? Ratio(whole, Whole(1) << shift) : Ratio(whole << -shift);
  }
  Coefficient made(nearest_double(x));
  if (std::isfinite(made.value_) && ratio_of(made.value_) == x) return made;
  exact.exponent = exponent_of(x);
  Ratio rest = exact.exponent >= 0 ? Ratio(x / Ratio(Whole(1) << exact.exponent)) : Ratio(x * Ratio(Whole(1) << -exact.exponent));
  for (double& part : exact.parts) {
    part = nearest_double(rest);
    rest -= ratio_of(part);
  }
  made.exact_ = std::make_shared<const Exact>(std::move(exact));
  return made;
}

Coefficient Coefficient::ratio(const std::string& above, const std::string& below) {
  const Whole b(below);
  if (b.is_zero()) throw EvaluationError("a coefficient " + above + "/0 is no number");
  return of({Ratio(Whole(above), b)});
}

Coefficient Coefficient::sum(const std::vector<double>& parts) {
  Ratio total = 0;
  for (double p : parts) {
    if (!std::isfinite(p)) return p;
    total += ratio_of(p);
  }
  return of({total});
}

Coefficient Coefficient::log_of_size(const Coefficient& c) {
  if (!std::isfinite(c.value_) || c.is_zero()) return std::log(std::abs(c.value_));
  // In twice the digits of the widest run.
  using Wide = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<200>, boost::multiprecision::et_off>;
  const Ratio x = abs(exactly(c).value);
  const Wide log_of_x = log(Wide(numerator(x)) / Wide(denominator(x)));
  return of({Ratio(Whole(ldexp(log_of_x, 600)), Whole(1) << 600)});
}

int Coefficient::sign() const { return exact_ ? exact_->value.sign() : (value_ > 0) - (value_ < 0); }

std::pair<std::string, std::string> Coefficient::as_ratio() const {
  const Ratio x = exactly(*this).value;
  return {numerator(x).str(), denominator(x).str()};
}

std::string Coefficient::text() const {
  if (!exact_) {
    char buffer[40];
    for (int shown = 6; shown <= 17; ++shown) {
      std::snprintf(buffer, sizeof buffer, "%.*g", shown, value_);
      if (std::strtod(buffer, nullptr) == value_) break;
    }
    return buffer;
  }
  // The shortest decimal of its nearest double, if that is what it is.
  if (std::isfinite(value_) && value_ != 0) {
    char buffer[40];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value_, std::chars_format::scientific).ptr;
    std::string digits_of(buffer, end);
    const size_t e = digits_of.find('e');
    int power = std::atoi(digits_of.c_str() + e + 1);
    digits_of.resize(e);
    if (const size_t point = digits_of.find('.'); point != std::string::npos) {
      power -= static_cast<int>(digits_of.size() - point - 1);
      digits_of.erase(point, 1);
    }
    Ratio decimal{Whole(digits_of)};
    const Whole ten = pow(Whole(10), static_cast<unsigned>(std::abs(power)));
    decimal = power >= 0 ? Ratio(decimal * Ratio(ten)) : Ratio(decimal / Ratio(ten));
    if (decimal == exact_->value) return Coefficient(value_).text();
  }
  const std::string above = numerator(exact_->value).str(), below = denominator(exact_->value).str();
  if (above.size() + below.size() <= 40) return below == "1" ? above : above + "/" + below;
  return Coefficient(value_).text();
}

Coefficient operator+(const Coefficient& a, const Coefficient& b) {
  if (!a.exact_ && !b.exact_) {
    const double x = a.value_, y = b.value_, sum = x + y, from_y = sum - x;
    if ((x - (sum - from_y)) + (y - from_y) == 0 || !std::isfinite(x) || !std::isfinite(y)) return sum;
  }
  if (!std::isfinite(a.value_) && !a.exact_) return a;
  if (!std::isfinite(b.value_) && !b.exact_) return b;
  return Coefficient::of({Ratio(Coefficient::exactly(a).value + Coefficient::exactly(b).value)});
}

Coefficient operator*(const Coefficient& a, const Coefficient& b) {
  if (!a.exact_ && !b.exact_) {
    const double product = a.value_ * b.value_;
    if (a.value_ == 0 || b.value_ == 0 || !std::isfinite(a.value_) || !std::isfinite(b.value_)) return product;
    if (std::isfinite(product) && std::abs(product) > smallest_sure && std::fma(a.value_, b.value_, -product) == 0) return product;
  }
  if ((!a.exact_ && !std::isfinite(a.value_)) || (!b.exact_ && !std::isfinite(b.value_))) return a.value_ * b.value_;
  return Coefficient::of({Ratio(Coefficient::exactly(a).value * Coefficient::exactly(b).value)});
}

Coefficient operator/(const Coefficient& a, const Coefficient& b) {
  if (b.is_zero() || (!a.exact_ && !std::isfinite(a.value_)) || (!b.exact_ && !std::isfinite(b.value_))) return a.value_ / b.value_;
  if (!a.exact_ && !b.exact_) {
    const double quotient = a.value_ / b.value_;
    if (a.value_ == 0) return quotient;
    if (std::isfinite(quotient) && std::abs(quotient) > smallest_sure && std::abs(a.value_) > smallest_sure && std::fma(quotient, b.value_, -a.value_) == 0) return quotient;
  }
  return Coefficient::of({Ratio(Coefficient::exactly(a).value / Coefficient::exactly(b).value)});
}

Coefficient operator-(const Coefficient& a) {
  if (!a.exact_) return -a.value_;
  Coefficient::Exact opposite = *a.exact_;
  opposite.value = -opposite.value;
  for (double& part : opposite.parts) part = -part;
  Coefficient made(-a.value_);
  made.exact_ = std::make_shared<const Coefficient::Exact>(std::move(opposite));
  return made;
}

bool operator==(const Coefficient& a, const Coefficient& b) {
  if (!a.exact_ || !b.exact_) return !a.exact_ && !b.exact_ && a.value_ == b.value_;
  return a.exact_ == b.exact_ || a.exact_->value == b.exact_->value;
}

}  // namespace pycraft
