#include "dynamics/embedded_dynamics.h"

#include <algorithm>
#include <cmath>

#include "model/checks.h"
#include "model/configuration.h"
#include "recursions/kinematics.h"

namespace pycraft {

namespace {

constexpr double reach_of_steps = 1e-4;      // as of states taken onto loops by augmentation (states_on_loops.cpp)
constexpr int most_steps = 8;

}  // namespace

template <class S>
EmbeddedWorkspace<S>::EmbeddedWorkspace(const Multibody& model, const HingeTerms& terms)
    : source_(model), tree_(model.structure()), model_(terms.empty() ? model.compiled<S>() : compile_model<S>(model, terms)), blocks_(tree_), forces_(tree_, model_) {}

template <class S>
void EmbeddedWorkspace<S>::set_loops(const std::shared_ptr<const ResolvedLoops>& loops) {
  if (loops_ == loops) return;
  nodes_ = embedded_nodes(*model_, *loops);
  choices_ = std::vector<Choice>(nodes_.size());
  embedded_.begin(*model_, nodes_);
  dense_.assign(model_->nv, S(0));
  loops_ = loops, chosen_ = false;
}

template <class S>
void EmbeddedWorkspace<S>::place(const S* q) {
  kinematics(*model_, q, blocks_);
  for (size_t j = 0; j < added_.size(); ++j) blocks_.J[j] += added_[j];
  rows_.find(*model_, *loops_, q, buffers_);
}

template <class S>
S EmbeddedWorkspace<S>::size_of(int row) const {
  S size = S(0);
  for (const auto& e : rows_.entries[row]) size = maximum(size, e.size);
  return size;
}

// ------------------------------------------------------------------ X, and what follows from it
// Q_d of every node, pivots among the dependent coordinates.
template <class S>
void EmbeddedWorkspace<S>::factor_rows() {
  for (size_t n = 0; n < nodes_.size(); ++n) {
    Choice& of = choices_[n];
    if (of.rows.empty()) continue;
    of.elimination.begin(static_cast<int>(of.weights.size()));
    const S noise = S(4 * std::min<int>(static_cast<int>(of.rows.size()), most_at_once)) * epsilon<S>();  // of sums of so many products
    for (const int row : of.rows) {
      enter(row, of.elimination);
      if (of.elimination.eliminate(of.weights.data(), of.depends.data(), noise * size_beside_weights(row)) >= 0) continue;
      std::string named;
      for (const int each : of.rows) named += (named.empty() ? "'" : ", '") + loops_->names[each] + "'";
      throw EvaluationError("loops of '" + source_.name() + "' are singular at this state, by rows " + named + ": no coordinates describe what is free (method 'augment' goes through)");
    }
  }
}

template <class S>
void EmbeddedWorkspace<S>::find_maps() {
  factor_rows();
  for (size_t n = 0; n < nodes_.size(); ++n)
    if (!choices_[n].rows.empty()) choices_[n].elimination.complete(embedded_.factors[n].X.data(), embedded_.factors[n].r);
}

// target: of all rows; x of the dependent coordinates, of all nodes.
template <class S>
void EmbeddedWorkspace<S>::put_dependent(S* target, S* x) {
  for (size_t n = 0; n < nodes_.size(); ++n) {
    Choice& of = choices_[n];
    if (of.rows.empty()) continue;
    by_rows_.resize(std::max(by_rows_.size(), of.rows.size()));
    std::vector<S>& own = embedded_.factors[n].full;
    for (size_t i = 0; i < of.rows.size(); ++i) by_rows_[i] = target[of.rows[i]];
    of.elimination.solve(by_rows_.data(), own.data());
    for (const int place : of.dependent) x[nodes_[n].coordinates[place]] = -own[place];
  }
}

template <class S>
void EmbeddedWorkspace<S>::velocities(S* v, const S* rates) {
  for (size_t n = 0; n < nodes_.size(); ++n)
    for (const int place : choices_[n].dependent) v[nodes_[n].coordinates[place]] = S(0);
  c_.resize(loops_->rows);
  for (int row = 0; row < loops_->rows; ++row) c_[row] = rows_.product(row, v) - (rates ? rates[row] : S(0));
  put_dependent(c_.data(), v);
}

template <class S>
S EmbeddedWorkspace<S>::off(const S* q) {
  using std::abs;
  residual_.assign(loops_->rows, S(0));
  loop_residuals(*model_, *loops_, q, buffers_, residual_.data());
  S most = S(0);
  for (int row = 0; row < loops_->rows; ++row) {
    if (!loops_->of_positions[row]) residual_[row] = S(0);
    if (const S size = size_of(row); size > S(0)) most = maximum(most, S(abs(residual_[row]) / size));
  }
  return most;
}

template <class S>
void EmbeddedWorkspace<S>::bring(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, const S* rates) {
  set_loops(loops);
  if (!chosen_) choose(loops, q);
  rows_.find(*model_, *loops_, q, buffers_);
  factor_rows();
  S left = off(q);
  moved_.resize(model_->nq), delta_.resize(model_->nv);
  for (int step = 0; step < most_steps && left > S(0); ++step) {  // Newton, as long as each step leaves less than half
    std::fill(delta_.begin(), delta_.end(), S(0));
    put_dependent(residual_.data(), delta_.data());
    move_configuration(*model_, q, delta_.data(), moved_.data());
    const S now = off(moved_.data());
    if (!(S(2) * now < left)) break;
    left = now;
    std::copy_n(moved_.data(), model_->nq, q);
    rows_.find(*model_, *loops_, q, buffers_);
    factor_rows();
  }
  velocities(v, rates);
}

template <class S>
void EmbeddedWorkspace<S>::take_onto(const std::shared_ptr<const ResolvedLoops>& loops, S* q, S* v, const S* rates) {
  using std::abs;
  bring(loops, q, v, rates);
  const S left = off(q);
  if (!(left <= S(reach_of_steps))) {
    off_.assign(loops_->rows, S(0));
    for (int row = 0; row < loops_->rows; ++row)
      if (const S size = size_of(row); size > S(0)) off_[row] = abs(residual_[row]) / size;
    refuse_rows(off_, left, "a state has left its loops, off are rows");
  }
  choose(loops, q);
}

template <class S>
void EmbeddedWorkspace<S>::refuse_rows(const std::vector<S>& off, const S& worst, const char* what) const {
  std::string named;
  for (int r = 0; r < loops_->rows; ++r)
    if (S(2) * off[r] >= worst) named += (named.empty() ? "'" : ", '") + loops_->names[r] + "'";
  throw EvaluationError(std::string(what) + " of '" + source_.name() + "': " + named);
}

// ------------------------------------------------------------------ accelerations
template <class S>
void EmbeddedWorkspace<S>::find_forces(const Asked& asked, const S* x, const Applied<S>& applied) {
  forces_.find(asked.v, x, applied);
  generalized_ = forces_.generalized();
  for (size_t j = 0; j < added_.size(); ++j) generalized_[j] += added_[j] * x[j];
}

// How large X* x may be, in units of energy, before anything cancels in it: by entries of X, and by what they round at, w_a/w_i.
template <class S>
S EmbeddedWorkspace<S>::energy_size(const S* x) const {
  using std::abs, std::sqrt;
  S square = S(0);
  for (size_t n = 0; n < nodes_.size(); ++n) {
    const EmbeddedFactors<S>& f = embedded_.factors[n];
    const std::vector<int>& coordinates = nodes_[n].coordinates;
    for (int a = 0; a < f.r; ++a) {
      const S& own = weights_[coordinates[choices_[n].independent[a]]];
      S sum = S(0);
      for (int i = 0; i < f.n; ++i) sum += (abs(f.X[size_t(i) * f.r + a]) + own / weights_[coordinates[i]]) * abs(x[coordinates[i]]);
      square += sum * sum / embedded_.diagonal(f, a);
    }
  }
  return sqrt(square);
}

template <class S>
void EmbeddedWorkspace<S>::accelerate(const std::shared_ptr<const ResolvedLoops>& loops, const Asked& asked) {
  using std::abs, std::sqrt;
  set_loops(loops);
  if (!chosen_) choose(loops, asked.q);
  const int nv = model_->nv, rows = loops->rows;
  place(asked.q);
  find_maps();
  if (const int faint = embedded_.factor(blocks_); faint >= 0)
    throw SingularHingeError("nothing with mass moves along coordinate '" + tree_.coordinate_names[faint] + "' of '" + source_.name() + "' on its loops", faint);
  forces_.place(asked.q);
  Applied<S> applied = asked.applied ? *asked.applied : own_gravity(*model_);
  if (asked.wrenches) applied.wrenches = forces_.on_bodies(*asked.pushed, asked.wrenches);
  c_.assign(rows, S(0)), bias_.assign(rows, S(0));
  loop_bias(*model_, *loops, asked.q, asked.v, buffers_, c_.data());
  S fastest = S(0);
  for (int i = 0; i < nv; ++i) fastest = maximum(fastest, S(abs(asked.v[i])));
  for (int r = 0; r < rows; ++r) bias_[r] = abs(c_[r]) + fastest * rows_.product_size(r, asked.v) + S(stopped * stopped) * size_of(r) / certified();
  for (int r = 0; asked.driven && r < rows; ++r) c_[r] -= asked.driven[r], bias_[r] += abs(asked.driven[r]);
  x_.assign(nv, S(0)), lambda_.assign(rows, S(0)), delta_.resize(nv), load_.resize(nv);
  put_dependent(c_.data(), x_.data());
  // Steps of refinement of the same equations: the first is the solution.
  const int more = asked.refinement.steps == Refinement::automatic ? 5 : asked.refinement.steps;
  S size = S(0), last = S(0);
  for (int step = 0; step <= more; ++step) {
    find_forces(asked, x_.data(), applied);
    for (int i = 0; i < nv; ++i) load_[i] = asked.tau[i] - generalized_[i];
    const S energy = embedded_.solve(blocks_, load_.data(), delta_.data());
    if (step == 0) size = sqrt(energy) + energy_size(asked.tau) + energy_size(generalized_.data());
    if (step > 0 && (!(energy > S(0)) || (last > S(0) && S(4) * energy > last))) break;
    for (int i = 0; i < nv; ++i) x_[i] += delta_[i];
    last = energy;
  }
  find_forces(asked, x_.data(), applied);
  if (std::any_of(x_.begin(), x_.end(), [](const S& x) { return !std::isfinite(to_double(x)); })) return;  // callers say what left its range
  certify(asked, size);
  find_multipliers(asked);
}

// Whether θ̈ keeps all rows and X* of the equations of motion, in units of energy; `size`: what has cancelled there.
template <class S>
void EmbeddedWorkspace<S>::certify(const Asked& asked, const S& size) {
  using std::abs, std::sqrt;
  off_.assign(loops_->rows, S(0));
  S worst = S(0);
  for (const EmbeddedNode& node : nodes_) {
    S most = S(0);
    for (const int row : node.rows)
      if (const S unit = size_of(row); unit > S(0)) most = maximum(most, S((rows_.product_size(row, x_.data()) + bias_[row]) / unit));
    for (const int row : node.rows) {
      const S unit = size_of(row);
      const S left = unit > S(0) ? S(abs(rows_.product(row, x_.data()) + c_[row]) / unit) : S(abs(c_[row]));
      if (left <= certified() * most) continue;
      off_[row] = left == left ? left : S(1), worst = maximum(worst, off_[row]);
    }
  }
  if (worst > S(0))
    refuse_rows(off_, worst, "no sure accelerations on loops, at a singular state, by rows that ask for different accelerations of one motion or by rounding (take a wider precision): off are rows");
  for (size_t i = 0; i < load_.size(); ++i) load_[i] = asked.tau[i] - generalized_[i];
  const S energy = embedded_.solve(blocks_, load_.data(), nullptr);
  if (!(sqrt(maximum(energy, S(0))) <= certified() * size))
    throw EvaluationError("no sure accelerations of '" + source_.name() + "' on its loops: its equations of motion are left off (take refine='auto', or a wider precision)");
}

// Q_d* λ = (forces - T)_d, by the factors of Q_d; of rows that hang on others zero.
template <class S>
void EmbeddedWorkspace<S>::find_multipliers(const Asked& asked) {
  for (size_t n = 0; n < nodes_.size(); ++n) {
    Choice& of = choices_[n];
    if (of.rows.empty()) continue;
    by_rows_.resize(std::max(by_rows_.size(), of.rows.size()));
    std::vector<S>& own = embedded_.factors[n].full;
    for (const int place : of.dependent) own[place] = generalized_[nodes_[n].coordinates[place]] - asked.tau[nodes_[n].coordinates[place]];
    of.elimination.solve_transposed(own.data(), by_rows_.data());
    for (size_t i = 0; i < of.rows.size(); ++i) lambda_[of.rows[i]] = by_rows_[i];
  }
}

template <class S>
void EmbeddedWorkspace<S>::add_forces(int first, int end, S* out) const {
  for (int r = first; r < end; ++r)
    for (const auto& e : rows_.entries[r]) out[e.coordinate] += e.value * lambda_[r];
}

template class EmbeddedWorkspace<Single>;
template class EmbeddedWorkspace<double>;
template class EmbeddedWorkspace<Extended>;
template class EmbeddedWorkspace<Quad>;

}  // namespace pycraft
