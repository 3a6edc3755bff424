// A number that writes down on a tape what is done to it, in the place of Lanes: kernels run on it as they are.
#pragma once

#include "kernels/links.h"
#include "lanes/lanes.h"
#include "lanes/sine_cosine.h"
#include "lanes/tape.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

struct Truth {
  int id;
};

// The recording in progress: the tape, and where the inputs lie that kernels read by their addresses alone.
struct Recording {
  Tape& tape;
  const States<double>& at;
  int nq, nv;
  int put(Does does, int first, int second = 0, double number = 0) {
    tape.operations.push_back({does, first, second, 0, number});
    return static_cast<int>(tape.operations.size()) - 1;
  }
};
inline thread_local Recording* recording = nullptr;

struct Number {
  using Scalar = double;
  using Bits = Truth;
  static constexpr bool recorded = true;  // its truths are not known yet
  static constexpr int width = 2;  // results leave by scattered() alone, though there is one state
  alignas(double) int id;  // room for arrays of it is counted in doubles

  Number() = default;
  Number(double x) : id(x == 0 ? 0 : recording->put(Does::number, 0, 0, x)) {}
  static Number by(Does does, Number a, Number b = Number(0.0)) {
    Number made;
    made.id = recording->put(does, a.id, b.id);
    return made;
  }
  double lane(int) const { return id; }

  friend Number operator+(Number a, Number b) { return by(Does::add, a, b); }
  friend Number operator-(Number a, Number b) { return by(Does::subtract, a, b); }
  friend Number operator*(Number a, Number b) { return by(Does::multiply, a, b); }
  friend Number operator/(Number a, Number b) { return by(Does::divide, a, b); }
  friend Number operator-(Number a) { return by(Does::negate, a); }
  Number& operator+=(Number b) { return *this = *this + b; }
  Number& operator-=(Number b) { return *this = *this - b; }
  Number& operator*=(Number b) { return *this = *this * b; }

  static Truth all() { return {-1}; }
  friend Truth greater(Number a, Number b) { return {by(Does::greater, a, b).id}; }
  static unsigned mask(Truth truth) {
    recording->tape.guards.clear();
    if (truth.id >= 0) recording->tape.guards.push_back({truth.id, true});
    return ~0u;
  }
};
inline Truth operator&(Truth a, Truth b) {
  if (a.id < 0) return b;
  return b.id < 0 ? a : Truth{recording->put(Does::both, a.id, b.id)};
}
inline Number magnitude(Number a) { return Number::by(Does::magnitude, a); }
inline Number larger(Number a, Number b) { return Number::by(Does::larger, a, b); }
inline SineCosine<Number> sine_cosine(const Number& x) { return {Number::by(Does::sine, x), Number::by(Does::cosine, x)}; }

// An input is known by where it lies, a result by its operation, written in its place.
template <>
inline Number gathered<Number>(const double* x, size_t, int) {
  const States<double>& at = recording->at;
  Number a;
  if (x >= at.q && x < at.q + recording->nq)
    a.id = recording->put(Does::input, static_cast<int>(x - at.q), 0);
  else if (x >= at.v && x < at.v + recording->nv)
    a.id = recording->put(Does::input, static_cast<int>(x - at.v), 1);
  else
    a.id = recording->put(Does::input, static_cast<int>(x - at.u), 2);
  return a;
}
inline void scattered(const Number& a, double* x, size_t, int) { *x = a.id; }
template <>
inline void raise<Number>(double& x, double by) {
  Number a;
  a.id = static_cast<int>(x);
  x = (a + Number(by)).id;
}

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
