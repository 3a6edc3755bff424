// Two nodes that something is stretched between: where they are, how fast they part, and equal and opposite forces on them.
#pragma once

#include "model/unit_data.h"
#include "simulation/effect.h"
#include "simulation/selection.h"

namespace pycraft {

// Two different nodes, "" the base, of which one moves at least. ModelError else.
struct NodePair {
  Node a, b;
  NodePair(const Multibody& model, const std::string& a, const std::string& b, const std::string& effect);
  // What is asked of the bodies that carry them, and that they are pushed.
  void declare(Declaration& d, bool twists) const;
};

// A node on its body, in the scalar of an effect.
template <class S>
struct PlacedNode {
  int body;
  Pose<S> pose;  // in its body
  explicit PlacedNode(const Node& node) : body(node.body), pose(renormalised<S>(node.pose)) {}

  Pose<S> in_world(const At<S>& at) const { return body < 0 ? pose : at.pose[body] * pose; }
  Vector3<S> position(const At<S>& at) const { return body < 0 ? pose.p : at.pose[body].p + at.pose[body].R * pose.p; }
  // Of its origin, in the world's axes.
  Vector3<S> velocity(const At<S>& at) const {
    if (body < 0) return Vector3<S>::zero();
    const Vector6<S>& V = at.twist[body];
    return at.pose[body].R * (V.linear + cross(V.angular, pose.p));
  }
  // Its own, in the world's axes.
  Vector3<S> angular_velocity(const At<S>& at) const { return body < 0 ? Vector3<S>::zero() : at.pose[body].R * at.twist[body].angular; }
  // A moment and a force at its origin, in the world's axes.
  void push(const At<S>& at, const Vector3<S>& moment, const Vector3<S>& force, const Forces<S>& out) const {
    if (body < 0) return;
    const Matrix3<S>& R = at.pose[body].R;
    const Vector3<S> f = transpose_times(R, force);
    out.wrench[body] = out.wrench[body] + Vector6<S>{transpose_times(R, moment) + cross(pose.p, f), f};
  }
};

// From a to b: how far, and along which direction; none where they are at one place.
template <class S>
struct Span {
  S length;
  Vector3<S> along;
};
template <class S>
inline Span<S> span_of(const Vector3<S>& d) {
  const S square = dot(d, d);
  if (!(square > S(0))) return {S(0), Vector3<S>::zero()};
  using std::sqrt;
  const S length = sqrt(square);
  return {length, (S(1) / length) * d};
}

}  // namespace pycraft
