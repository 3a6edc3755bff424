#include "numerics/digits_value.h"

#if defined(PYCRAFT_FLOAT128)
#include <boost/multiprecision/float128.hpp>
#endif

namespace pycraft {

template <unsigned decimals>
Digits<decimals>::Digits() {
  new (bytes_) DigitsValue<decimals>(0);
}
template <unsigned decimals>
Digits<decimals>::Digits(double x) {
  new (bytes_) DigitsValue<decimals>(x);
}
template <unsigned decimals>
Digits<decimals>::Digits(Extended x) {
  new (bytes_) DigitsValue<decimals>(x);
}
template <unsigned decimals>
Digits<decimals>::Digits(const Quad& x) {
  new (bytes_) DigitsValue<decimals>(x);
}
template <unsigned decimals>
template <unsigned others>
  requires(others < decimals)
Digits<decimals>::Digits(const Digits<others>& x) {
  new (bytes_) DigitsValue<decimals>(value_of(x));
}
template <unsigned decimals>
template <unsigned others>
  requires(others > decimals)
Digits<decimals>::Digits(const Digits<others>& x) {
  new (bytes_) DigitsValue<decimals>(value_of(x));
}

template <unsigned decimals>
Digits<decimals>::operator double() const {
  return static_cast<double>(value_of(*this));
}
template <unsigned decimals>
Digits<decimals>::operator Single() const {
  return static_cast<Single>(value_of(*this));
}
template <unsigned decimals>
Digits<decimals>::operator Extended() const {
  return static_cast<Extended>(value_of(*this));
}
template <unsigned decimals>
Digits<decimals>::operator Quad() const {
  return static_cast<Quad>(value_of(*this));
}

#define PYCRAFT_DIGITS(name, parameters, expression)               \
  template <unsigned decimals>                                     \
  Digits<decimals> Digits<decimals>::name parameters {             \
    return digits_of<decimals>(DigitsValue<decimals>(expression)); \
  }
PYCRAFT_DIGITS(sum, (const Digits& a, const Digits& b), value_of(a) + value_of(b))
PYCRAFT_DIGITS(difference, (const Digits& a, const Digits& b), value_of(a) - value_of(b))
PYCRAFT_DIGITS(product, (const Digits& a, const Digits& b), value_of(a) * value_of(b))
PYCRAFT_DIGITS(quotient, (const Digits& a, const Digits& b), value_of(a) / value_of(b))
PYCRAFT_DIGITS(negative, () const, -value_of(*this))
PYCRAFT_DIGITS(magnitude, () const, abs(value_of(*this)))
PYCRAFT_DIGITS(root, () const, sqrt(value_of(*this)))
PYCRAFT_DIGITS(sine, () const, sin(value_of(*this)))
PYCRAFT_DIGITS(cosine, () const, cos(value_of(*this)))
PYCRAFT_DIGITS(exponential, () const, exp(value_of(*this)))
PYCRAFT_DIGITS(logarithm, () const, log(value_of(*this)))
PYCRAFT_DIGITS(decimal_logarithm, () const, log10(value_of(*this)))
PYCRAFT_DIGITS(power, (const Digits& b) const, pow(value_of(*this), value_of(b)))
PYCRAFT_DIGITS(angle, (const Digits& x) const, atan2(value_of(*this), value_of(x)))
PYCRAFT_DIGITS(whole, () const, floor(value_of(*this)))
PYCRAFT_DIGITS(scaled, (int n) const, ldexp(value_of(*this), n))
PYCRAFT_DIGITS(fraction, (int& n) const, frexp(value_of(*this), &n))
#undef PYCRAFT_DIGITS

template <unsigned decimals>
bool Digits<decimals>::less(const Digits& a, const Digits& b) {
  return value_of(a) < value_of(b);
}
template <unsigned decimals>
bool Digits<decimals>::at_most(const Digits& a, const Digits& b) {
  return value_of(a) <= value_of(b);
}
template <unsigned decimals>
bool Digits<decimals>::equal(const Digits& a, const Digits& b) {
  return value_of(a) == value_of(b);
}
template <unsigned decimals>
bool Digits<decimals>::finite() const {
  return isfinite(value_of(*this));
}

template class Digits<50>;
template class Digits<100>;
template Digits<100>::Digits(const Digits<50>& x);
template Digits<50>::Digits(const Digits<100>& x);

template <unsigned decimals>
constexpr bool limits_are_those_of_the_value = std::numeric_limits<Digits<decimals>>::digits == std::numeric_limits<DigitsValue<decimals>>::digits &&
                                               std::numeric_limits<Digits<decimals>>::max_exponent == std::numeric_limits<DigitsValue<decimals>>::max_exponent &&
                                               std::numeric_limits<Digits<decimals>>::min_exponent == std::numeric_limits<DigitsValue<decimals>>::min_exponent;
static_assert(limits_are_those_of_the_value<50> && limits_are_those_of_the_value<100>);

}  // namespace pycraft
