// Explicit Runge-Kutta methods by their tableaus, a stage after the other: who finds the rates may do so for several runs at once.
//
//   x(i) = x + Σ_j (a(i,j) h) k(j),   k(i) = f(x(i), t + c(i) h)
//
// Sums go in the order of j, without the a(i,j) that are zero. A method may stop before its last stages (up_to): to judge a step first, or to leave those
// that dense output adds until it is asked for.
// Source: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, Springer 1993, II.1, II.5.
#pragma once

#include <array>
#include <vector>

namespace pycraft {

// Weights of rates, by the numbers of those.
template <class S>
struct Weights {
  int count = 0;
  int of[12] = {};
  S by[12] = {};
  void add(int rate, const S& weight) { of[count] = rate, by[count++] = weight; }
};

// a - b, in the order of the rates.
template <class S>
Weights<S> difference(const Weights<S>& a, const Weights<S>& b) {
  Weights<S> w;
  for (int rate = 0, i = 0, j = 0; i < a.count || j < b.count; ++rate) {
    S by = S(0);
    bool there = false;
    if (i < a.count && a.of[i] == rate) by += a.by[i++], there = true;
    if (j < b.count && b.of[j] == rate) by -= b.by[j++], there = true;
    if (there) w.add(rate, by);
  }
  return w;
}

template <class S>
struct Tableau {
  int stages;
  S nodes[16];
  Weights<S> rows[16], last, error;  // last: of the step, where it is not the last stage's state
  int beyond = 0;                    // stages after those, of dense output alone
};

template <class S>
class Stages {
 public:
  using State = std::vector<S>;
  explicit Stages(const Tableau<S>& tableau) : tableau_(tableau) {}

  // A step of size h from (t, x); known: the first rate is there already. x stays where it is.
  void begin(const State& x, const S& t, const S& h, bool known = false) {
    x_ = &x, t_ = t, h_ = h;
    for (int i = 0; i < tableau_.stages + tableau_.beyond; ++i) k_[i].resize(x.size());
    at_.resize(x.size());
    stage_ = known ? 1 : 0;
    end_ = tableau_.stages;
  }
  // So many stages in all, counted from the first, are gone through next.
  void up_to(int stages) { end_ = stages; }
  // Whether there is a stage left: then its rate is to be found.
  bool next() {
    if (stage_ >= end_) return false;
    if (stage_ > 0) combine(tableau_.rows[stage_], at_);
    ++stage_;
    return true;
  }
  const State& at() const { return stage_ == 1 ? *x_ : at_; }
  S time() const { return stage_ == 1 ? t_ : S(t_ + h_ * tableau_.nodes[stage_ - 1]); }
  State& rate() { return k_[stage_ - 1]; }

  // Of the step: x + h Σ weights k.
  void combine(const Weights<S>& weights, State& out) const { add(weights, x_->data(), out); }
  State& k(int i) { return k_[i]; }
  const State& last() const { return at_; }  // the last stage's
  const Tableau<S>& tableau() const { return tableau_; }
  // h Σ weights k.
  void sum(const Weights<S>& weights, State& out) const {
    out.resize(at_.size());
    add(weights, nullptr, out);
  }

 private:
  void add(const Weights<S>& weights, const S* x, State& out) const {
    S by[12];
    const S* k[12];
    for (int j = 0; j < weights.count; ++j) by[j] = h_ * weights.by[j], k[j] = k_[weights.of[j]].data();
    switch (weights.count) {
      case 1: return add<1>(by, k, x, out);
      case 2: return add<2>(by, k, x, out);
      case 3: return add<3>(by, k, x, out);
      case 4: return add<4>(by, k, x, out);
      case 5: return add<5>(by, k, x, out);
      case 6: return add<6>(by, k, x, out);
      case 7: return add<7>(by, k, x, out);
      case 8: return add<8>(by, k, x, out);
      case 9: return add<9>(by, k, x, out);
      case 10: return add<10>(by, k, x, out);
      case 11: return add<11>(by, k, x, out);
      default: return add<12>(by, k, x, out);
    }
  }
  template <int n>
  static void add(const S* by, const S* const* k, const S* x, State& out) {
    S* const to = out.data();
    const size_t size = out.size();
    S own[n];  // which nothing that is written can be
    const S* from[n];
    for (int j = 0; j < n; ++j) own[j] = by[j], from[j] = k[j];
    if (!x) {
      for (size_t i = 0; i < size; ++i) {
        S y = own[0] * from[0][i];
        for (int j = 1; j < n; ++j) y += own[j] * from[j][i];
        to[i] = y;
      }
      return;
    }
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC ivdep
#endif
    for (size_t i = 0; i < size; ++i) {
      S y = x[i];
      for (int j = 0; j < n; ++j) y += own[j] * from[j][i];
      to[i] = y;
    }
  }

  const Tableau<S>& tableau_;
  const State* x_ = nullptr;
  S t_ = S(0), h_ = S(0);
  std::array<State, 16> k_;
  State at_;
  int stage_ = 0, end_ = 0;
};

}  // namespace pycraft
