// The kinds of subhinges, each a row: sizes, names, step, rows of H, rate, and the group that its coordinates are on.
//
// kind      q                     v                       step, H row(s) in the frame after the step
// pin       angle (rad)           its rate                exp((a; c×a) q)
// slider    travel (m)            its rate                exp((0; a) q)
// screw     angle (rad)           its rate                exp((a; c×a + pitch a) q), pitch in metres per radian
// ball      quaternion w,x,y,z    body-frame ω            rotation about the point c; rows (e_i; c×e_i)
// free      quaternion, x,y,z     body-frame twist (ω; v) pose in the axes before the step; rows the identity
//
// What the functions of a row are, q its coordinates, u and v numbers of its velocity:
//
//   step(h, q)             the pose of the frame after the subhinge in the frame before it
//   rows(h, out)           its rows of H, in the frame after it, the same at every q
//   rate(q, v, out)        q̇
//   move(q, u, out)        q moved along u for unit time, out may be q; a quaternion keeps its length to the rounding of a product
//   difference(p, q, out)  u with move(p, u) = q, up to the lengths of quaternions; rotations by at most π
//   bracket(u, v, out)     [u, v] of the group: zero, ω×ω, or the cross product of twists
//   cobracket(u, p, out)   its transpose on momenta: cobracket(u, p)·v = p·[u, v]
//
// A new kind is its row here, its name in the enumeration, in `with_subhinge` and in `subhinge_records`.
#pragma once

#include <string>

#include "spatial/pose.h"

namespace pycraft {

enum class SubhingeKind { pin, slider, screw, ball, free };

// A subhinge as a kernel wants it.
template <class S>
struct CompiledSubhinge {
  SubhingeKind kind;
  Vector6<S> twist;   // of its one coordinate, where it has one
  Vector3<S> axis, point;
  S pitch;
};

// What a row says without a state.
struct SubhingeRecord {
  const char* name;
  int nq, nv;
  int quaternion;             // where a unit quaternion (w, x, y, z) stands in q, -1: nowhere
  int translation, translations;  // the coordinates of v that move the body along lines whatever q is: the first, and how many
  bool axis, point, pitch;    // what a user gives
  bool angle;                 // its one coordinate is in radians
  bool limits() const { return nq == 1; }
};

// One coordinate, along a twist fixed in the frames before and after.
struct OneCoordinate {
  static constexpr int nq = 1, nv = 1;
  template <class S>
  static void rows(const CompiledSubhinge<S>& h, Vector6<S>* out) {
    out[0] = h.twist;
  }
  template <class S>
  static void rate(const S*, const S* v, S* out) {
    out[0] = v[0];
  }
  template <class S>
  static void move(const S* q, const S* u, S* out) {
    out[0] = q[0] + u[0];
  }
  template <class S>
  static void difference(const S* p, const S* q, S* out) {
    out[0] = q[0] - p[0];
  }
  template <class S>
  static void bracket(const S*, const S*, S* out) {
    out[0] = S(0);
  }
  template <class S>
  static void cobracket(const S*, const S*, S* out) {
    out[0] = S(0);
  }
};

struct PinSubhinge : OneCoordinate {
  static constexpr SubhingeRecord record{"pin", nq, nv, -1, 0, 0, true, true, false, true};
  template <class S>
  static Vector6<S> twist(const Vector3<S>& axis, const Vector3<S>& point, const S&) {
    return {axis, cross(point, axis)};
  }
  // By its axis and point, not by the general exponential: exact for large angles too.
  template <class S>
  static Pose<S> step(const CompiledSubhinge<S>& h, const S* q) {
    const Matrix3<S> R = axis_rotation(h.axis, q[0]);
    return {R, h.point - R * h.point};
  }
};

struct SliderSubhinge : OneCoordinate {
  static constexpr SubhingeRecord record{"slider", nq, nv, -1, 0, 1, true, true, false, false};
  template <class S>
  static Vector6<S> twist(const Vector3<S>& axis, const Vector3<S>&, const S&) {
    return {Vector3<S>::zero(), axis};
  }
  template <class S>
  static Pose<S> step(const CompiledSubhinge<S>& h, const S* q) {
    return {Matrix3<S>::identity(), q[0] * h.axis};
  }
};

struct ScrewSubhinge : OneCoordinate {
  static constexpr SubhingeRecord record{"screw", nq, nv, -1, 0, 0, true, true, true, true};
  template <class S>
  static Vector6<S> twist(const Vector3<S>& axis, const Vector3<S>& point, const S& pitch) {
    return {axis, cross(point, axis) + pitch * axis};
  }
  template <class S>
  static Pose<S> step(const CompiledSubhinge<S>& h, const S* q) {
    const Pose<S> turned = PinSubhinge::step(h, q);
    return {turned.R, turned.p + (h.pitch * q[0]) * h.axis};
  }
};

// Rotations are unit quaternions, read as q/|q|; ω is in the axes after the step.
struct BallSubhinge {
  static constexpr int nq = 4, nv = 3;
  static constexpr SubhingeRecord record{"ball", nq, nv, 0, 0, 0, false, true, false, false};
  template <class S>
  static Vector6<S> twist(const Vector3<S>&, const Vector3<S>&, const S&) {
    return Vector6<S>::zero();
  }
  template <class S>
  static Pose<S> step(const CompiledSubhinge<S>& h, const S* q) {
    const Matrix3<S> R = quaternion_rotation(Quaternion<S>{q[0], q[1], q[2], q[3]});
    return {R, h.point - R * h.point};
  }
  template <class S>
  static void rows(const CompiledSubhinge<S>& h, Vector6<S>* out) {
    for (int j = 0; j < 3; ++j) {
      Vector3<S> e = Vector3<S>::zero();
      e[j] = S(1);
      out[j] = {e, cross(h.point, e)};
    }
  }
  // ½ q⊗(0, ω): orthogonal to q, so that the exact flow keeps the quaternion's length, whatever it is.
  template <class S>
  static void rate(const S* q, const S* v, S* out) {
    const Quaternion<S> product = Quaternion<S>{q[0], q[1], q[2], q[3]} * Quaternion<S>{S(0), v[0], v[1], v[2]};
    out[0] = product.w / S(2), out[1] = product.x / S(2), out[2] = product.y / S(2), out[3] = product.z / S(2);
  }
  // q⊗exp(ω)
  template <class S>
  static void move(const S* q, const S* u, S* out) {
    const Quaternion<S> to = Quaternion<S>{q[0], q[1], q[2], q[3]} * exp_quaternion(Vector3<S>{u[0], u[1], u[2]});
    out[0] = to.w, out[1] = to.x, out[2] = to.y, out[3] = to.z;
  }
  template <class S>
  static void difference(const S* p, const S* q, S* out) {
    const Quaternion<S> from = with_squares<S>({p[0], -p[1], -p[2], -p[3]}), to = with_squares<S>({q[0], q[1], q[2], q[3]});
    const Vector3<S> w = log_quaternion(from * to);
    for (int i = 0; i < 3; ++i) out[i] = w[i];
  }
  template <class S>
  static void bracket(const S* u, const S* v, S* out) {
    const Vector3<S> w = cross(Vector3<S>{u[0], u[1], u[2]}, Vector3<S>{v[0], v[1], v[2]});
    for (int i = 0; i < 3; ++i) out[i] = w[i];
  }
  template <class S>
  static void cobracket(const S* u, const S* p, S* out) {
    bracket(p, u, out);
  }
};

// A rotation as a ball's, then a position in the axes before the step; its velocity is the twist of the body, in the body's axes.
struct FreeSubhinge {
  static constexpr int nq = 7, nv = 6;
  static constexpr SubhingeRecord record{"free", nq, nv, 0, 3, 3, false, false, false, false};
  template <class S>
  static Vector6<S> twist(const Vector3<S>&, const Vector3<S>&, const S&) {
    return Vector6<S>::zero();
  }
  template <class S>
  static Pose<S> step(const CompiledSubhinge<S>&, const S* q) {
    return {quaternion_rotation(Quaternion<S>{q[0], q[1], q[2], q[3]}), {q[4], q[5], q[6]}};
  }
  template <class S>
  static void rows(const CompiledSubhinge<S>&, Vector6<S>* out) {
    for (int j = 0; j < 6; ++j) {
      out[j] = Vector6<S>::zero();
      out[j][j] = S(1);
    }
  }
  // The position's rate is R(q/|q|) v.
  template <class S>
  static void rate(const S* q, const S* v, S* out) {
    BallSubhinge::rate(q, v, out);
    const Vector3<S> moved = quaternion_rotation(Quaternion<S>{q[0], q[1], q[2], q[3]}) * Vector3<S>{v[3], v[4], v[5]};
    for (int i = 0; i < 3; ++i) out[4 + i] = moved[i];
  }
  // The pose times exp(ω; v) on SE(3).
  template <class S>
  static void move(const S* q, const S* u, S* out) {
    const Vector3<S> w{u[0], u[1], u[2]};
    const Vector3<S> moved = quaternion_rotation(Quaternion<S>{q[0], q[1], q[2], q[3]}) * screw_translation(w, Vector3<S>{u[3], u[4], u[5]});
    for (int i = 0; i < 3; ++i) out[4 + i] = q[4 + i] + moved[i];
    BallSubhinge::move(q, u, out);
  }
  template <class S>
  static void difference(const S* p, const S* q, S* out) {
    BallSubhinge::difference(p, q, out);
    const Matrix3<S> R = quaternion_rotation(Quaternion<S>{p[0], p[1], p[2], p[3]});
    const Vector6<S> twist = log_pose(Vector3<S>{out[0], out[1], out[2]}, transpose_times(R, Vector3<S>{q[4] - p[4], q[5] - p[5], q[6] - p[6]}));
    for (int i = 0; i < 6; ++i) out[i] = twist[i];
  }
  template <class S>
  static void bracket(const S* u, const S* v, S* out) {
    const Vector6<S> w = cross_motion(Vector6<S>{{u[0], u[1], u[2]}, {u[3], u[4], u[5]}}, Vector6<S>{{v[0], v[1], v[2]}, {v[3], v[4], v[5]}});
    for (int i = 0; i < 6; ++i) out[i] = w[i];
  }
  template <class S>
  static void cobracket(const S* u, const S* p, S* out) {
    const Vector6<S> f = cross_force(Vector6<S>{{u[0], u[1], u[2]}, {u[3], u[4], u[5]}}, Vector6<S>{{p[0], p[1], p[2]}, {p[3], p[4], p[5]}});
    for (int i = 0; i < 6; ++i) out[i] = -f[i];
  }
};

// f(row) of the row of a kind.
template <class F>
inline decltype(auto) with_subhinge(SubhingeKind kind, F&& f) {
  switch (kind) {
    case SubhingeKind::slider: return f(SliderSubhinge{});
    case SubhingeKind::screw: return f(ScrewSubhinge{});
    case SubhingeKind::ball: return f(BallSubhinge{});
    case SubhingeKind::free: return f(FreeSubhinge{});
    case SubhingeKind::pin: break;
  }
  return f(PinSubhinge{});
}

// In the order of the enumeration.
inline constexpr SubhingeRecord subhinge_records[] = {PinSubhinge::record, SliderSubhinge::record, ScrewSubhinge::record, BallSubhinge::record,
                                                      FreeSubhinge::record};
constexpr const SubhingeRecord& record_of(SubhingeKind kind) { return subhinge_records[static_cast<int>(kind)]; }
SubhingeKind subhinge_kind_from_name(const std::string& name);  // ModelError that lists the kinds

}  // namespace pycraft
