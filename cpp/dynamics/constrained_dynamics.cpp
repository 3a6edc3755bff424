#include "dynamics/constrained_dynamics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "algebra/trees/sweeps/mass_matrix.h"
#include "dynamics/own_units.h"
#include "model/checks.h"
#include "model/recorded_model.h"
#include "model/unit_data.h"
#include "numerics/decisions.h"
#include "numerics/recorded.h"
#include "recursions/articulated_body.h"
#include "recursions/kinematics.h"

namespace pycraft {

namespace {

template <class T, class S>
void take(const std::vector<S>& from, std::vector<T>& to) {
  to.resize(from.size());
  for (size_t i = 0; i < from.size(); ++i) to[i] = T(from[i]);
}

}  // namespace

template <class S>
ConstrainedWorkspace<S>::ConstrainedWorkspace(const Multibody& model, const HingeTerms& terms)
    : source_(model), tree_(model.structure()), model_(terms.empty() ? model.compiled<S>() : compile_model<S>(model, terms)), blocks_(tree_), forces_(tree_, model_), z_(tree_.bodies()),
      alpha_(tree_.bodies()), terms_(terms) {
  for (int k = tree_.bodies() - 1; k >= 0; --k) all_.push_back(k);
}

template <class S>
void ConstrainedWorkspace<S>::set_loops(const std::shared_ptr<const ResolvedLoops>& loops) {
  lambda_.assign(loops->rows, S(0));
  if (loops_ == loops) return;
  groups_ = LoopGroups::of(*model_, *loops);
  systems_.resize(groups_.groups.size()), active_.resize(groups_.groups.size()), asking_.resize(groups_.groups.size());
  loop_of_.resize(loops->rows);
  for (size_t l = 0; l < loops->loops.size(); ++l) std::fill_n(loop_of_.begin() + loops->loops[l].first_row, loops->loops[l].rows, int(l));
  loops_ = loops;
}

template <class S>
void ConstrainedWorkspace<S>::place(const S* q, Form form) {
  kinematics(*model_, q, blocks_);
  for (size_t j = 0; j < added_.size(); ++j) blocks_.J[j] += added_[j];
  blocks_.form = form;
}

template <class S>
void ConstrainedWorkspace<S>::find_forces(const Asked& asked, const S* x, const Applied<S>& applied) {
  forces_.find(asked.v, x, applied);
  generalized_ = forces_.generalized();
  for (size_t j = 0; j < added_.size(); ++j) generalized_[j] += added_[j] * x[j];
}

template <class S>
void ConstrainedWorkspace<S>::factor(const S* bias) {
  dense_.assign(model_->nv, S(0));
  unit_squares_.assign(loops_->rows, S(1));
  for (size_t g = 0; g < groups_.groups.size(); ++g) {
    const auto& group = groups_.groups[g];
    const int n = group.coordinates, m = static_cast<int>(group.rows.size());
    systems_[g].begin(n);
    scale_.resize(m);
    active_[g].clear(), asking_[g].clear();
    for (const int row : group.rows) {
      // What is zero exactly asks nothing and loses nothing to rounding, as across the plane of a linkage.
      const auto& entries = rows_.entries[row];
      if ((!bias || vanishes(bias[row])) && std::all_of(entries.begin(), entries.end(), [](const auto& e) { return vanishes(e.value); })) continue;
      asking_[g].push_back(row);
      check_interrupt_at(row, n);
      const std::vector<int>& reach = groups_.reach[loop_of_[row]];
      const size_t c = active_[g].size();
      // What rounding of the row itself is, by epsilon: of all entries at once, or of the largest by its own hinge's inertia. Recorded numbers, of which
      // a thousand times as much is asked, take the second, which takes no sweep.
      S square = S(0), own = S(0);
      const auto add_own = [&](int k, int i, const S& d) {
        const S size = dense_[model_->v_offset[k] + i];
        own += size * (size / d);
      };
      for (const auto& e : rows_.entries[row]) dense_[e.coordinate] = e.size;
      if (is_recorded<S>)
        for (const int k : reach)
          for (int i = 0; i < model_->nv_of[k]; ++i) add_own(k, i, pivot(*model_, blocks_, k, i));
      else
        half_inverse_tip_to_base(*model_, blocks_, reach, dense_.data(), z_, epsilon_, [&](int k, int i, const S& epsilon, const S& d) { square += epsilon * (epsilon / d), add_own(k, i, d); });
      if (const S larger = maximum(square, own); larger > S(0)) unit_squares_[row] = larger;
      S left = S(0);
      systems_[g].add_column();
      for (const auto& e : rows_.entries[row]) dense_[e.coordinate] = e.value;
      half_inverse_tip_to_base(*model_, blocks_, reach, dense_.data(), z_, epsilon_, [&](int k, int i, const S& epsilon, const S& d) {
        left += epsilon * (epsilon / d);
        systems_[g].add_entry(groups_.place[k] + i, epsilon, d);
      });
      for (const auto& e : rows_.entries[row]) dense_[e.coordinate] = S(0);
      if (left > rank_tolerance<S>() * rank_tolerance<S>() * unit_squares_[row])  // the next row takes the place of one that asks nothing here
        scale_[c] = unit_squares_[row], active_[g].push_back(row);
      else
        systems_[g].drop_column();
    }
    systems_[g].factor(scale_.data(), rank_tolerance<S>());
  }
}

template <class S>
int ConstrainedWorkspace<S>::rank() const {
  int sum = 0;
  for (const auto& system : systems_) sum += system.rank();
  return sum;
}

template <class S>
void ConstrainedWorkspace<S>::solve(const S* r, S* x) {
  scratch_.resize(std::max(scratch_.size(), size_t(6) * model_->bodies));
  mass_matrix_inverse_apply(tree_, blocks_, r, x, 1, scratch_.data());
}

template <class S>
S ConstrainedWorkspace<S>::energy(const S* x) {
  S square = S(0);
  half_inverse_tip_to_base(*model_, blocks_, all_, x, z_, epsilon_, [&](int, int, const S& epsilon, const S& d) { square += epsilon * (epsilon / d); });
  return square;
}

template <class S>
void ConstrainedWorkspace<S>::refuse_rows(const std::vector<S>& off, const S& worst, const char* what) const {
  std::string named;
  for (int r = 0; r < loops_->rows; ++r)
    if (S(2) * off[r] >= worst) named += (named.empty() ? "'" : ", '") + loops_->names[r] + "'";
  throw EvaluationError(std::string(what) + " of '" + source_.name() + "': " + named);
}

// At a singular state rows depend on each other in any units. Rows that do in units of energy alone, as two that a light body shares with heavy ones,
// are told apart by a wider scalar.
template <class S>
bool ConstrainedWorkspace<S>::apart_in_own_units() {
  if constexpr (settles<S>) {
    MinimumNormSystem<S> own;
    for (size_t g = 0; g < systems_.size(); ++g) {
      own.begin(model_->nv);
      for (const int row : asking_[g]) {
        const S size = size_of(row);
        if (!(size > S(0))) continue;
        own.add_column();
        for (const auto& e : rows_.entries[row]) own.add_entry(e.coordinate, S(e.value / size), S(1));
      }
      const std::vector<S> ones(asking_[g].size(), S(1));
      own.factor(ones.data(), rank_tolerance<S>());
      if (own.rank() > systems_[g].rank()) return true;
    }
  }
  return false;
}

// Of every group by itself. Where `first`, what the rows ask of one motion and cannot have together is refused.
template <class S>
bool ConstrainedWorkspace<S>::meet(const S* target, bool first) {
  using std::abs;
  const int nv = model_->nv;
  part_.assign(loops_->rows, S(0)), off_.assign(loops_->rows, S(0));
  if (first) sizes_.assign(loops_->rows, S(0));
  S worst = S(0);
  for (size_t g = 0; g < systems_.size(); ++g) {
    const auto& rows = asking_[g];
    const size_t m = active_[g].size();
    b_.resize(m), scale_.resize(m), conflict_.resize(m);
    const auto asked = [&](int row) { return S(-(rows_.product(row, x_.data()) + target[row])); };
    for (size_t c = 0; c < m; ++c) b_[c] = asked(active_[g][c]);
    systems_[g].solve(b_.data(), scale_.data(), conflict_.data());
    for (size_t c = 0; c < m; ++c) part_[active_[g][c]] = scale_[c];
    if (!first) continue;
    S size = S(0);
    for (const int row : rows) sizes_[row] = rows_.product_size(row, x_.data()) + bias_[row], size = maximum(size, S(sizes_[row] / unit(row)));
    for (const int row : rows) off_[row] = abs(asked(row)) / unit(row);
    for (size_t c = 0; c < m; ++c) off_[active_[g][c]] = abs(conflict_[c]);
    for (const int row : rows) {
      if (vanishes(off_[row])) continue;
      if (off_[row] <= certified() * size) off_[row] = S(0);
      worst = maximum(worst, off_[row]);
    }
  }
  if (worst > S(0)) {
    if (settles_rows_of<S>(*loops_) && apart_in_own_units()) return false;
    refuse_rows(off_, worst, "rows of loops hang together and ask for different accelerations of one motion, at a singular state, by functions that conflict, or, where masses are far apart, by rounding (take a wider precision),");
  }
  delta_.assign(nv, S(0)), r_.assign(nv, S(0));
  rows_.add_transposed(part_.data(), r_.data());
  solve(r_.data(), delta_.data());
  for (int i = 0; i < nv; ++i) x_[i] += delta_[i];
  for (int r = 0; r < loops_->rows; ++r) lambda_[r] += part_[r];
  return true;
}

// One step of refinement of both equations: r = T + Q*λ - (the forces of x), and what the rows are off by.
template <class S>
void ConstrainedWorkspace<S>::correct(const Asked& asked, const Applied<S>& applied) {
  const int nv = model_->nv;
  const bool wider = asked.refinement.wider() || asked.refinement.gathers_wider();
  r_.assign(nv, S(0)), target_.resize(loops_->rows);
  if constexpr (!std::is_same_v<S, Quad> && !is_recorded<S>) {
    if (wider) {
      using T = Wider<S>;
      const auto model = source_.compiled<T>();
      const int bodies = model_->bodies;
      std::vector<T> q(asked.q, asked.q + model_->nq), v(asked.v, asked.v + nv), x, lambda, force(nv), load(asked.tau, asked.tau + nv), c(loops_->rows), r(loops_->rows);
      std::vector<Vector6<T>> pushed;
      const Applied<T> same = converted(applied, bodies, pushed);
      LoopBuffers<T> buffers;
      LoopRows<T> rows;
      take(x_, x), take(lambda_, lambda);
      rows.find(*model, *loops_, q.data(), buffers);
      loop_bias(*model, *loops_, q.data(), v.data(), buffers, c.data());
      if (asked.gains) loop_residuals(*model, *loops_, q.data(), buffers, r.data());
      for (int i = 0; i < loops_->rows; ++i) {
        const Baumgarte of = asked.gains ? (*asked.gains)[i] : Baumgarte{};
        target_[i] = static_cast<S>(T(rows.product(i, x.data()) + c[i] + T(2 * of.alpha) * rows.product(i, v.data()) + T(of.beta) * T(of.beta) * r[i] - (asked.driven ? T(asked.driven[i]) : T(0))));
      }
      if (!wider_) wider_ = std::make_unique<RigidDynamics<T>>(source_, terms_);
      wider_->inverse_dynamics(q.data(), v.data(), x.data(), force.data(), &same);
      rows.add_transposed(lambda.data(), load.data());
      for (size_t j = 0; j < added_.size(); ++j) force[j] += T(added_[j]) * x[j];
      for (int i = 0; i < nv; ++i) r_[i] = static_cast<S>(T(load[i] - force[i]));
      return add_correction();
    }
  }
  if (wider) throw EvaluationError("accelerations on loops in precision 'quad' have no wider residual; ask for residual='same'");
  find_forces(asked, x_.data(), applied);
  for (int i = 0; i < nv; ++i) r_[i] = asked.tau[i] - generalized_[i];
  rows_.add_transposed(lambda_.data(), r_.data());
  for (int i = 0; i < loops_->rows; ++i) target_[i] = rows_.product(i, x_.data()) + c_[i];
  add_correction();
}

// Of the residuals r_ and target_.
template <class S>
void ConstrainedWorkspace<S>::add_correction() {
  before_ = x_;
  solve(r_.data(), x_.data());
  meet(target_.data(), false);
  for (size_t i = 0; i < x_.size(); ++i) x_[i] += before_[i];
}

// Whether θ̈ and λ keep both equations: what is off in the rows, in units of energy and in their own, and in the equations of motion.
template <class S>
bool ConstrainedWorkspace<S>::sure(const Asked& asked, const Applied<S>& applied, bool refuse) {
  using std::abs, std::sqrt;
  const int nv = model_->nv;
  if (std::any_of(x_.begin(), x_.end(), [](const S& x) { return !is_finite(x); })) return true;  // batches say what left its range
  if (is_recorded<S> && !refuse) return sure_by_squares(asked, applied);
  off_.assign(loops_->rows, S(0));
  S worst = S(0);
  for (const auto& rows : asking_) {
    S size = S(0);  // what has cancelled in the rows: the tree's own accelerations, or those of the result
    for (const int row : rows) {
      size = maximum(size, S((rows_.product_size(row, x_.data()) + bias_[row]) / unit(row)));
      size = maximum(size, S(sizes_[row] / unit(row)));
    }
    for (const int row : rows) {
      const S left = abs(rows_.product(row, x_.data()) + c_[row]) / unit(row);
      if (left <= certified() * size) continue;
      off_[row] = left;
      worst = maximum(worst, left);
    }
  }
  if (!(worst > S(0))) worst = off_in_own_units(rows_, asking_, x_.data(), c_.data(), bias_.data(), sizes_.data(), certified(), off_);
  if (worst > S(0)) {
    if (refuse) refuse_rows(off_, worst, "no sure accelerations, near a singular state or by rounding (take refine='auto', or a wider precision): off are rows");
    return false;
  }
  load_.assign(nv, S(0));
  rows_.add_transposed(lambda_.data(), load_.data());
  const S carried = energy(load_.data()), driven = energy(asked.tau);
  find_forces(asked, x_.data(), applied);
  for (int i = 0; i < nv; ++i) load_[i] += asked.tau[i] - generalized_[i];
  const S missed = energy(load_.data());
  // Of less than all that has cancelled, and by squares, which say the same but for factors up to √2: no roots are taken.
  S inertia = S(0);
  for (int k = 0; k < model_->bodies; ++k)
    for (int i = 0; i < model_->nv_of[k]; ++i) inertia += pivot(*model_, blocks_, k, i);
  const S of_stopped = S(stopped * stopped) * S(stopped * stopped) * inertia;
  bool small = missed <= certified() * certified() * (carried + driven) + of_stopped;
  if (!small) {  // costs as much again
    off_.assign(nv, S(0));
    find_forces(asked, off_.data(), applied);
    small = sqrt(missed) <= certified() * (sqrt(carried) + sqrt(driven) + sqrt(energy(generalized_.data())));
  }
  if (!small) {
    if (!refuse) return false;
    int most = 0;
    for (int i = 1; i < nv; ++i)
      if (abs(load_[i]) > abs(load_[most])) most = i;
    int k = 0;
    while (k + 1 < model_->bodies && model_->v_offset[k + 1] <= most) ++k;
    throw EvaluationError("no sure accelerations of '" + source_.name() + "': its equations of motion are left off, most at hinge '" + source_.body(k).hinge.name +
                          "' (take refine='auto', or a wider precision)");
  }
  return true;
}

// The same of numbers that are written down, for which it is a large part of all: of rows by squares, which take no roots, of motion by the energy
// that its forces would give each hinge by itself, with all inboard of it at rest, which takes no sweeps. What has cancelled is what the result is made of.
template <class S>
bool ConstrainedWorkspace<S>::sure_by_squares(const Asked& asked, const Applied<S>& applied) {
  const S bound = certified() * certified(), most = S(std::numeric_limits<double>::max());
  for (const auto& rows : asking_) {
    S size = S(0);
    for (const int row : rows) {
      const S own = rows_.product_size(row, x_.data()) + bias_[row];
      size = maximum(size, S(own * own / unit_squares_[row]));
    }
    if (!rows.empty() && !(size <= most)) return false;
    for (const int row : rows) {
      const S left = rows_.product(row, x_.data()) + c_[row];
      if (!(left * left <= bound * size * unit_squares_[row])) return false;
    }
  }
  load_.assign(model_->nv, S(0));
  rows_.add_transposed(lambda_.data(), load_.data());
  const S size = energy_of_hinges(load_.data()) + energy_of_hinges(asked.tau);
  find_forces(asked, x_.data(), applied);
  for (int i = 0; i < model_->nv; ++i) load_[i] += asked.tau[i] - generalized_[i];
  return energy_of_hinges(load_.data()) <= bound * size && size <= most;
}

template <class S>
S ConstrainedWorkspace<S>::energy_of_hinges(const S* x) {
  S sum = S(0);
  delta_.assign(x, x + model_->nv);
  for (int k = 0; k < model_->bodies; ++k) blocks_.solve_D_in_place(k, delta_.data() + model_->v_offset[k], 1);
  for (int i = 0; i < model_->nv; ++i) sum += x[i] * delta_[i];
  return sum;
}

template <class S>
void ConstrainedWorkspace<S>::find_bias(const Asked& asked) {
  using std::abs;
  const int nv = model_->nv, rows = loops_->rows;
  c_.assign(rows, S(0)), bias_.assign(rows, S(0));
  loop_bias(*model_, *loops_, asked.q, asked.v, buffers_, c_.data());
  S fastest = S(0);
  for (int i = 0; i < nv; ++i) fastest = maximum(fastest, S(abs(asked.v[i])));
  for (int r = 0; r < rows; ++r) bias_[r] = abs(c_[r]) + fastest * rows_.product_size(r, asked.v);
  if constexpr (!is_recorded<S>)  // what velocities that stopped ask of rows is rounding
    for (int r = 0; r < rows; ++r) bias_[r] += S(stopped * stopped) * size_of(r) / certified();
  if (asked.gains) {
    target_.assign(rows, S(0));
    loop_residuals(*model_, *loops_, asked.q, buffers_, target_.data());
    for (int r = 0; r < rows; ++r) {
      const Baumgarte& of = (*asked.gains)[r];
      const S drawn = S(of.beta) * S(of.beta) * target_[r];
      c_[r] += S(2 * of.alpha) * rows_.product(r, asked.v) + drawn;
      bias_[r] += S(2 * of.alpha) * rows_.product_size(r, asked.v) + abs(drawn);
    }
  }
  if (asked.driven)
    for (int r = 0; r < rows; ++r) c_[r] -= asked.driven[r], bias_[r] += abs(asked.driven[r]);
}

template <class S>
void ConstrainedWorkspace<S>::accelerate(const std::shared_ptr<const ResolvedLoops>& loops, const Asked& asked) {
  using std::abs;
  set_loops(loops);
  const int nv = model_->nv, rows = loops->rows;
  place(asked.q, asked.form);
  point_accelerations_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), asked.v, OwnTerms::absorbed, points_);
  forces_.place(asked.q);
  Applied<S> applied = asked.applied ? *asked.applied : own_gravity(*model_);
  if (asked.wrenches) applied.wrenches = forces_.on_bodies(*asked.pushed, asked.wrenches);
  x_.resize(nv);
  articulated_body(tree_, *model_, blocks_, points_, applied, asked.tau, x_.data(), z_, alpha_);
  if (blocks_.faint().body >= 0) throw_faint_hinge(tree_, blocks_.faint());
  for (int i = 0; i < nv; ++i) x_[i] -= points_.absorbed[i];
  rows_.find(*model_, *loops, asked.q, buffers_);
  if (std::any_of(x_.begin(), x_.end(), [](const S& x) { return !is_finite(x); })) return;  // callers say what left its range
  find_bias(asked);
  factor(c_.data());
  // The same state in the next wider scalar, where what rounding hid of the rows is seen, or refused.
  const bool settling = settles_rows_of<S>(*loops);
  const auto settle = [&] {
    if constexpr (settles<S>) {
      using T = Wider<S>;
      std::vector<Vector6<T>> pushed;
      const Applied<T> same = converted(applied, model_->bodies, pushed);
      const std::vector<T> q(asked.q, asked.q + model_->nq), v(asked.v, asked.v + nv), tau(asked.tau, asked.tau + nv);
      std::vector<T> driven;
      if (asked.driven) driven.assign(asked.driven, asked.driven + rows);
      ConstrainedWorkspace<T> wider(source_, terms_);
      if (!added_.empty()) wider.add_to_hinges(std::vector<T>(added_.begin(), added_.end()).data());
      wider.accelerate(loops, {q.data(), v.data(), tau.data(), nullptr, nullptr, &same, asked.form, {}, asked.gains, asked.driven ? driven.data() : nullptr});
      take(wider.result(), x_), take(wider.multipliers(), lambda_);
      stand_for(wider.rank(), systems_);
    }
  };
  if (!meet(c_.data(), true)) return settle();
  const int steps = asked.refinement.steps == Refinement::automatic ? 5 : asked.refinement.steps;
  S last = S(0);
  for (int step = 0; step < steps; ++step) {
    std::vector<S> before = x_;
    correct(asked, applied);
    S moved = S(0), size = S(0);
    for (int i = 0; i < nv; ++i) moved = maximum(moved, S(abs(x_[i] - before[i]))), size = maximum(size, S(abs(x_[i])));
    if (moved <= S(4) * epsilon<S>() * size || (step > 0 && S(2) * moved > last)) break;
    last = moved;
  }
  for (int more = 0; !sure(asked, applied, more == 3 && !settling); ++more) {
    if (more == 3) return settle();
    correct(asked, applied);
  }
}

template <class S>
Vector6<S> ConstrainedWorkspace<S>::force(int loop, bool on_a) const {
  return rows_.force(*loops_, lambda_, loop, on_a);
}

template class ConstrainedWorkspace<Single>;
template class ConstrainedWorkspace<double>;
template class ConstrainedWorkspace<Extended>;
template class ConstrainedWorkspace<Quad>;
template class ConstrainedWorkspace<Recorded>;  // accelerate alone (recorded_on_loops.h)

}  // namespace pycraft
