// Which coordinates of loops are independent (embedded_dynamics.h).
#include <algorithm>
#include <cmath>
#include <string>

#include "algebra/trees/sweeps/composite_inertia.h"
#include "dynamics/embedded_dynamics.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

// Complete pivoting of the node's rows at rows_: weights_ are √ℳ_ii. Rows are in units of what their entries are sums of, and what is left of one
// below rank_tolerance hangs on those before, as by augmentation: a row that asks nothing but for rounding, as of a planar loop in any plane, is
// no direction. may_depend: what may be eliminated.
template <class S>
void EmbeddedWorkspace<S>::choose_few(size_t node, bool given) {
  using std::abs;
  const EmbeddedNode& at = nodes_[node];
  Choice& to = choices_[node];
  const size_t m = at.rows.size(), n = at.coordinates.size();
  std::vector<S> A(m * n, S(0));
  for (size_t i = 0; i < m; ++i) {
    for (const auto& e : rows_.entries[at.rows[i]]) dense_[e.coordinate] = e.value / weights_[e.coordinate];
    const S size = size_beside_weights(at.rows[i]);
    for (size_t j = 0; j < n; ++j) A[i * n + j] = size > S(0) ? S(dense_[at.coordinates[j]] / size) : S(0);
    for (const auto& e : rows_.entries[at.rows[i]]) dense_[e.coordinate] = S(0);
  }
  std::vector<char> row_taken(m, 0);
  for (size_t rank = 0; rank < std::min(m, n); ++rank) {
    size_t row = m, column = n;
    S best = rank_tolerance<S>();
    for (size_t i = 0; i < m; ++i)
      for (size_t j = 0; !row_taken[i] && j < n; ++j)
        if (!to.depends[j] && to.may_depend[j] && abs(A[i * n + j]) > best) best = abs(A[i * n + j]), row = i, column = j;
    if (row == m) break;
    row_taken[row] = to.depends[column] = 1;
    to.rows.push_back(at.rows[row]);
    for (size_t i = 0; i < m; ++i) {
      const S factor = A[i * n + column] / A[row * n + column];
      for (size_t j = 0; !row_taken[i] && j < n; ++j) A[i * n + j] -= factor * A[row * n + j];
    }
  }
  for (size_t i = 0; given && i < m; ++i)
    for (size_t j = 0; !row_taken[i] && j < n; ++j)
      if (abs(A[i * n + j]) > rank_tolerance<S>()) refuse_held(node, at.rows[i], static_cast<int>(j));
}

// Row after row, as they are declared.
template <class S>
void EmbeddedWorkspace<S>::choose_many(size_t node, bool given) {
  const EmbeddedNode& at = nodes_[node];
  Choice& to = choices_[node];
  to.elimination.begin(static_cast<int>(at.coordinates.size()));
  for (const int row : at.rows) {
    check_interrupt_at(row, static_cast<int>(at.coordinates.size()));
    const S least = rank_tolerance<S>() * size_beside_weights(row);
    enter(row, to.elimination);
    if (const int pivot = to.elimination.eliminate(to.weights.data(), to.may_depend.data(), least); pivot >= 0) {
      to.depends[pivot] = 1, to.rows.push_back(row);
    } else if (given) {
      enter(row, to.elimination);
      if (const int held = to.elimination.eliminate(to.weights.data(), nullptr, least); held >= 0) refuse_held(node, row, held);
    }
  }
}

// given: no coordinate that is wanted as an independent one is eliminated.
template <class S>
void EmbeddedWorkspace<S>::choose_of(size_t node, bool given) {
  const EmbeddedNode& at = nodes_[node];
  Choice& to = choices_[node];
  const size_t n = at.coordinates.size();
  to.rows.clear(), to.dependent.clear(), to.independent.clear();
  to.depends.assign(n, 0), to.may_depend.assign(n, 1), to.weights.resize(n);
  for (size_t j = 0; j < n; ++j) to.weights[j] = weights_[at.coordinates[j]], to.may_depend[j] = !given || !wanted_[at.coordinates[j]];
  if (at.rows.size() > most_at_once)
    choose_many(node, given);
  else
    choose_few(node, given);
  for (size_t j = 0; j < n; ++j) {
    if (given && to.may_depend[j] && !to.depends[j]) refuse_choice(node, "'" + tree_.coordinate_names[at.coordinates[j]] + "' does not follow");
    (to.depends[j] ? to.dependent : to.independent).push_back(static_cast<int>(j));
  }
  const size_t r = to.independent.size();
  embedded_.factors[node].resize(static_cast<int>(n), static_cast<int>(r));
  for (size_t a = 0; a < r; ++a) embedded_.factors[node].X[size_t(to.independent[a]) * r + a] = S(1);
}

// What entries of a row are sums of, in units of energy, at most.
template <class S>
S EmbeddedWorkspace<S>::size_beside_weights(int row) const {
  S size = S(0);
  for (const auto& e : rows_.entries[row]) size = maximum(size, S(e.size / weights_[e.coordinate]));
  return size;
}
template <class S>
void EmbeddedWorkspace<S>::enter(int row, SparseElimination<S>& elimination) const {
  for (const auto& e : rows_.entries[row]) elimination.entry(embedded_.place(e.coordinate), e.value);
}

template <class S>
void EmbeddedWorkspace<S>::refuse_held(size_t node, int row, int place) {
  refuse_choice(node, "row '" + loops_->names[row] + "' holds '" + tree_.coordinate_names[nodes_[node].coordinates[place]] + "'");
}

template <class S>
void EmbeddedWorkspace<S>::refuse_choice(size_t node, const std::string& what) {
  const auto listed = [&](auto fits) {
    std::string all;
    for (size_t j = 0; j < nodes_[node].coordinates.size(); ++j)
      if (const int i = nodes_[node].coordinates[j]; fits(static_cast<int>(j), i)) all += (all.empty() ? "'" : ", '") + tree_.coordinate_names[i] + "'";
    return all.empty() ? std::string("none") : all;
  };
  const std::string given = listed([&](int, int i) { return wanted_[i] != 0; });
  choose_of(node, false);
  const std::vector<int>& good = choices_[node].independent;
  throw EvaluationError("loops of '" + source_.name() + "': " + given + " are no independent coordinates at this state, as " + what + "; there " +
                        listed([&](int j, int) { return std::find(good.begin(), good.end(), j) != good.end(); }) + " are");
}

template <class S>
void EmbeddedWorkspace<S>::choose(const std::shared_ptr<const ResolvedLoops>& loops, const S* q, const std::vector<int>& given) {
  using std::sqrt;
  set_loops(loops);
  chosen_ = false;
  place(q);
  composite_inertia_tip_to_base(tree_, blocks_);
  weights_.assign(model_->nv, S(1));
  for (int k = 0; k < model_->bodies; ++k)
    for (int i = model_->v_offset[k]; i < model_->v_offset[k] + model_->nv_of[k]; ++i)
      if (const S felt = dot(blocks_.H[i], blocks_.R[k] * blocks_.H[i]) + blocks_.J[i]; felt > S(0)) weights_[i] = sqrt(felt);
  wanted_.assign(model_->nv, 0);
  for (const int i : given) wanted_[i] = 1;
  for (size_t n = 0; n < nodes_.size(); ++n)
    choose_of(n, std::any_of(nodes_[n].coordinates.begin(), nodes_[n].coordinates.end(), [&](int i) { return wanted_[i] != 0; }));
  chosen_ = true;
}

template <class S>
std::vector<int> EmbeddedWorkspace<S>::independent() const {
  std::vector<int> all;
  for (size_t n = 0; chosen_ && n < nodes_.size(); ++n)
    for (const int place : choices_[n].independent) all.push_back(nodes_[n].coordinates[place]);
  return all;
}

template <class S>
int EmbeddedWorkspace<S>::rank() const {
  size_t sum = 0;
  for (const Choice& of : choices_) sum += of.rows.size();
  return static_cast<int>(sum);
}

#define PYCRAFT_INSTANTIATE(S)                                                                                                       \
  template void EmbeddedWorkspace<S>::choose_few(size_t, bool);                                                                    \
  template void EmbeddedWorkspace<S>::choose_many(size_t, bool);                                                                   \
  template void EmbeddedWorkspace<S>::choose_of(size_t, bool);                                                                     \
  template void EmbeddedWorkspace<S>::choose(const std::shared_ptr<const ResolvedLoops>&, const S*, const std::vector<int>&);      \
  template S EmbeddedWorkspace<S>::size_beside_weights(int) const;                                                                 \
  template void EmbeddedWorkspace<S>::enter(int, SparseElimination<S>&) const;                                                     \
  template void EmbeddedWorkspace<S>::refuse_held(size_t, int, int);                                                               \
  template void EmbeddedWorkspace<S>::refuse_choice(size_t, const std::string&);                                                   \
  template std::vector<int> EmbeddedWorkspace<S>::independent() const;                                                             \
  template int EmbeddedWorkspace<S>::rank() const;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
