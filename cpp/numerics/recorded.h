// A number that carries its value at one state and writes down on a tape what becomes of it (lanes/tape.h): a scalar to the whole engine, which
// so leaves behind what it does, to be done again at other states.
//
// Constants fold, as they would be computed; sums with zero and products with zero and one are left out, equal operations are one. A comparison
// is decided by the values and leaves a guard: what is on the tape holds where it comes out the same. What asks less than that says so
// (decisions.h).
#pragma once

#include <cmath>
#include <limits>
#include <type_traits>

#include "lanes/tape.h"
#include "numerics/decisions.h"
#include "numerics/turns.h"

namespace pycraft {

struct Recorded {
  double value;
  int id;  // of the operation that it comes from; 0: a constant

  Recorded() = default;
  Recorded(double x, int operation = 0) : value(x), id(operation) {}
  template <class U>
    requires(std::numeric_limits<U>::is_specialized && !std::is_same_v<U, double> && !std::is_same_v<U, Recorded>)
  Recorded(U x) : Recorded(static_cast<double>(x)) {}
  bool is_constant() const { return id == 0; }
  // What hangs on the plain value is on no tape: from then on it is not to be trusted.
  explicit operator double() const;

  Recorded& operator+=(const Recorded& b) { return *this = *this + b; }
  Recorded& operator-=(const Recorded& b) { return *this = *this - b; }
  Recorded& operator*=(const Recorded& b) { return *this = *this * b; }
  Recorded& operator/=(const Recorded& b) { return *this = *this / b; }
  friend Recorded operator+(const Recorded& a, const Recorded& b);
  friend Recorded operator-(const Recorded& a, const Recorded& b);
  friend Recorded operator*(const Recorded& a, const Recorded& b);
  friend Recorded operator/(const Recorded& a, const Recorded& b);
  friend Recorded operator-(const Recorded& a);
  friend bool operator<(const Recorded& a, const Recorded& b) { return b > a; }
  friend bool operator>(const Recorded& a, const Recorded& b);
  friend bool operator<=(const Recorded& a, const Recorded& b) { return b >= a; }
  friend bool operator>=(const Recorded& a, const Recorded& b);
  friend bool operator==(const Recorded& a, const Recorded& b);

  friend Recorded sin(const Recorded& a);
  friend Recorded cos(const Recorded& a);
  friend TurnSines<Recorded> turn_sines(const Recorded& angle);
  friend Recorded sqrt(const Recorded& a);
  friend Recorded log(const Recorded& a);
  friend Recorded log10(const Recorded& a) { return Recorded(std::log10(static_cast<double>(a))); }
  friend Recorded abs(const Recorded& a);
  friend Recorded ldexp(const Recorded& a, int n);
  // a b + c, rounded once where the instruction set can.
  friend Recorded fused(const Recorded& a, const Recorded& b, const Recorded& c);
  // ---- decisions.h
  friend Recorded maximum(const Recorded& a, const Recorded& b);
  friend Recorded ratio_or_zero(const Recorded& a, const Recorded& b);
  friend Recorded where_less(const Recorded& a, const Recorded& b, const Recorded& then, const Recorded& otherwise);
  friend Recorded larger_or_odd(const Recorded& a, const Recorded& b);
  friend bool vanishes(const Recorded& a) { return a.is_constant() && a.value == 0; }
  friend bool is_finite(const Recorded& a);
  friend Recorded split(const Recorded& x, Recorded& exponent);
  friend double soft(const Recorded& a);
  friend void off_tape(const Recorded& a);
};

template <>
Recorded of_state<Recorded>(double x, int array, int i);

// What is being written down in this thread.
class Recording {
 public:
  // Throws OffTape beyond so many operations.
  explicit Recording(size_t most);
  ~Recording();
  Recording(const Recording&) = delete;
  struct OffTape {};
  static Recording* current();

  Recorded input(double value, int array, int entry);
  // Numbers of states are inputs of arrays `first` and first + 1 from now on; -1: constants.
  void take_states_from(int first) { states_from_ = first; }
  int states_from() const { return states_from_; }
  void result(int entry, const Recorded& x);
  void require(int truth, bool holds);
  void require_finite(const Recorded& x);
  void distrust() { trusted_ = false; }
  // Whether the tape holds wherever its guards do.
  bool trusted() const { return trusted_; }
  const kernels::Tape& tape() const { return tape_; }

  // The operation, an older one where it comes to the same.
  int put(kernels::Does does, int first, int second = 0, int third = 0, double number = 0);
  int place_of(const Recorded& x) { return x.is_constant() ? constant(x.value) : x.id; }

 private:
  int constant(double x);
  void grow();
  kernels::Tape tape_;
  std::vector<int> table_;  // operations by what they are; 0: none
  std::vector<char> required_;  // by operation: as a guard that holds, that does not, finite
  size_t most_;
  int states_from_ = -1;
  bool trusted_ = true;
  Recording* outer_;
};

}  // namespace pycraft

template <>
struct std::numeric_limits<pycraft::Recorded> : std::numeric_limits<double> {};
