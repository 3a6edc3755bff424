// One pair of a loop at a state: the motion of its end on b in that on a along the way between them, its rows (pair_rows.h) and their columns. On
// the way are motions of hinges, and twists that are inserted in them to be differentiated along.
//
// Compiled once a scalar, its derivatives among them (loop_pairs.cpp).
#pragma once

#include <utility>
#include <vector>

#include "recursions/frame_motions.h"
#include "recursions/pair_rows.h"

namespace pycraft {

// A twist fixed in the hinge of a body before one of its subhinges, in the axes there, by an amount of which derivatives alone are taken
// (operators/directions.h): X <- X (1 + ξ~), ξ carried outboard by the steps that follow, and rows of H inboard of it move along.
template <class S>
struct InsertedMotion {
  int body, position;
  Vector6<S> twist;
};

template <class S>
struct LoopBuffers {
  HingeRows<S> hinge;
  std::vector<std::pair<int, Vector6<S>>> columns;     // 𝒥 of one pair
  PairRow<S> rows[most_pair_rows];
  std::vector<S> at_rest;                              // zeros
  std::vector<double> coordinates, gradient, second;   // of a function of the user's
  std::vector<InsertedMotion<S>> inserted;             // inboard first where they are of one hinge
};

// The motion at q and v, as far as `part` wants it, A at rest accelerations (w.at_rest); rows to w.rows.
template <class S>
RelativeMotion<S> find_rows(const CompiledModel<S>& model, const ResolvedLoop& loop, const S* q, const S* v, MotionPart part, LoopBuffers<S>& w);
// The pose at q; rows to w.rows, and 𝒥 to w.columns, of the hinges on the way.
template <class S>
Pose<S> find_rows_and_columns(const CompiledModel<S>& model, const ResolvedLoop& loop, const S* q, LoopBuffers<S>& w);

// ModelError that names a loop whose rows decide by more than comparisons, and so are on no tape.
void refuse_on_tape(const ResolvedLoops& loops);
template <class S>
inline void check_on_tape(const ResolvedLoops& loops) {
  if constexpr (is_recorded<S>) refuse_on_tape(loops);
}

}  // namespace pycraft
