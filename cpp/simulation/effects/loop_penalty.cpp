#include "simulation/effects/loop_penalty.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "dynamics/hybrid_dynamics.h"
#include "model/checks.h"
#include "model/configuration.h"
#include "recursions/loop_columns.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"
#include "simulation/effects/model_with_rotors.h"
#include "simulation/selection.h"
#include "simulation/taken_loops.h"

namespace pycraft {

namespace {

constexpr double asks_nothing = 1e-6;  // of a row's entries, by their sizes: below it they are what rounding and the state are off by

template <class S>
class BoundPenalty : public BoundEffect<S> {
 public:
  explicit BoundPenalty(const LoopPenalty& of) : of_(of) {}
  void begin(const HingeTerms& terms) override {
    numbers_ = model_with_rotors<S>(of_.model(), {});
    const LoopPenalty::Springs springs = of_.springs(terms);
    k_.assign(springs.stiffness.begin(), springs.stiffness.end()), c_.assign(springs.damping.begin(), springs.damping.end());
    for (const LoopPenalty::End& end : of_.a) a_.push_back(renormalised<S>(end.pose));
    for (const LoopPenalty::End& end : of_.b) b_.push_back(renormalised<S>(end.pose));
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    for (size_t l = 0; l < of_.loops.loops.size(); ++l) {
      const ResolvedLoop& loop = of_.loops.loops[l];
      find(loop, at);
      const auto lambda = [&](int i) { return -(k_[loop.first_row + i] * residuals_[i] + c_[loop.first_row + i] * rates_[i]); };
      if (loop.loop->is_coupling()) {
        const S along = lambda(0);
        for (size_t i = 0; i < loop.v.size(); ++i) out.generalized[loop.v[i]] += along * slopes_[i];
        continue;
      }
      Vector6<S> F = Vector6<S>::zero();  // on b, in the axes of its end frame
      for (int i = 0; i < loop.rows; ++i) F = F + lambda(i) * buffers_.rows[i].gradient;
      push(of_.b[l].body, b_[l], F, out);
      push(of_.a[l].body, a_[l], S(-1) * force_to_parent(motion_.X, F), out);
    }
  }
  S potential(const At<S>& at) override {
    return sum_over_rows(at, [&](int row, const S& r, const S&) { return k_[row] * r * r / S(2); });
  }
  S power(const At<S>& at, const S&) override {
    return sum_over_rows(at, [&](int row, const S&, const S& rate) { return -(c_[row] * rate * rate); });
  }

 private:
  // r and ṙ of a loop's rows; of a coupling its slopes, of a pair its motion and gradients.
  void find(const ResolvedLoop& loop, const At<S>& at) {
    if (loop.loop->is_coupling()) {
      slopes_.assign(loop.v.size(), S(0));
      S bend;
      residuals_[0] = coupling_row(loop, at.q, static_cast<const S*>(nullptr), buffers_, bend, [&](int i, const S& slope) { slopes_[i] = slope; });
      rates_[0] = S(0);
      for (size_t i = 0; i < loop.v.size(); ++i) rates_[0] += slopes_[i] * at.v[loop.v[i]];
      return;
    }
    motion_ = find_rows(*numbers_, loop, at.q, at.v, MotionPart::velocity, buffers_);
    for (int i = 0; i < loop.rows; ++i) residuals_[i] = buffers_.rows[i].residual, rates_[i] = dot(buffers_.rows[i].gradient, motion_.V);
  }
  template <class F>
  S sum_over_rows(const At<S>& at, F of) {
    S sum = S(0);
    for (const ResolvedLoop& loop : of_.loops.loops) {
      find(loop, at);
      for (int i = 0; i < loop.rows; ++i) sum += of(loop.first_row + i, residuals_[i], rates_[i]);
    }
    return sum;
  }
  static void push(int body, const Pose<S>& end, const Vector6<S>& F, const Forces<S>& out) {
    if (body >= 0) out.wrench[body] = out.wrench[body] + force_to_parent(end, F);
  }

  const LoopPenalty& of_;
  std::shared_ptr<const CompiledModel<S>> numbers_;
  std::vector<S> k_, c_, slopes_;
  std::vector<Pose<S>> a_, b_;
  LoopBuffers<S> buffers_;
  RelativeMotion<S> motion_;
  S residuals_[most_pair_rows], rates_[most_pair_rows];
};

// Rows of one loop that have one spring: those in radians, or in metres; of positions, or of velocities.
int class_of(const ResolvedLoop& loop, int i, bool of_positions) {
  if (loop.loop->is_coupling()) return 0;
  const char* const direction = record_of(loop.loop->pair.kind).rows[i];
  const bool turns = std::strncmp(direction, "about", 5) == 0 || std::strncmp(direction, "between", 7) == 0;
  return (turns ? 1 : 0) + (of_positions ? 0 : 2);
}
constexpr int classes = 4;

}  // namespace

LoopPenalty::LoopPenalty(std::shared_ptr<const LoopSet> set, const std::vector<std::string>& names, double frequency, double damping_ratio)
    : set_(std::move(set)), frequency_(frequency), damping_ratio_(damping_ratio) {
  check_names(*set_, names);
  if (!(frequency > 0) || !std::isfinite(frequency)) throw ModelError("loop: method 'penalty' has a frequency in rad/s, positive and finite, at which its rows swing; not " + short_number(frequency));
  if (!(damping_ratio >= 0) || !std::isfinite(damping_ratio)) throw ModelError("loop: damping_ratio is a finite number, zero or more, not " + short_number(damping_ratio));
  whole_ = take_loops(*set_, names.empty() ? set_->names() : names, loops);
  const Pose<double> none = Pose<double>::identity();
  for (const ResolvedLoop& loop : loops.loops) {
    const auto end = [&](const std::string& frame, const Pose<double>& pose) {
      if (loop.loop->is_coupling()) return End{-1, none};
      const Node node = node_named(model(), frame, "loop");
      return End{node.body, node.pose * pose};
    };
    a.push_back(end(loop.loop->pair.a, loop.loop->pair.end_a)), b.push_back(end(loop.loop->pair.b, loop.loop->pair.end_b));
  }
  present_ = model().state()->q;
}

Declaration LoopPenalty::declaration() const {
  Declaration d;
  d.potential = true;
  d.velocities = d.work = damping_ratio_ > 0 && loops.rows > 0;
  for (size_t l = 0; l < loops.loops.size(); ++l) {
    const ResolvedLoop& loop = loops.loops[l];
    if (loop.loop->coupling.function) d.foreign = true, d.differentiable = false;  // a function in doubles
    d.coordinates.insert(d.coordinates.end(), loop.v.begin(), loop.v.end());
    for (const End& end : {a[l], b[l]})
      if (end.body >= 0) d.wrenches.push_back(end.body);
  }
  for (std::vector<int>* const all : {&d.coordinates, &d.wrenches}) {
    std::sort(all->begin(), all->end());
    all->erase(std::unique(all->begin(), all->end()), all->end());
  }
  return d;
}

LoopPenalty::Springs LoopPenalty::springs(const HingeTerms& terms) const {
  const int nv = model().nv();
  const auto numbers = model().compiled<double>();
  HybridDynamics<double> solver(model(), terms, Solving{}, Vector3<double>{0, 0, 0});
  LoopRows<double> rows;
  LoopBuffers<double> buffers;
  std::vector<double> force(nv), moves(nv);
  // Largest of every class of every loop, at q.
  const auto compliances = [&](const std::vector<double>& q) {
    rows.find(*numbers, loops, q.data(), buffers);
    std::vector<double> largest(classes * loops.loops.size(), 0.0);
    for (size_t l = 0; l < loops.loops.size(); ++l)
      for (int i = 0; i < loops.loops[l].rows; ++i) {
        check_interrupt();
        const int row = loops.loops[l].first_row + i;
        std::fill(force.begin(), force.end(), 0.0);
        bool asks = false;
        for (const auto& e : rows.entries[row])
          if (std::abs(e.value) > asks_nothing * e.size && !terms.is_prescribed(e.coordinate)) force[e.coordinate] = e.value, asks = true;
        if (!asks) continue;
        solver.run(q.data(), nullptr, force.data(), nullptr, moves.data());
        double C = 0;
        for (const auto& e : rows.entries[row])
          if (!terms.is_prescribed(e.coordinate)) C += force[e.coordinate] * moves[e.coordinate];
        double& most = largest[classes * l + class_of(loops.loops[l], i, loops.of_positions[row])];
        most = std::max(most, C);
      }
    return largest;
  };
  const std::vector<double> here = compliances(present_);
  std::vector<double> beside, moved(model().nq()), step(nv);
  Springs found{std::vector<double>(loops.rows, 0.0), std::vector<double>(loops.rows, 0.0)};
  for (size_t l = 0; l < loops.loops.size(); ++l)
    for (int i = 0; i < loops.loops[l].rows; ++i) {
      const int row = loops.loops[l].first_row + i;
      const size_t at = classes * l + class_of(loops.loops[l], i, loops.of_positions[row]);
      if (!(here[at] > 0) && beside.empty()) {
        for (int j = 0; j < nv; ++j) step[j] = 0.3 * std::sin(j + 1.0);  // no direction of any mechanism
        move_configuration(*numbers, present_.data(), step.data(), moved.data());
        beside = compliances(moved);
      }
      const double C = here[at] > 0 ? here[at] : beside[at];
      if (!(C > 0)) continue;
      found.damping[row] = 2 * damping_ratio_ * frequency_ / C;
      if (loops.of_positions[row]) found.stiffness[row] = frequency_ * frequency_ / C;
      if (!std::isfinite(found.stiffness[row]) || !std::isfinite(found.damping[row])) throw ModelError("loop: a frequency of " + short_number(frequency_) + " rad/s of row '" + loops.names[row] + "' takes a spring that is no finite number");
    }
  return found;
}

PYCRAFT_BIND_EFFECT(LoopPenalty, BoundPenalty)

}  // namespace pycraft
