#include "simulation/function_of_time.h"

#include <algorithm>
#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// What is a template of the scalar, as a function of time.
template <class Own>
class InAnyScalar : public FunctionOfTime {
 public:
  void at(double t, double* value, double* rate, double* second) const override { own().find(t, value, rate, second); }
  void at(const Extended& t, Extended* value, Extended* rate, Extended* second) const override { own().find(t, value, rate, second); }
  void at(const Quad& t, Quad* value, Quad* rate, Quad* second) const override { own().find(t, value, rate, second); }

 private:
  const Own& own() const { return static_cast<const Own&>(*this); }
};

class Constant : public InAnyScalar<Constant> {
 public:
  explicit Constant(std::vector<double> values) : values_(std::move(values)) {}
  int size() const override { return static_cast<int>(values_.size()); }
  bool constant() const override { return true; }
  template <class S>
  void find(const S&, S* value, S* rate, S* second) const {
    for (size_t j = 0; j < values_.size(); ++j) {
      if (value) value[j] = S(values_[j]);
      if (rate) rate[j] = S(0);
      if (second) second[j] = S(0);
    }
  }

 private:
  std::vector<double> values_;
};

class PiecewisePolynomial : public InAnyScalar<PiecewisePolynomial> {
 public:
  PiecewisePolynomial(std::vector<double> breaks, std::vector<double> coefficients, int size) : breaks_(std::move(breaks)), c_(std::move(coefficients)), size_(size) {
    pieces_ = static_cast<int>(breaks_.size()) - 1;
    order_ = static_cast<int>(c_.size()) / (pieces_ * size_) - 1;
  }
  int size() const override { return size_; }
  std::vector<Knot> knots() const override {
    std::vector<Knot> all;
    for (size_t i = 0; i < breaks_.size(); ++i) all.push_back({breaks_[i], jumps(i, 0), jumps(i, 1)});
    return all;
  }
  // Horner's scheme, with its derivatives.
  template <class S>
  void find(const S& t, S* value, S* rate, S* second) const {
    const bool before = S(breaks_.front()) > t, after = t > S(breaks_.back());
    const S held = before ? S(breaks_.front()) : after ? S(breaks_.back()) : t;
    const auto next = std::upper_bound(breaks_.begin(), breaks_.end(), held, [](const S& x, double b) { return S(b) > x; });
    const int i = std::clamp(static_cast<int>(next - breaks_.begin()) - 1, 0, pieces_ - 1);
    const S s = held - S(breaks_[i]), moving = before || after ? S(0) : S(1);
    for (int j = 0; j < size_; ++j) {
      S y = S(0), d = S(0), half = S(0);
      for (int m = 0; m <= order_; ++m) {
        half = half * s + d;
        d = d * s + y;
        y = y * s + S(c_[(size_t(m) * pieces_ + i) * size_ + j]);
      }
      if (value) value[j] = y;
      if (rate) rate[j] = moving * d;
      if (second) second[j] = moving * S(2) * half;
    }
  }

 private:
  // Whether a derivative of this order, 0 or 1, differs on both sides of break i by more than what its terms are rounded to: sums of order_ + 1
  // terms, whose coefficients are rounded sums of values and slopes themselves, at a time that is known to ε of the breaks, so that 64 ε of the
  // sizes of all these are none.
  bool jumps(size_t i, int derivative) const {
    for (int j = 0; j < size_; ++j) {
      double sides[2] = {0, 0}, sizes = 0;
      for (int side = 0; side < 2; ++side) {
        const bool held = side == 0 ? i == 0 : i + 1 == breaks_.size();
        if (held && derivative == 1) continue;
        const int piece = static_cast<int>(i) - ((side == 0) != held ? 1 : 0);
        const double s = piece == static_cast<int>(i) ? 0 : breaks_[i] - breaks_[i - 1];
        double power = 1;
        for (int m = order_ - derivative; m >= 0; --m, power *= s) {
          const double term = (derivative == 1 ? order_ - m : 1) * c_[(size_t(m) * pieces_ + piece) * size_ + j] * power;
          sides[side] += term, sizes += std::abs(term);
          const int left = order_ - derivative - m;  // of its rate: the power of the term
          if (left > 0 && s > 0) sizes += left * std::abs(term) / s * (std::abs(breaks_[i]) + std::abs(breaks_[i - 1]));
        }
      }
      if (std::abs(sides[1] - sides[0]) > 64 * epsilon<double>() * sizes) return true;
    }
    return false;
  }
  std::vector<double> breaks_, c_;
  int size_, pieces_, order_;
};

class Harmonic : public InAnyScalar<Harmonic> {
 public:
  Harmonic(std::vector<double> amplitude, std::vector<double> frequency, std::vector<double> phase, std::vector<double> offset)
      : amplitude_(std::move(amplitude)), frequency_(std::move(frequency)), phase_(std::move(phase)), offset_(std::move(offset)) {}
  int size() const override { return static_cast<int>(amplitude_.size()); }
  template <class S>
  void find(const S& t, S* value, S* rate, S* second) const {
    using std::cos, std::sin, std::atan2;
    const S half_turn = atan2(S(0), S(-1));
    for (size_t j = 0; j < amplitude_.size(); ++j) {
      const S w = S(2) * S(frequency_[j]) * half_turn, angle = w * t + S(phase_[j]), a(amplitude_[j]);
      if (value) value[j] = S(offset_[j]) + a * sin(angle);
      if (rate) rate[j] = a * w * cos(angle);
      if (second) second[j] = -(a * w * w) * sin(angle);
    }
  }

 private:
  std::vector<double> amplitude_, frequency_, phase_, offset_;
};

void require_finite_numbers(const std::vector<double>& x, const char* what) {
  for (double y : x)
    if (!std::isfinite(y)) throw ModelError(std::string(what) + " of a function of time has an entry that is " + short_number(y));
}

}  // namespace

TimeFunction constant_in_time(std::vector<double> values) {
  require_finite_numbers(values, "the constant");
  return std::make_shared<Constant>(std::move(values));
}

TimeFunction piecewise_polynomial(std::vector<double> breaks, std::vector<double> coefficients, int size) {
  require_finite_numbers(breaks, "a time");
  require_finite_numbers(coefficients, "a value");
  if (breaks.size() < 2 || size < 1) throw ModelError("a function of time between points takes two times at least");
  for (size_t i = 1; i < breaks.size(); ++i)
    if (!(breaks[i] > breaks[i - 1]))
      throw ModelError("times of a function of time rise; entry " + std::to_string(i) + " is " + short_number(breaks[i]) + " s after " + short_number(breaks[i - 1]) + " s");
  const size_t row = (breaks.size() - 1) * static_cast<size_t>(size);
  if (coefficients.empty() || coefficients.size() % row) throw ModelError("a function of time of " + std::to_string(breaks.size()) + " times has other numbers of values");
  return std::make_shared<PiecewisePolynomial>(std::move(breaks), std::move(coefficients), size);
}

TimeFunction harmonic(std::vector<double> amplitude, std::vector<double> frequency, std::vector<double> phase, std::vector<double> offset) {
  for (const auto* part : {&amplitude, &frequency, &phase, &offset}) {
    require_finite_numbers(*part, "a number");
    if (part->size() != amplitude.size() || part->empty()) throw ModelError("a harmonic function of time has as many amplitudes, frequencies, phases and offsets");
  }
  return std::make_shared<Harmonic>(std::move(amplitude), std::move(frequency), std::move(phase), std::move(offset));
}

}  // namespace pycraft
