// The rate of the configuration, q̇ = N(q) v, hinge by hinge, and the configuration moved along a velocity on the model's group.
//
// kind                 q̇                                        moved by u (a velocity times a duration)
// pin, slider, screw   v                                        q + u
// ball                 ½ q⊗(0, ω)                               q⊗exp(ω)
// free                 ½ q⊗(0, ω),  ṗ = R(q/|q|) v             the pose times exp(ω; v) on SE(3)
//
// ω and v are the body's own, so q̇ is orthogonal to q: the exact flow keeps a quaternion's length, whatever it is. Nothing pulls it back:
// what an integrator makes of |q| is its own error, left to be seen. `move_configuration` keeps the length to the rounding of one product;
// over many moves that walks, unless `scale_quaternions` sets the length to what it was at first.
// Cost O(N).
#pragma once

#include "model/compiled_model.h"
#include "spatial/pose.h"

namespace pycraft {

template <class S>
void configuration_rate(const CompiledModel<S>& model, const S* q, const S* v, S* rate) {
  for (const CompiledSubhinge<S>& h : model.subhinges) {
    if (h.kind != SubhingeKind::ball && h.kind != SubhingeKind::free) {
      *rate++ = *v++;
      ++q;
      continue;
    }
    const Quaternion<S> at{q[0], q[1], q[2], q[3]};
    const Quaternion<S> product = at * Quaternion<S>{S(0), v[0], v[1], v[2]};
    rate[0] = product.w / S(2), rate[1] = product.x / S(2), rate[2] = product.y / S(2), rate[3] = product.z / S(2);
    q += 4, v += 3, rate += 4;
    if (h.kind == SubhingeKind::free) {
      const Vector3<S> moved = quaternion_rotation(at) * Vector3<S>{v[0], v[1], v[2]};
      for (int i = 0; i < 3; ++i) rate[i] = moved[i];
      q += 3, v += 3, rate += 3;
    }
  }
}

// out = q moved by u; out may be q.
template <class S>
void move_configuration(const CompiledModel<S>& model, const S* q, const S* u, S* out) {
  for (const CompiledSubhinge<S>& h : model.subhinges) {
    if (h.kind != SubhingeKind::ball && h.kind != SubhingeKind::free) {
      *out++ = *q++ + *u++;
      continue;
    }
    const Vector3<S> w{u[0], u[1], u[2]};
    const Quaternion<S> from{q[0], q[1], q[2], q[3]}, to = from * exp_quaternion(w);
    if (h.kind == SubhingeKind::free) {
      const Vector3<S> moved = quaternion_rotation(from) * screw_translation(w, Vector3<S>{u[3], u[4], u[5]});
      for (int i = 0; i < 3; ++i) out[4 + i] = q[4 + i] + moved[i];
    }
    out[0] = to.w, out[1] = to.x, out[2] = to.y, out[3] = to.z;
    const int nq = h.kind == SubhingeKind::free ? 7 : 4, nv = h.kind == SubhingeKind::free ? 6 : 3;
    q += nq, out += nq, u += nv;
  }
}

// Lengths of the quaternions in q, in order: at most one per subhinge.
template <class S>
int quaternion_lengths(const CompiledModel<S>& model, const S* q, S* lengths) {
  using std::sqrt;
  int count = 0;
  for (const CompiledSubhinge<S>& h : model.subhinges) {
    const bool turns = h.kind == SubhingeKind::ball || h.kind == SubhingeKind::free;
    if (turns) lengths[count++] = sqrt(S(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]));
    q += h.kind == SubhingeKind::free ? 7 : turns ? 4 : 1;
  }
  return count;
}

// Quaternions scaled to these lengths, or to one where there are none, in place.
template <class S>
void scale_quaternions(const CompiledModel<S>& model, const S* lengths, S* q) {
  using std::sqrt;
  for (const CompiledSubhinge<S>& h : model.subhinges) {
    const bool turns = h.kind == SubhingeKind::ball || h.kind == SubhingeKind::free;
    if (turns) {
      const S want = lengths ? *lengths++ : S(1), have = sqrt(S(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]));
      for (int i = 0; i < 4; ++i) q[i] *= want / have;
    }
    q += h.kind == SubhingeKind::free ? 7 : turns ? 4 : 1;
  }
}

}  // namespace pycraft
