// The numbers of embedded loops, from those of the grouped tree and from the rows of loops.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "algebra/trees/mixed_blocks.h"
#include "algebra/trees/tree_values.h"
#include "operators/embedded_operators.h"
#include "operators/grouped_values.h"
#include "operators/loop_operators.h"
#include "recursions/loop_tangents.h"

namespace pycraft {

constexpr double off_the_loops = 1e-6;         // larger residuals are no state on the loops, as mobility has it (pycraft/models/mobility.py)
constexpr double singular_of_loops = 1e-10;    // pivots below it, by the largest entry, are none

inline std::vector<char> rigid_nodes(const EmbeddedOperators& source) {
  std::vector<char> rigid;
  for (int g = 0; g < source.structure().bodies(); ++g) rigid.push_back(source.is_rigid(g));
  return rigid;
}

// A⁻¹ of an n x n matrix by elimination with complete pivoting; false where a pivot is below singular_of_loops of the largest entry. Recorded, in the
// order of one state, where pivots are above a hundredth.
template <class S>
bool invert_with_complete_pivoting(std::vector<S> A, int n, std::vector<S>& inverse) {
  using std::abs;
  constexpr double least = is_recorded<S> ? 0.01 : singular_of_loops;
  S largest(0);
  for (const S& a : A) largest = maximum(largest, S(abs(a)));
  inverse.assign(size_t(n) * n, S(0));
  for (int i = 0; i < n; ++i) inverse[size_t(i) * n + i] = S(1);
  std::vector<int> column_of(n), free_columns(n);
  for (int j = 0; j < n; ++j) free_columns[j] = j;
  for (int k = 0; k < n; ++k) {
    int row = k, place = 0;
    for (int i = k; i < n; ++i)
      for (size_t c = 0; c < free_columns.size(); ++c)
        if (abs(soft(A[size_t(i) * n + free_columns[c]])) > abs(soft(A[size_t(row) * n + free_columns[place]]))) row = i, place = static_cast<int>(c);
    const int column = free_columns[place];
    const S pivot = A[size_t(row) * n + column];
    if (!(abs(pivot) > S(least) * largest)) return false;
    free_columns.erase(free_columns.begin() + place);
    column_of[k] = column;
    for (int j = 0; j < n; ++j) std::swap(A[size_t(row) * n + j], A[size_t(k) * n + j]), std::swap(inverse[size_t(row) * n + j], inverse[size_t(k) * n + j]);
    for (int i = 0; i < n; ++i) {
      if (i == k) continue;
      const S factor = A[size_t(i) * n + column] / pivot;
      for (int j = 0; j < n; ++j) {
        A[size_t(i) * n + j] -= factor * A[size_t(k) * n + j];
        inverse[size_t(i) * n + j] -= factor * inverse[size_t(k) * n + j];
      }
    }
    for (int j = 0; j < n; ++j) inverse[size_t(k) * n + j] /= pivot;
    for (int j = 0; j < n; ++j) A[size_t(k) * n + j] /= pivot;
  }
  const std::vector<S> rows = inverse;  // row k is that of unknown column_of[k]
  for (int k = 0; k < n; ++k) std::copy_n(rows.begin() + size_t(k) * n, n, inverse.begin() + size_t(column_of[k]) * n);
  return true;
}

template <class S>
class EmbeddedValues final : public TreeValues<MixedBlocks<RigidBlocks<S>>> {
  using Base = TreeValues<MixedBlocks<RigidBlocks<S>>>;

 public:
  explicit EmbeddedValues(const EmbeddedOperators& source)
      : Base(source.structure(), rigid_nodes(source)), source_(source), robot_(source.base()->structure()), grouped_(*source.grouped()),
        maps_(source.structure().bodies()), rates_(source.structure().bodies()), inverses_(source.structure().bodies()), factors_(source.structure().bodies()) {
    this->blocks_.structured.inertia_factors = &factors_;
  }

  void block(const Symbol& symbol, int g, S* out) const override {
    using namespace embedding_letters;
    const SymbolId id = symbol.definition->id;
    if (id == SymbolId::coordinate_map) return copy(maps_[g], out);
    if (id == SymbolId::coordinate_map_rate) return copy(rates_[g], out);
    if (id == SymbolId::coordinate_map_tangent) return copy(map_tangent(g, motion({false, {{1.0, std::get<OfCoordinate>(symbol.arguments)}}})), out);
    if (id == parameter_map_tangent) return copy(map_tangent(g, motion(std::get<OfDirection>(symbol.arguments))), out);
    if (id != second_map_tangent && id != second_map_rate) return Base::block(symbol, g, out);
    const Twists& along = std::get<OfDirection>(symbol.arguments).twists;
    copy(second_tangent(g, along[0].second, {false, {along.begin() + 1, along.end()}}), out);
  }
  void vector(const Symbol& symbol, S* out) const override {
    if (symbol.definition->id == SymbolId::theta_dot) {
      for (int i : source_.independent()) *out++ = v_[i];
      return;
    }
    if (symbol.definition->id == embedding_letters::dependent_shift) return copy(motion(std::get<OfDirection>(symbol.arguments)).w, out);
    grouped_.vector(symbol, out);  // a_g, and H_g* Ẋ θ̇_r
    for (int g = 0; g < this->tree_.bodies(); ++g) {
      const std::vector<S> H = block_of(SymbolId::H, g);
      const int s = this->tree_.size[g], n = static_cast<int>(source_.coordinates_of(g).size());
      std::vector<S> theta;
      for (int place : source_.independent_of(g)) theta.push_back(v_[source_.coordinates_of(g)[place]]);
      std::vector<S> rate(n, S(0));
      multiply_add(rates_[g].data(), theta.data(), rate.data(), n, static_cast<int>(theta.size()), 1);
      transposed_multiply_add(H.data(), rate.data(), out + this->tree_.offset[g], s, n, 1);
    }
  }
  void use(Form form) override { Base::use(form), grouped_.use(form); }

 protected:
  void set_state(const double* q, const double* v) override {
    grouped_.move_to(q, v);
    compiled_ = source_.model().compiled<S>();
    loops_ = source_.loops()->resolved();
    q_.resize(compiled_->nq), v_.resize(compiled_->nv);
    for (int i = 0; i < compiled_->nq; ++i) q_[i] = of_state<S>(q[i], 0, i);
    for (int i = 0; i < compiled_->nv; ++i) v_[i] = of_state<S>(v[i], 1, i);
    check_on_tape<S>(*loops_);
  }

  void fill() override {
    grouped_.require(Group::kinematics);
    LoopBuffers<S> buffers;
    check_on_the_loops(buffers);
    Q_.assign(size_t(loops_->rows) * compiled_->nv, S(0));
    loop_jacobian(*compiled_, *loops_, q_.data(), buffers, [&](int row, int i, const S& number) { Q_[size_t(row) * compiled_->nv + i] = number; });
    for (int g = 0; g < this->tree_.bodies(); ++g) {
      fill_map(g);
      if (source_.is_rigid(g))
        fill_rigid(g);
      else
        fill_node(g);
      if (this->tree_.parent[g] >= 0 && !this->blocks_.is_structured_edge(g)) grouped_.blocks().block(SymbolId::E, g, this->blocks_.dense.edge(g));
    }
  }

  void compute_velocities() override {
    grouped_.require(Group::kinematics | Group::velocities);
    check_velocities();
    for (int g = 0; g < this->tree_.bodies(); ++g) rates_[g] = map_tangent(g, {v_, {}});
  }

 private:
  std::vector<S> block_of(SymbolId id, int g) const {
    const SkoStructure& tree = source_.grouped()->structure();
    const int s = tree.size[g], n = tree.dof[g];
    std::vector<S> out(id == SymbolId::M ? size_t(s) * s : size_t(n) * (id == SymbolId::H ? s : n));
    if (!out.empty()) grouped_.blocks().block(id, g, out.data());
    return out;
  }

  // X = [1; -Q_d⁻¹ Q_r], rows in the order of the node's coordinates.
  void fill_map(int g) {
    const std::vector<int>& independent = source_.independent_of(g);
    const size_t n = source_.coordinates_of(g).size(), r = independent.size();
    maps_[g].assign(n * r, S(0));
    for (size_t j = 0; j < r; ++j) maps_[g][independent[j] * r + j] = S(1);
    const EmbeddedLoops* const loops = source_.loops_of(g);
    if (!loops) return;
    const size_t m = loops->rows.size(), nv = compiled_->nv;
    std::vector<S> of_dependent(m * m), of_independent(m * r);
    for (size_t i = 0; i < m; ++i) {
      const S* const row = Q_.data() + loops->rows[i] * nv;
      for (size_t j = 0; j < m; ++j) of_dependent[i * m + j] = row[loops->dependent[j]];
      for (size_t j = 0; j < r; ++j) of_independent[i * r + j] = row[source_.coordinates_of(g)[independent[j]]];
    }
    if (!invert_with_complete_pivoting(of_dependent, static_cast<int>(m), inverses_[g])) refuse(g);
    put_dependent(g, of_independent, maps_[g]);
  }
  // The dependent rows of a map get -Q_d⁻¹ B.
  void put_dependent(int g, const std::vector<S>& B, std::vector<S>& map) const {
    const EmbeddedLoops& loops = *source_.loops_of(g);
    const size_t m = loops.rows.size(), r = source_.independent_of(g).size();
    const std::vector<int>& coordinates = source_.coordinates_of(g);
    for (size_t i = 0; i < m; ++i) {
      const size_t place = std::find(coordinates.begin(), coordinates.end(), loops.dependent[i]) - coordinates.begin();
      for (size_t j = 0; j < r; ++j) {
        S sum(0);
        for (size_t a = 0; a < m; ++a) sum += inverses_[g][i * m + a] * B[a * r + j];
        map[place * r + j] = -sum;
      }
    }
  }
  static void copy(const std::vector<S>& from, S* out) { std::copy(from.begin(), from.end(), out); }
  // ∂X along a motion: Q_d ∂X_d = -∂Q X.
  std::vector<S> map_tangent(int g, const LoopMotion<S>& along) const {
    std::vector<S> tangent(source_.coordinates_of(g).size() * source_.independent_of(g).size(), S(0));
    if (!moves(g, along)) return tangent;
    const ResolvedLoops own = loops_of(g);
    std::vector<S> moved(source_.loops_of(g)->rows.size() * source_.independent_of(g).size(), S(0));
    LoopTangents<S>(*compiled_, own, q_, along).jacobian([&](int row, int i, const S& entry) { add_product(g, row, i, entry, maps_[g], moved); });
    put_dependent(g, moved, tangent);
    return tangent;
  }
  // first: an independent coordinate, or time; second: as motion() has it.
  std::vector<S> second_tangent(int g, const TwistPlace& first, const OfDirection& second) const {
    std::vector<S> tangent(source_.coordinates_of(g).size() * source_.independent_of(g).size(), S(0));
    const LoopMotion<S> along = motion({false, {{1.0, first}}}), then = motion(second);
    if (!source_.loops_of(g) || (!moves(g, along) && !moves(g, then))) return tangent;
    const std::vector<S> of_first = map_tangent(g, along), of_second = map_tangent(g, then);
    const ResolvedLoops own = loops_of(g);
    const LoopTangents<S> there(*compiled_, own, q_, then);
    LoopMotion<Tangent<S, 1>> moving{{along.w.begin(), along.w.end()}, along.twists};
    const int r = this->tree_.dof[g];
    for (size_t a = 0; a < source_.coordinates_of(g).size(); ++a)
      for (int j = 0; j < r; ++j) {
        const int i = this->tree_.dof_offset[g] + j;
        const S rate = is_time(first) ? v_[source_.coordinates_of(g)[source_.independent_of(g)[j]]] : S(first == TwistPlace(OfCoordinate{i}) ? 1 : 0);
        moving.w[source_.coordinates_of(g)[a]].d[0] += of_second[a * r + j] * rate;
      }
    std::vector<S> moved(source_.loops_of(g)->rows.size() * size_t(r), S(0));
    LoopTangents<Tangent<S, 1>>(there.model, own, there.q, moving, there.inserted).jacobian([&](int row, int i, const Tangent<S, 1>& entry) {
      add_product(g, row, i, entry.d[0], maps_[g], moved);
      add_product(g, row, i, entry.x, of_second, moved);
    });
    there.jacobian([&](int row, int i, const S& entry) { add_product(g, row, i, entry, of_first, moved); });
    put_dependent(g, moved, tangent);
    return tangent;
  }
  // to += the part of row `row` of Q X that comes from this entry, where that row is solved in node g.
  void add_product(int g, int row, int i, const S& entry, const std::vector<S>& X, std::vector<S>& to) const {
    const std::vector<int>&rows = source_.loops_of(g)->rows, &coordinates = source_.coordinates_of(g);
    const auto at = std::lower_bound(rows.begin(), rows.end(), row);
    const auto column = std::find(coordinates.begin(), coordinates.end(), i);
    if (at == rows.end() || *at != row || column == coordinates.end()) return;
    const size_t r = source_.independent_of(g).size(), a = column - coordinates.begin(), b = at - rows.begin();
    for (size_t j = 0; j < r; ++j) to[b * r + j] += entry * X[a * r + j];
  }
  bool moves(int g, const LoopMotion<S>& along) const {
    const std::vector<int>& own = source_.coordinates_of(g);
    return source_.loops_of(g) && (!along.twists.empty() || std::any_of(own.begin(), own.end(), [&](int i) { return !vanishes(along.w[i]); }));
  }
  // The loops whose rows are solved in node g.
  ResolvedLoops loops_of(int g) const {
    const std::vector<int>& rows = source_.loops_of(g)->rows;
    ResolvedLoops own;
    own.rows = loops_->rows;
    for (const ResolvedLoop& loop : loops_->loops) {
      const auto at = std::lower_bound(rows.begin(), rows.end(), loop.first_row);
      if (at != rows.end() && *at < loop.first_row + loop.rows) own.loops.push_back(loop);
    }
    return own;
  }
  // Of the tree on its loops: along an independent coordinate, along time, or along twists in hinges.
  LoopMotion<S> motion(const OfDirection& given) const {
    if (is_time(given.twists[0].second)) return {v_, {}};
    LoopMotion<S> along{std::vector<S>(compiled_->nv, S(0)), {}};
    if (std::holds_alternative<OfTwist>(given.twists[0].second)) {
      for (const auto& [c, place] : given.twists) along.twists.emplace_back(c, std::get<OfTwist>(place));
      follow(along);
      return along;
    }
    const int i = std::get<OfCoordinate>(given.twists[0].second).coordinate;
    int g = 0;
    while (this->tree_.dof_offset[g + 1] <= i) ++g;
    const size_t r = this->tree_.dof[g];
    for (size_t a = 0; a < source_.coordinates_of(g).size(); ++a) along.w[source_.coordinates_of(g)[a]] = maps_[g][a * r + i - this->tree_.dof_offset[g]];
    return along;
  }
  // w of the dependent coordinates, Q_d w_d = -∂r. EvaluationError where other rows do not follow.
  void follow(LoopMotion<S>& along) const {
    using std::abs;
    const LoopTangents<S> moved(*compiled_, *loops_, q_, along);
    LoopBuffers<Tangent<S, 1>> buffers;
    buffers.inserted = moved.inserted;
    std::vector<Tangent<S, 1>> residual(loops_->rows, Tangent<S, 1>(S(0)));
    loop_residuals(moved.model, moved.by_rule, moved.q.data(), buffers, residual.data());
    for (int g = 0; g < this->tree_.bodies(); ++g) {
      const EmbeddedLoops* const set = source_.loops_of(g);
      for (size_t i = 0; set && i < set->rows.size(); ++i)
        for (size_t a = 0; a < set->rows.size(); ++a) along.w[set->dependent[i]] -= inverses_[g][i * set->rows.size() + a] * residual[set->rows[a]].d[0];
    }
    for (int row = 0; row < loops_->rows; ++row) {
      S left = residual[row].d[0], size = S(1) + abs(left);
      for (int i = 0; i < compiled_->nv; ++i) left += Q_[size_t(row) * compiled_->nv + i] * along.w[i], size += abs(Q_[size_t(row) * compiled_->nv + i] * along.w[i]);
      if (!loops_->of_positions[row] || !(abs(left) <= S(off_the_loops) * size))
        throw EvaluationError("embedded loops of '" + source_.model().name() + "' have no derivative along that parameter: row '" + loops_->names[row] + "' " +
                              (loops_->of_positions[row] ? "hangs on the others, and is broken where the parameter changes" : "is of velocities, and no state follows from independent coordinates"));
    }
  }

  void fill_node(int g) {
    DenseBlocks<S>& to = this->blocks_.dense;
    const int s = this->tree_.size[g], n = static_cast<int>(source_.coordinates_of(g).size()), r = this->tree_.dof[g];
    grouped_.blocks().block(SymbolId::M, g, to.mass(g));
    const std::vector<S> H = block_of(SymbolId::H, g), J = block_of(SymbolId::J, g);
    std::fill_n(to.hinge_map(g), size_t(r) * s, S(0));
    transposed_multiply_add(maps_[g].data(), H.data(), to.hinge_map(g), r, n, s);
    std::vector<S> JX(size_t(n) * r, S(0));
    multiply_add(J.data(), maps_[g].data(), JX.data(), n, n, r);
    std::fill_n(to.hinge_diagonal(g), size_t(r) * r, S(0));
    transposed_multiply_add(maps_[g].data(), JX.data(), to.hinge_diagonal(g), r, n, r);
  }
  void fill_rigid(int g) {
    const RigidBlocks<S>& from = grouped_.blocks().structured;
    RigidBlocks<S>& own = this->blocks_.structured;
    own.pose[g] = from.pose[g], own.inertia[g] = from.inertia[g], factors_[g] = (*from.inertia_factors)[g];
    for (int j = 0; j < this->tree_.dof[g]; ++j) {
      const int to = this->tree_.dof_offset[g] + j, at = source_.grouped()->structure().dof_offset[g] + j;
      own.H[to] = from.H[at], own.J[to] = from.J[at], own.aligned[to] = from.aligned[at];
    }
  }

  void check_on_the_loops(LoopBuffers<S>& buffers) const {
    std::vector<S> residual(loops_->rows);
    loop_residuals(*compiled_, *loops_, q_.data(), buffers, residual.data());
    using std::abs;
    for (int row = 0; row < loops_->rows; ++row)
      if (!(abs(residual[row]) <= S(std::max(off_the_loops, 64 * to_double(epsilon<S>())))))
        throw EvaluationError("'" + source_.model().name() + "' is not on its loops: row '" + loops_->names[row] + "' is off by " + std::to_string(std::abs(to_double(residual[row]))) +
                              "; embedded loops have numbers at states of assemble()");
  }
  void check_velocities() const {
    using std::abs;
    for (int row = 0; row < loops_->rows; ++row) {
      S sum(0), size(0);
      for (int i = 0; i < compiled_->nv; ++i) {
        const S term = Q_[size_t(row) * compiled_->nv + i] * v_[i];
        sum += term, size += abs(term);
      }
      if (!(abs(sum) <= S(off_the_loops) * (S(1) + size)))
        throw EvaluationError("the velocities of '" + source_.model().name() + "' break row '" + loops_->names[row] + "', which goes at " + std::to_string(to_double(sum)) +
                              "; those of assemble() keep the loops");
    }
  }
  // Which coordinates the rows may be solved for here, of all around these loops: by complete pivoting, row after row.
  [[noreturn]] void refuse(int g) const {
    const EmbeddedLoops& loops = *source_.loops_of(g);
    const std::vector<int>& coordinates = source_.coordinates_of(g);
    const size_t m = loops.rows.size(), n = coordinates.size();
    std::vector<double> A(m * n);
    double largest = 0;
    for (size_t i = 0; i < m; ++i)
      for (size_t j = 0; j < n; ++j) {
        A[i * n + j] = to_double(Q_[size_t(loops.rows[i]) * compiled_->nv + coordinates[j]]);
        largest = std::max(largest, std::abs(A[i * n + j]));
      }
    std::vector<char> row_taken(m, 0), column_taken(n, 0);
    size_t rank = 0;
    for (; rank < m; ++rank) {
      double best = 1e-8 * largest;
      size_t row = m, column = n;
      for (size_t i = 0; i < m; ++i)
        for (size_t j = 0; j < n; ++j)
          if (!row_taken[i] && !column_taken[j] && std::abs(A[i * n + j]) > best) best = std::abs(A[i * n + j]), row = i, column = j;
      if (row == m) break;
      row_taken[row] = column_taken[column] = 1;
      for (size_t i = 0; i < m; ++i) {
        if (row_taken[i]) continue;
        const double factor = A[i * n + column] / A[row * n + column];
        for (size_t j = 0; j < n; ++j) A[i * n + j] -= factor * A[row * n + j];
      }
    }
    const auto listed = [](const std::vector<std::string>& names) {
      std::string text;
      for (const std::string& name : names) text += (text.empty() ? "'" : ", '") + name + "'";
      return text.empty() ? std::string("none") : text;
    };
    std::vector<std::string> own, others, lost;
    for (int place : source_.independent_of(g)) own.push_back(robot_.coordinate_names[coordinates[place]]);
    for (size_t j = 0; j < n; ++j)
      if (!column_taken[j]) others.push_back(robot_.coordinate_names[coordinates[j]]);
    for (size_t i = 0; i < m; ++i)
      if (!row_taken[i]) lost.push_back(loops_->names[loops.rows[i]]);
    if (rank < m)
      throw EvaluationError("loops of '" + source_.model().name() + "' are singular at this state: row" + (lost.size() > 1 ? "s " : " ") + listed(lost) +
                            " hang on the others here and not elsewhere, and no coordinates describe what is free");
    std::vector<std::string> rows;
    for (int row : loops.rows) rows.push_back(loops_->names[row]);
    throw EvaluationError("loops of '" + source_.model().name() + "': at this state rows " + listed(rows) + " do not follow from " + listed(own) +
                          ", which are no independent coordinates here; " + listed(others) + " are, soa.embedded(independent=...)");
  }

  const EmbeddedOperators& source_;
  const SkoStructure& robot_;
  GroupedValues<S> grouped_;
  std::shared_ptr<const CompiledModel<S>> compiled_;
  std::shared_ptr<const ResolvedLoops> loops_;
  std::vector<S> q_, v_, Q_;
  std::vector<std::vector<S>> maps_, rates_, inverses_;  // X, Ẋ, Q_d⁻¹, node by node
  std::vector<InertiaFactors<S>> factors_;
};

}  // namespace pycraft
