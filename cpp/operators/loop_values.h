// The numbers of rows of loops as operators, from the rows' own recursions.
#pragma once

#include <algorithm>
#include <vector>

#include "model/unit_data.h"
#include "operators/loop_operators.h"
#include "operators/rigid_trees.h"
#include "recursions/loop_tangents.h"

namespace pycraft {

// The letters' numbers: a source's own (algebra/language/symbol.h).
namespace loop_letters {
constexpr SymbolId Q = static_cast<SymbolId>(1001), dQ = static_cast<SymbolId>(1002), A = static_cast<SymbolId>(1003), dA = static_cast<SymbolId>(1004);
constexpr SymbolId ddQ = static_cast<SymbolId>(1005), ddA = static_cast<SymbolId>(1006);
}  // namespace loop_letters

// put(loop, end, row, g): the rows of pairs on the twists of what their ends stand on, 0: a, 1: b; a row is g_a·V_a + g_b·V_b.
template <class S, class F>
void loop_rows_on_ends(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, LoopBuffers<S>& w, F put) {
  for (const ResolvedLoop& loop : loops.loops) {
    if (loop.loop->is_coupling()) continue;
    const Pose<S> X = find_rows(model, loop, q, static_cast<const S*>(nullptr), MotionPart::pose, w).X;
    for (int i = 0; i < loop.rows; ++i) {
      const Vector6<S>& g = w.rows[i].gradient;
      put(loop, 1, loop.first_row + i, force_to_parent(renormalised<S>(loop.loop->pair.end_b), g));
      put(loop, 0, loop.first_row + i, S(-1) * force_to_parent(renormalised<S>(loop.loop->pair.end_a), force_to_parent(X, g)));
    }
  }
}

template <class S>
class LoopValues final : public TreeValues<RigidBlocks<S>> {
 public:
  explicit LoopValues(const LoopOperators& source) : TreeValues<RigidBlocks<S>>(source.structure()), source_(source) {
    body_of_.resize(this->tree_.coordinates());
    for (int k = 0; k < this->tree_.bodies(); ++k) std::fill(body_of_.begin() + this->tree_.dof_offset[k], body_of_.begin() + this->tree_.dof_offset[k + 1], k);
    column_of_.resize(source.ends().size()), end_body_.resize(source.ends().size()), columns_.assign(this->tree_.bodies(), 0);
    for (size_t i = 0; i < source.ends().size(); ++i) {
      const int node = source.ends()[i];
      end_body_[i] = node >= 0 ? source.model().node(node).body : -1 - node;
      column_of_[i] = columns_[end_body_[i]], columns_[end_body_[i]] += 6;
    }
  }

  void block(const Symbol& symbol, int k, S* out) const override {
    const SymbolId id = symbol.definition->id;
    const bool jacobian = symbol.definition->domain == SpaceKind::Theta;
    std::fill_n(out, source_.rows_of(k).size() * (jacobian ? this->tree_.dof[k] : columns_[k]), S(0));
    const ResolvedLoops own = loops_of(k);
    if (id == loop_letters::Q || id == loop_letters::A) return put(own, *compiled_, q_, {}, jacobian, k, out, [](const S& x) { return x; });
    const OfDirection& given = std::get<OfDirection>(symbol.arguments);
    if (id == loop_letters::dQ || id == loop_letters::dA) {
      const LoopTangents<S> moved(*compiled_, own, q_, motion(given));
      if (jacobian) return moved.jacobian([&](int row, int i, const S& entry) { put_entry(row, i, k, entry, out); });
      return put(moved.by_rule, moved.model, moved.q, moved.inserted, jacobian, k, out, [](const Tangent<S, 1>& x) { return x.d[0]; });
    }
    const LoopMotion<S> first = motion(direction_at(given.twists[0].second));  // which stays along the second
    const LoopTangents<S> there(*compiled_, own, q_, motion(direction_at(given.twists[1].second)));
    const LoopMotion<Tangent<S, 1>> kept{{first.w.begin(), first.w.end()}, first.twists};
    const LoopTangents<Tangent<S, 1>> moved(there.model, own, there.q, kept, there.inserted);
    if (jacobian) return moved.jacobian([&](int row, int i, const Tangent<S, 1>& entry) { put_entry(row, i, k, entry.d[0], out); });
    put(moved.by_rule, moved.model, moved.q, moved.inserted, jacobian, k, out, [](const Tangent<Tangent<S, 1>, 1>& x) { return x.d[0].d[0]; });
  }

 protected:
  void set_state(const double* q, const double* v) override {
    compiled_ = source_.model().compiled<S>();
    loops_ = source_.loops().resolved();
    q_.resize(compiled_->nq), v_.resize(compiled_->nv);
    for (int i = 0; i < compiled_->nq; ++i) q_[i] = of_state<S>(q[i], 0, i);
    for (int i = 0; i < compiled_->nv; ++i) v_[i] = of_state<S>(v[i], 1, i);
    check_on_tape<S>(*loops_);
  }
  void fill() override {}

 private:
  // Of the loops that have rows at body k.
  ResolvedLoops loops_of(int k) const {
    ResolvedLoops own;
    own.rows = loops_->rows;
    for (const ResolvedLoop& loop : loops_->loops)
      if (loop.rows && std::binary_search(source_.rows_of(k).begin(), source_.rows_of(k).end(), loop.first_row)) own.loops.push_back(loop);
    return own;
  }
  int row_at(int k, int row) const { return static_cast<int>(std::lower_bound(source_.rows_of(k).begin(), source_.rows_of(k).end(), row) - source_.rows_of(k).begin()); }

  // Block k of Q or A in any scalar, what `take` takes of its entries.
  template <class T, class F>
  void put(const ResolvedLoops& loops, const CompiledModel<T>& model, const std::vector<T>& q, const std::vector<InsertedMotion<T>>& inserted, bool jacobian, int k, S* out,
           F take) const {
    LoopBuffers<T> buffers;
    buffers.inserted = inserted;
    if (jacobian)
      return loop_jacobian(model, loops, q.data(), buffers, [&](int row, int i, const T& number) { put_entry(row, i, k, take(number), out); });
    loop_rows_on_ends(model, loops, q.data(), buffers, [&](const ResolvedLoop& loop, int end, int row, const Vector6<T>& g) {
      const LoopOperators::Ends& ends = source_.ends_of(*loop.loop);
      const int place = end ? ends.b : ends.a;
      if (place < 0 || end_body_[place] != k) return;
      for (int i = 0; i < 6; ++i) out[row_at(k, row) * columns_[k] + column_of_[place] + i] += take(g[i]);
    });
  }
  void put_entry(int row, int i, int k, const S& entry, S* out) const {
    if (body_of_[i] == k) out[row_at(k, row) * this->tree_.dof[k] + i - this->tree_.dof_offset[k]] += entry;
  }
  LoopMotion<S> motion(const OfDirection& along) const {
    if (along.time) return {v_, {}};
    LoopMotion<S> made{std::vector<S>(v_.size(), S(0)), {}};
    for (const auto& [c, place] : along.twists)
      if (const auto* of = std::get_if<OfCoordinate>(&place)) made.w[of->coordinate] += S(c);
      else made.twists.emplace_back(c, std::get<OfTwist>(place));
    return made;
  }

  const LoopOperators& source_;
  std::shared_ptr<const CompiledModel<S>> compiled_;
  std::shared_ptr<const ResolvedLoops> loops_;
  std::vector<S> q_, v_;
  std::vector<int> body_of_;                         // coordinates
  std::vector<int> column_of_, end_body_, columns_;  // of ends, in their body's block of A; how many a body has
};

}  // namespace pycraft
