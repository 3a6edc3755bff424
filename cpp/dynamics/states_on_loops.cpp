// States taken onto loops (constrained_dynamics.h): velocities by an impulse of the loops, positions by Newton's steps of the same factors.
#include <algorithm>
#include <cmath>

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "dynamics/constrained_dynamics.h"
#include "dynamics/own_units.h"
#include "model/configuration.h"
#include "recursions/kinematics.h"

namespace pycraft {

namespace {

constexpr double reach_of_steps = 1e-4;  // in angles, or lengths of a row's entries: a state that steps leave further off is on other loops
constexpr int most_steps = 8;

template <class S>
S largest_size(const S* x, int n) {
  using std::abs;
  S most = S(0);
  for (int i = 0; i < n; ++i) most = maximum(most, S(abs(x[i])));
  return most;
}

}  // namespace

// The longest of a row's entries, by what they are the sums of.
template <class S>
S ConstrainedWorkspace<S>::size_of(int row) const {
  S size = S(0);
  for (const auto& e : rows_.entries[row]) size = maximum(size, e.size);
  return size;
}

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
  place(q, form);
  articulated_inertia_tip_to_base(tree_, blocks_);
  if (blocks_.faint().body >= 0) throw_faint_hinge(tree_, blocks_.faint());
  rows_.find(*model_, *loops, q, buffers_);
  factor(nullptr);
  x_.resize(nv);
  solve(p, x_.data());
  for (int i = 0; i < nv; ++i) x_[i] += v[i];
  c_.assign(rows, S(0)), bias_.assign(rows, S(0));
  for (int r = 0; r < rows; ++r) bias_[r] = rows_.product_size(r, x_.data());
  for (int time = 0; time < 2; ++time) meet(c_.data(), false);  // twice: what is left of the rows is rounding
  off_.assign(rows, S(0));
  S worst = S(0);
  for (const auto& group : groups_.groups) {
    S size = S(0);
    for (const int row : group.rows) size = maximum(size, S(bias_[row] / unit(row)));
    for (const int row : group.rows)
      if (const S left = abs(rows_.product(row, x_.data())) / unit(row); !(left <= certified() * size)) off_[row] = left == left ? left : S(1), worst = maximum(worst, off_[row]);
  }
  const std::vector<S> nothing(rows, S(0));
  if (!(worst > S(0))) worst = off_in_own_units(rows_, asking_, x_.data(), c_.data(), nothing.data(), bias_.data(), certified(), off_);
  if (!(worst > S(0))) return;
  if constexpr (settles<S>) if (settles_rows_of<S>(*loops)) {
    using T = Wider<S>;
    const std::vector<T> at(q, q + model_->nq), before(v, v + nv), impulse(p, p + nv);
    ConstrainedWorkspace<T> wider(source_, terms_);
    if (!added_.empty()) wider.add_to_hinges(std::vector<T>(added_.begin(), added_.end()).data());
    wider.project(loops, at.data(), before.data(), impulse.data(), form);
    for (int i = 0; i < nv; ++i) x_[i] = static_cast<S>(wider.result()[i]);
    for (int r = 0; r < rows; ++r) lambda_[r] = static_cast<S>(wider.multipliers()[r]);
    return stand_for(wider.rank(), systems_);
  }
  refuse_rows(off_, worst, "no sure velocities on the loops, near a singular state or by rounding (take a wider precision): off are rows");
}

template <class S>
void ConstrainedWorkspace<S>::find_off(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const S* v, const S* rates, std::vector<S>& positions, std::vector<S>& velocities) {
  using std::abs;
  rows_.find(*model_, *loops, q, buffers_);
  positions.assign(loops->rows, S(0)), velocities.assign(loops->rows, S(0));
  loop_residuals(*model_, *loops, q, buffers_, positions.data());
  for (int r = 0; r < loops->rows; ++r) {
    const S size = size_of(r);  // 0: no coordinate moves the row, as where all hinges around its loop are locked, and it is off as far as it is
    positions[r] = loops->of_positions[r] ? S(abs(positions[r]) / (size > S(0) ? size : S(1))) : S(0);
    if (v) velocities[r] = size > S(0) ? S(abs(rows_.product(r, v) - (rates ? rates[r] : S(0))) / size) : S(0);
  }
}

// Newton's steps of one factor from q, as long as each leaves less than half. Where the first does not, it would lead to another branch, and q stays.
template <class S>
void ConstrainedWorkspace<S>::close(S* q) {
  using std::abs;
  const auto off = [&](const S* at) {  // to target_, and the largest, in units of the rows
    S most = S(0);
    target_.assign(loops_->rows, S(0));
    loop_residuals(*model_, *loops_, at, buffers_, target_.data());
    for (int r = 0; r < loops_->rows; ++r) {
      if (!loops_->of_positions[r]) target_[r] = S(0);
      if (size_of(r) > S(0)) most = maximum(most, S(abs(target_[r]) / size_of(r)));
    }
    return most;
  };
  S left = off(q);
  moved_.resize(model_->nq);
  for (int step = 0; step < most_steps && left > S(0); ++step) {
    x_.assign(model_->nv, S(0));
    meet(target_.data(), false);
    move_configuration(*model_, q, x_.data(), moved_.data());
    const S now = off(moved_.data());
    if (!(S(2) * now < left)) return;
    left = now;
    std::copy_n(moved_.data(), model_->nq, q);
  }
}

template <class S>
void ConstrainedWorkspace<S>::bring(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, const S* rates, Form form) {
  using std::abs, std::sqrt;
  set_loops(loops);
  const int nv = model_->nv, rows = loops->rows;
  find_off(loops, q, v, rates, gone_, slip_);
  const S fastest = largest_size(v, nv), off = largest(gone_), slip = largest(slip_);
  if (!(off > S(4) * epsilon<S>()) && !(slip > S(4) * epsilon<S>() * fastest)) return;  // nothing is off, or nothing is a number
  place(q, form);
  articulated_inertia_tip_to_base(tree_, blocks_);
  if (blocks_.faint().body >= 0) throw_faint_hinge(tree_, blocks_.faint());
  factor(nullptr);
  close(q);
  find_off(loops, q, nullptr, nullptr, gone_, slip_);  // and the rows there
  x_.assign(v, v + nv), target_.assign(rows, S(0));
  for (int r = 0; rates && r < rows; ++r) target_[r] = -rates[r];
  for (int time = 0; time < 3; ++time) meet(target_.data(), false);
  if constexpr (settles<S>) if (settles_rows_of<S>(*loops)) {  // what rounding hid: the wider scalar takes it the rest of the way, from what is there already
    sizes_.assign(rows, S(0)), bias_.assign(rows, S(0));
    for (int r = 0; r < rows; ++r) bias_[r] = abs(target_[r]) + S(stopped) * size_of(r) / certified(), sizes_[r] = rows_.product_size(r, v) + bias_[r];
    const S left = largest(gone_);  // further off than steps reach is refused
    if (left <= S(reach_of_steps) && (left > sqrt(epsilon<S>()) || off_in_own_units(rows_, asking_, x_.data(), target_.data(), bias_.data(), sizes_.data(), certified(), off_) > S(0))) {
      using T = Wider<S>;
      std::vector<T> at(q, q + model_->nq), motion(x_.begin(), x_.end()), driven;
      if (rates) driven.assign(rates, rates + rows);
      ConstrainedWorkspace<T> wider(source_, terms_);
      if (!added_.empty()) wider.add_to_hinges(std::vector<T>(added_.begin(), added_.end()).data());
      wider.bring(loops, at.data(), motion.data(), rates ? driven.data() : nullptr, form);
      for (int i = 0; i < model_->nq; ++i) q[i] = static_cast<S>(at[i]);
      for (int i = 0; i < nv; ++i) x_[i] = static_cast<S>(motion[i]);
    }
  }
  std::copy_n(x_.data(), nv, v);
}

template <class S>
void ConstrainedWorkspace<S>::take_onto(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, const S* rates, Form form) {
  bring(loops, q, v, rates, form);
  find_off(loops, q, nullptr, nullptr, gone_, slip_);
  if (const S off = largest(gone_); !(off <= S(reach_of_steps))) refuse_rows(gone_, off, "a state has left its loops, off are rows");
}

template <class S>
void ConstrainedWorkspace<S>::add_forces(int first, int end, S* out) const {
  for (int r = first; r < end; ++r)
    for (const auto& e : rows_.entries[r]) out[e.coordinate] += e.value * lambda_[r];
}

#define PYCRAFT_INSTANTIATE(S)                                                                                                                              \
  template S ConstrainedWorkspace<S>::size_of(int) const;                                                                                                   \
  template S ConstrainedWorkspace<S>::largest(const std::vector<S>&);                                                                                       \
  template void ConstrainedWorkspace<S>::project(const std::shared_ptr<const ResolvedLoops>&, const S*, const S*, const S*, Form);                          \
  template void ConstrainedWorkspace<S>::find_off(const std::shared_ptr<const ResolvedLoops>&, const S*, const S*, const S*, std::vector<S>&, std::vector<S>&); \
  template void ConstrainedWorkspace<S>::close(S*);                                                                                                         \
  template void ConstrainedWorkspace<S>::bring(const std::shared_ptr<const ResolvedLoops>&, S*, S*, const S*, Form);                                        \
  template void ConstrainedWorkspace<S>::take_onto(const std::shared_ptr<const ResolvedLoops>&, S*, S*, const S*, Form);                                    \
  template void ConstrainedWorkspace<S>::add_forces(int, int, S*) const;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
