// States taken onto loops (constrained_dynamics.h): velocities by an impulse of the loops, positions by Newton's steps of the same factors.
#include <algorithm>
#include <cmath>

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "dynamics/constrained_dynamics.h"
#include "model/configuration.h"
#include "recursions/kinematics.h"

namespace pycraft {

namespace {

// A state that is δ off its loops has directions up to √δ where it should have none: near a singular state, where rows are quadratic in the way to
// it. What is solved for along those is off by δ/σ², so that one with σ = √δ · this is off by a thousandth.
constexpr double of_off = 30;
constexpr double largest_rank_tolerance = 0.1;
constexpr double reach_of_steps = 1e-2;  // of Newton's: a state further off, in angles or the lengths of a row's entries, is on other loops
constexpr int most_steps = 8;
template <class S>
S largest_size(const S* x, int n) {
  using std::abs;
  S most = S(0);
  for (int i = 0; i < n; ++i) most = maximum(most, S(abs(x[i])));
  return most;
}

}  // namespace

template <class S>
S ConstrainedWorkspace<S>::largest(const std::vector<S>& of) {
  S most = S(0);
  for (const S& x : of) most = maximum(most, x);
  return most;
}

template <class S>
void ConstrainedWorkspace<S>::project(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const S* v, const S* p, Form form) {
  using std::abs;
  set_loops(loops);
  const int nv = model_->nv, rows = loops->rows;
  kinematics(*model_, q, blocks_);
  blocks_.form = form;
  articulated_inertia_tip_to_base(tree_, blocks_);
  if (blocks_.faint().body >= 0) throw_faint_hinge(tree_, blocks_.faint());
  rows_.find(*model_, *loops, q, buffers_);
  factor();
  x_.assign(nv, S(0));
  if (p) solve(p, x_.data());
  for (int i = 0; i < nv; ++i) x_[i] += v[i];
  c_.assign(rows, S(0)), bias_.assign(rows, S(0));
  for (int r = 0; r < rows; ++r) bias_[r] = rows_.product_size(r, x_.data());
  for (int time = 0; time < 2; ++time) meet(c_.data(), false);  // twice: what is left of the rows is rounding
  off_.assign(rows, S(0));
  S worst = S(0);
  for (const auto& group : groups_.groups) {
    S size = S(0);
    for (const int row : group.rows) size = maximum(size, S(bias_[row] / unit_[row]));
    for (const int row : group.rows)
      if (const S left = abs(rows_.product(row, x_.data())) / unit_[row]; !(left <= certified() * size)) off_[row] = left == left ? left : S(1), worst = maximum(worst, off_[row]);
  }
  if (worst > S(0)) refuse_rows(off_, worst, "no sure velocities on the loops, near a singular state or by rounding (take a wider precision): off are rows");
}

template <class S>
void ConstrainedWorkspace<S>::trust(const S& off) {
  using std::sqrt;
  rank_tolerance_ = std::min(S(largest_rank_tolerance), maximum(least_rank_tolerance<S>(), S(S(of_off) * sqrt(off))));
}

// Velocities off by δ are felt as δ|θ̇| beside what accelerates, |θ̇|² and θ̈ of the tree alone.
template <class S>
void ConstrainedWorkspace<S>::trust_near(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const S* v) {
  find_off(loops, q, v, gone_, slip_);
  const S fastest = largest_size(v, model_->nv), scale = fastest * fastest + largest_size(x_.data(), model_->nv);
  trust(maximum(largest(gone_), scale > S(0) ? S(largest(slip_) * fastest / scale) : S(0)));
}

template <class S>
void ConstrainedWorkspace<S>::find_off(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const S* v, std::vector<S>& positions, std::vector<S>& velocities) {
  using std::abs;
  rows_.find(*model_, *loops, q, buffers_);
  positions.assign(loops->rows, S(0)), velocities.assign(v ? loops->rows : 0, S(0));
  loop_residuals(*model_, *loops, q, buffers_, positions.data());
  for (int r = 0; r < loops->rows; ++r) {
    S size = S(0);
    for (const auto& e : rows_.entries[r]) size = maximum(size, e.size);
    positions[r] = size > S(0) ? S(abs(positions[r]) / size) : S(0);
    if (v) velocities[r] = size > S(0) ? S(abs(rows_.product(r, v)) / size) : S(0);
  }
}

template <class S>
void ConstrainedWorkspace<S>::take_onto(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, Form form) {
  set_loops(loops);
  rank_tolerance_ = least_rank_tolerance<S>();
  S before = S(0);
  for (int step = 0; step <= most_steps; ++step) {
    find_off(loops, q, nullptr, gone_, slip_);
    const S off = largest(gone_);
    if (!(off <= S(reach_of_steps))) refuse_rows(gone_, off, "a state has left its loops, off are rows");
    if (off <= S(4) * epsilon<S>() || step == most_steps || (step > 0 && !(S(2) * off <= before))) break;
    before = off;
    trust(off);
    kinematics(*model_, q, blocks_);
    blocks_.form = form;
    articulated_inertia_tip_to_base(tree_, blocks_);
    if (blocks_.faint().body >= 0) throw_faint_hinge(tree_, blocks_.faint());
    target_.assign(loops->rows, S(0));
    loop_residuals(*model_, *loops, q, buffers_, target_.data());
    factor();
    x_.assign(model_->nv, S(0));
    meet(target_.data(), false);
    moved_.resize(model_->nq);
    move_configuration(*model_, q, x_.data(), moved_.data());
    std::copy_n(moved_.data(), model_->nq, q);
  }
  find_off(loops, q, v, gone_, slip_);
  const S fastest = largest_size(v, model_->nv);
  trust(maximum(largest(gone_), fastest > S(0) ? S(largest(slip_) / fastest) : S(0)));
  project(loops, q, v, nullptr, form);
  std::copy_n(x_.data(), model_->nv, v);
}

template <class S>
void ConstrainedWorkspace<S>::add_forces(int first, int end, S* out) const {
  for (int r = first; r < end; ++r)
    for (const auto& e : rows_.entries[r]) out[e.coordinate] += e.value * lambda_[r];
}

#define PYCRAFT_INSTANTIATE(S)                                                                                                                              \
  template S ConstrainedWorkspace<S>::largest(const std::vector<S>&);                                                                                       \
  template void ConstrainedWorkspace<S>::project(const std::shared_ptr<const ResolvedLoops>&, const S*, const S*, const S*, Form);                          \
  template void ConstrainedWorkspace<S>::trust(const S&);                                                                                                   \
  template void ConstrainedWorkspace<S>::trust_near(const std::shared_ptr<const ResolvedLoops>&, const S*, const S*);                                       \
  template void ConstrainedWorkspace<S>::find_off(const std::shared_ptr<const ResolvedLoops>&, const S*, const S*, std::vector<S>&, std::vector<S>&);       \
  template void ConstrainedWorkspace<S>::take_onto(const std::shared_ptr<const ResolvedLoops>&, S*, S*, Form);                                              \
  template void ConstrainedWorkspace<S>::add_forces(int, int, S*) const;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
