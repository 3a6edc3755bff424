// Numbers as functions of time, with their first two derivatives: what prescribes a motion, drives an actuator, pushes a node.
//
// constant             the same at every time
// piecewise polynomial  a spline, a table (linear between its points); before the first time and after the last it stays where it is; at a time
//                       between two pieces it is the later one, at the last the last one
// harmonic             offset + amplitude sin(2π f t + phase)
//
// Others derive from FunctionOfTime, or from InDoubles where they know no wider scalar.
#pragma once

#include <memory>
#include <vector>

#include "numerics/scalar.h"

namespace pycraft {

// A time at which it goes over from one expression to another, and what jumps there by more than rounding.
struct Knot {
  double t;
  bool values_jump = false, rates_jump = false;
};

class FunctionOfTime {
 public:
  virtual ~FunctionOfTime() = default;
  virtual int size() const = 0;  // how many numbers
  virtual bool constant() const { return false; }
  virtual bool foreign() const { return false; }  // whether it is written outside of the core: what it gives is looked at
  virtual std::vector<Knot> knots() const { return {}; }  // rising
  // Values, rates and second derivatives, so many numbers each; null: not asked for.
  virtual void at(double t, double* value, double* rate, double* second) const = 0;
  virtual void at(const Extended& t, Extended* value, Extended* rate, Extended* second) const = 0;
  virtual void at(const Quad& t, Quad* value, Quad* rate, Quad* second) const = 0;
};
using TimeFunction = std::shared_ptr<const FunctionOfTime>;

// Known in doubles alone.
class InDoubles : public FunctionOfTime {
 public:
  using FunctionOfTime::at;
  void at(const Extended& t, Extended* value, Extended* rate, Extended* second) const override { widen(t, value, rate, second); }
  void at(const Quad& t, Quad* value, Quad* rate, Quad* second) const override { widen(t, value, rate, second); }

 private:
  template <class S>
  void widen(const S& t, S* value, S* rate, S* second) const {
    std::vector<double> all(size_t(3) * size());
    double* const to[] = {all.data(), all.data() + size(), all.data() + 2 * size()};
    at(to_double(t), value ? to[0] : nullptr, rate ? to[1] : nullptr, second ? to[2] : nullptr);
    S* const given[] = {value, rate, second};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; given[i] && j < size(); ++j) given[i][j] = S(to[i][j]);
  }
};

TimeFunction constant_in_time(std::vector<double> values);
// Polynomials between neighbours of `breaks`, which rise: coefficients (order + 1, breaks - 1, size) of falling powers of t - breaks[i].
// ModelError for breaks out of order and numbers that do not fit or are not finite.
TimeFunction piecewise_polynomial(std::vector<double> breaks, std::vector<double> coefficients, int size);
// offset + amplitude sin(2π frequency t + phase), frequency in Hz, phase in rad, number by number: as many of each.
TimeFunction harmonic(std::vector<double> amplitude, std::vector<double> frequency, std::vector<double> phase, std::vector<double> offset);

// The values at t in the scalar of an effect.
template <class S>
inline void values_at(const FunctionOfTime& f, const S& t, S* value, S* rate = nullptr, S* second = nullptr) {
  if constexpr (requires { t.d; }) {  // with derivatives, of which time has none
    const int n = f.size();
    std::vector<double> of(size_t(3) * n);
    f.at(to_double(t), of.data(), of.data() + n, of.data() + 2 * n);
    S* const given[] = {value, rate, second};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; given[i] && j < n; ++j) given[i][j] = S(of[i * n + j]);
  } else {
    f.at(t, value, rate, second);
  }
}

}  // namespace pycraft
