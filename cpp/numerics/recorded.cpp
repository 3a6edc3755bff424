#include "numerics/recorded.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "lanes/lane_sets.h"
#include "runtime/errors.h"

namespace pycraft {

using kernels::Does;
using kernels::Operation;

namespace {

thread_local Recording* recording = nullptr;

Recording& now() {
  if (!recording) throw EvaluationError("a recorded number outlived its recording");
  return *recording;
}
bool is(const Recorded& a, double x) { return a.is_constant() && a.value == x; }
// Whose reciprocal is one, too.
bool is_power_of_two(double x) {
  int n;
  return std::abs(std::frexp(x, &n)) == 0.5 && std::abs(n) < 1000;
}
Does does(const Recorded& a) { return a.is_constant() ? Does::number : now().tape().operations[a.id].does; }
// Of -b: b.
Recorded opposite(const Recorded& a) { return {-a.value, now().tape().operations[a.id].first}; }
bool is_opposite(const Recorded& a) { return does(a) == Does::negate; }

Recorded by(Does what, double value, const Recorded& a) { return {value, now().put(what, now().place_of(a))}; }
Recorded by(Does what, double value, const Recorded& a, const Recorded& b) { return {value, now().put(what, now().place_of(a), now().place_of(b))}; }
// 0 of a finite number.
Recorded zero_of(const Recorded& a) {
  if (!a.is_constant()) now().require_finite(a);
  return std::isfinite(a.value) ? 0.0 : 0.0 * a.value;
}

bool decided(Does what, bool value, const Recorded& a, const Recorded& b) {
  if (a.is_constant() && b.is_constant()) return value;
  now().require(by(what, value, a, b).id, value);
  return value;
}

std::uint64_t hash_of(const Operation& o) {
  std::uint64_t bits;
  std::memcpy(&bits, &o.number, sizeof bits);
  std::uint64_t h = (std::uint64_t(o.first) << 32 | std::uint32_t(o.second)) * 0x9e3779b97f4a7c15u;
  h ^= (std::uint64_t(o.third) << 8 | std::uint64_t(o.does)) * 0xc2b2ae3d27d4eb4fu ^ bits * 0x165667b19e3779f9u;
  return h ^ h >> 29;
}
bool alike(const Operation& a, const Operation& b) {
  return a.does == b.does && a.first == b.first && a.second == b.second && a.third == b.third && std::memcmp(&a.number, &b.number, sizeof(double)) == 0;
}

}  // namespace

// ------------------------------------------------------------------ the recording

Recording::Recording(size_t most) : table_(1024, 0), most_(most), outer_(recording) { recording = this; }
Recording::~Recording() { recording = outer_; }
Recording* Recording::current() { return recording; }

int Recording::put(Does does, int first, int second, int third, double number) {
  const Operation o{does, first, second, third, number};
  const size_t mask = table_.size() - 1;
  size_t at = hash_of(o) & mask;
  for (; table_[at]; at = (at + 1) & mask)
    if (alike(tape_.operations[table_[at]], o)) return table_[at];
  if (tape_.operations.size() >= most_) throw OffTape();
  const int made = static_cast<int>(tape_.operations.size());
  tape_.operations.push_back(o);
  table_[at] = made;
  if (2 * tape_.operations.size() > table_.size()) grow();
  return made;
}

void Recording::grow() {
  table_.assign(4 * table_.size(), 0);
  const size_t mask = table_.size() - 1;
  for (size_t i = 1; i < tape_.operations.size(); ++i) {
    size_t at = hash_of(tape_.operations[i]) & mask;
    while (table_[at]) at = (at + 1) & mask;
    table_[at] = static_cast<int>(i);
  }
}

int Recording::constant(double x) { return x == 0 ? 0 : put(Does::number, 0, 0, 0, x); }

Recorded Recording::input(double value, int array, int entry) { return {value, put(Does::input, entry, array)}; }
void Recording::result(int entry, const Recorded& x) { tape_.results.push_back({entry, place_of(x)}); }

// Once of each.
void Recording::require(int truth, bool holds) {
  required_.resize(std::max(required_.size(), tape_.operations.size()));
  if (required_[truth] & (holds ? 1 : 2)) return;
  required_[truth] |= holds ? 1 : 2;
  tape_.guards.push_back({truth, holds});
}
void Recording::require_finite(const Recorded& x) {
  required_.resize(std::max(required_.size(), tape_.operations.size()));
  if (required_[x.id] & 4) return;
  required_[x.id] |= 4;
  tape_.finite.push_back(x.id);
}

template <>
Recorded of_state<Recorded>(double x, int array, int i) {
  Recording* const r = Recording::current();
  return r && r->states_from() >= 0 ? r->input(x, r->states_from() + array, i) : Recorded(x);
}

// ------------------------------------------------------------------ arithmetic

Recorded::operator double() const {
  if (!is_constant()) now().distrust();
  return value;
}

// x - y instead of x + -y, and so on: a sign goes outward.
Recorded operator+(const Recorded& a, const Recorded& b) {
  if (a.is_constant() && b.is_constant()) return a.value + b.value;
  if (is(a, 0)) return b;
  if (is(b, 0)) return a;
  if (is_opposite(b)) return a - opposite(b);
  if (is_opposite(a)) return b - opposite(a);
  return a.id > b.id ? by(Does::add, a.value + b.value, b, a) : by(Does::add, a.value + b.value, a, b);
}
Recorded operator-(const Recorded& a, const Recorded& b) {
  if (a.is_constant() && b.is_constant()) return a.value - b.value;
  if (is(a, 0)) return -b;
  if (is(b, 0)) return a;
  if (is_opposite(b)) return a + opposite(b);
  if (is_opposite(a)) return -(opposite(a) + b);
  if (a.id == b.id) return zero_of(a);
  return by(Does::subtract, a.value - b.value, a, b);
}
Recorded operator*(const Recorded& a, const Recorded& b) {
  if (a.is_constant() && b.is_constant()) return a.value * b.value;
  if (b.is_constant()) return b * a;
  if (is(a, 0)) return zero_of(b);
  if (is(a, 1)) return b;
  if (is(a, -1)) return -b;
  if (is_opposite(b)) return -(a * opposite(b));
  if (is_opposite(a)) return -(opposite(a) * b);
  return a.id > b.id ? by(Does::multiply, a.value * b.value, b, a) : by(Does::multiply, a.value * b.value, a, b);
}
Recorded operator/(const Recorded& a, const Recorded& b) {
  if (a.is_constant() && b.is_constant()) return a.value / b.value;
  if (b.is_constant() && is_power_of_two(b.value)) return 1 / b.value * a;
  if (is(a, 0)) return zero_of(by(Does::divide, 1 / b.value, 1.0, b));
  if (is_opposite(a)) return -(opposite(a) / b);
  if (is_opposite(b)) return -(a / opposite(b));
  return by(Does::divide, a.value / b.value, a, b);
}
Recorded operator-(const Recorded& a) {
  if (a.is_constant()) return -a.value;
  if (is_opposite(a)) return opposite(a);
  return by(Does::negate, -a.value, a);
}
Recorded fused(const Recorded& a, const Recorded& b, const Recorded& c) {
  const double value = kernels::lane_set().functions.fuses ? std::fma(a.value, b.value, c.value) : a.value * b.value + c.value;
  if (a.is_constant() && b.is_constant() && c.is_constant()) return value;
  if (b.is_constant() && !a.is_constant()) return fused(b, a, c);
  if (is(a, 0)) return zero_of(b) + c;
  if (is(a, 1)) return b + c;
  if (is(a, -1)) return c - b;
  if (is(c, 0)) return a * b;
  if (is_opposite(c)) return -fused(-a, b, opposite(c));
  // a sign, if any, stays with the first
  const bool less = is_opposite(a) != is_opposite(b);
  Recorded x = is_opposite(a) ? opposite(a) : a, y = is_opposite(b) ? opposite(b) : b;
  if (!x.is_constant() && x.id > y.id) std::swap(x, y);
  return {value, now().put(Does::fused, now().place_of(less ? -x : x), now().place_of(y), now().place_of(c))};
}

// ------------------------------------------------------------------ functions

Recorded sin(const Recorded& a) { return a.is_constant() ? Recorded(std::sin(a.value)) : by(Does::sine, std::sin(a.value), a); }
Recorded cos(const Recorded& a) { return a.is_constant() ? Recorded(std::cos(a.value)) : by(Does::cosine, std::cos(a.value), a); }
TurnSines<Recorded> turn_sines(const Recorded& angle) {
  if (!angle.is_constant()) return {cos(angle), sin(angle), sin(angle / Recorded(2))};
  const TurnSines<double> of = turn_sines(angle.value);
  return {of.cosine, of.sine, of.sine_of_half};
}
Recorded sqrt(const Recorded& a) { return a.is_constant() ? Recorded(std::sqrt(a.value)) : by(Does::root, std::sqrt(a.value), a); }
Recorded log(const Recorded& a) { return a.is_constant() ? Recorded(std::log(a.value)) : by(Does::logarithm, std::log(a.value), a); }
Recorded abs(const Recorded& a) {
  if (a.is_constant()) return std::abs(a.value);
  if (does(a) == Does::magnitude) return a;
  return by(Does::magnitude, std::abs(a.value), is_opposite(a) ? opposite(a) : a);
}
Recorded ldexp(const Recorded& a, int n) {
  if (a.is_constant()) return std::ldexp(a.value, n);
  if (n < std::numeric_limits<double>::min_exponent || n >= std::numeric_limits<double>::max_exponent) now().distrust();
  return std::ldexp(1.0, n) * a;
}
Recorded split(const Recorded& x, Recorded& exponent) {
  int n = 0;
  const double fraction = std::frexp(x.value, &n);
  exponent = x.is_constant() ? Recorded(n) : by(Does::exponent, n, x);
  return x.is_constant() ? Recorded(fraction) : by(Does::fraction, fraction, x);
}

// ------------------------------------------------------------------ decisions

bool operator>(const Recorded& a, const Recorded& b) { return decided(Does::greater, a.value > b.value, a, b); }
bool operator>=(const Recorded& a, const Recorded& b) { return decided(Does::at_least, a.value >= b.value, a, b); }
bool operator==(const Recorded& a, const Recorded& b) { return decided(Does::equal, a.value == b.value, a, b); }

Recorded maximum(const Recorded& a, const Recorded& b) {
  const double value = a.value < b.value ? b.value : a.value;
  if (a.is_constant() && b.is_constant()) return value;
  if (a.id == b.id || (is(b, 0) && does(a) == Does::magnitude)) return a;
  if (is(a, 0) && does(b) == Does::magnitude) return b;
  return by(Does::larger, value, a, b);
}
Recorded ratio_or_zero(const Recorded& a, const Recorded& b) { return b == Recorded(0) ? Recorded(0) : a / b; }
Recorded where_less(const Recorded& a, const Recorded& b, const Recorded& then, const Recorded& otherwise) {
  const bool less = a.value < b.value;
  if (a.is_constant() && b.is_constant()) return less ? then : otherwise;
  const int truth = by(Does::greater, less, b, a).id;
  return {less ? then.value : otherwise.value, now().put(Does::choose, truth, now().place_of(then), now().place_of(otherwise))};
}
Recorded larger_or_odd(const Recorded& a, const Recorded& b) {
  const bool at_most = b.value <= a.value;
  if (a.is_constant() && b.is_constant()) return at_most ? a : b;
  return {at_most ? a.value : b.value, now().put(Does::choose, by(Does::at_least, at_most, a, b).id, now().place_of(a), now().place_of(b))};
}
bool is_finite(const Recorded& a) {
  if (!a.is_constant()) now().require_finite(a);
  return std::isfinite(a.value);
}
double soft(const Recorded& a) { return a.value; }
void off_tape(const Recorded&) { throw Recording::OffTape(); }

}  // namespace pycraft
