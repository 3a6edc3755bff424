// Configurations of a model, hinge by hinge (model/subhinge_kinds.h): the rate q̇ = N(q) v, the configuration moved along a velocity on the
// model's group, the velocity between two configurations, and the lengths of quaternions.
//
// ω and v of a subhinge are its own outboard axes', so q̇ of a quaternion is orthogonal to it: the exact flow keeps its length, whatever it
// is. Nothing pulls it back: what an integrator makes of |q| is its own error, left to be seen. `move_configuration` keeps the length to the
// rounding of one product; over many moves that walks, unless `scale_quaternions` sets the length to what it was at first.
// Cost O(N).
#pragma once

#include "model/compiled_model.h"
#include "spatial/pose.h"

namespace pycraft {

// Calls f(row, q, v) for every subhinge: its row, and where its coordinates and its velocities begin.
template <class S, class F>
inline void each_subhinge(const CompiledModel<S>& model, F f) {
  int q = 0, v = 0;
  for (const CompiledSubhinge<S>& h : model.subhinges)
    with_subhinge(h.kind, [&](auto row) {
      f(row, q, v);
      q += row.nq, v += row.nv;
    });
}

template <class S>
void configuration_rate(const CompiledModel<S>& model, const S* q, const S* v, S* rate) {
  each_subhinge(model, [&](auto row, int at, int from) { row.rate(q + at, v + from, rate + at); });
}

// out = q moved by u; out may be q.
template <class S>
void move_configuration(const CompiledModel<S>& model, const S* q, const S* u, S* out) {
  each_subhinge(model, [&](auto row, int at, int from) { row.move(q + at, u + from, out + at); });
}

// out = u with move_configuration(p, u) = q, up to the lengths of quaternions.
template <class S>
void configuration_difference(const CompiledModel<S>& model, const S* p, const S* q, S* out) {
  each_subhinge(model, [&](auto row, int at, int from) { row.difference(p + at, q + at, out + from); });
}

// Calls f(q) where a quaternion begins in q.
template <class S, class F>
inline void each_quaternion(const CompiledModel<S>& model, F f) {
  each_subhinge(model, [&](auto row, int at, int) {
    if constexpr (decltype(row)::record.quaternion >= 0) f(at + row.record.quaternion);
  });
}

// Lengths of the quaternions in q, in order: at most one per subhinge.
template <class S>
int quaternion_lengths(const CompiledModel<S>& model, const S* q, S* lengths) {
  int count = 0;
  each_quaternion(model, [&](int at) { lengths[count++] = length(Quaternion<S>{q[at], q[at + 1], q[at + 2], q[at + 3]}); });
  return count;
}

// Quaternions scaled to these lengths, or to one where there are none, in place.
template <class S>
void scale_quaternions(const CompiledModel<S>& model, const S* lengths, S* q) {
  each_quaternion(model, [&](int at) {
    const S want = lengths ? *lengths++ : S(1), scale = want / length(Quaternion<S>{q[at], q[at + 1], q[at + 2], q[at + 3]});
    for (int i = 0; i < 4; ++i) q[at + i] *= scale;
  });
}

}  // namespace pycraft
