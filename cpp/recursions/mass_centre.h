// The centre of mass of all bodies, and what is about it: velocity, inertia, momentum, momentum matrix and its derivatives, in world axes.
//
//   c = Σ m_b c_b / m,   ċ = Σ m_b v_b / m,   I_G = Σ (R_b I_b R_b* + m_b point(c_b - c)),   h_G = Σ (R_b I_b ω_b + m_b (c_b - c) × (v_b - ċ); m_b v_b)
//
// about c from the start, so that nothing large cancels. Of coordinate j with the composite inertia R and twist S_j of what is outboard, about
// the body's origin at s from c (recursions/inertial_frame.h), column j is
//
//   A_j = (n + s × f; f),  (n; f) = R S_j,    Ȧ_j = (ṅ + s × ḟ - ċ × f; ḟ),  (ṅ; ḟ) = Ṙ S_j + R Ṡ_j,  Ṙ = [[İ, f~], [-f~, 0]] of the momentum f,
//   ∂_j h_G = (∂n + s × ∂f - ∂_jc × m ċ; ∂f),  ∂(n; f) = crf(S_j) p + R ψ̇_j,  m ∂_jc the linear part of A_j.
//
// h_G = A v and ḣ_G = A v̇ + Ȧ v. Velocities are those that the frame of the first root sees: neither where a model is nor how fast it travels
// takes digits. Source: D. E. Orin, A. Goswami, L. Lee, Centroidal dynamics of a humanoid robot, Autonomous Robots 2013. Cost O(N).
#pragma once

#include <algorithm>
#include <vector>

#include "recursions/inertial_frame.h"

namespace pycraft {

template <class S>
struct MassCentre {
  S mass;
  Vector3<S> position, velocity;
  Symmetric3<S> inertia;  // about it
  Vector6<S> momentum;    // about it
};

template <class S>
class MassCentreSums {
 public:
  explicit MassCentreSums(const CompiledModel<S>& model) : root_(model.bodies), centre_(model.bodies), speed_(model.bodies) {
    for (int k = 0; k < model.bodies; ++k) root_[k] = model.parent[k] < 0 ? k : root_[model.parent[k]];
  }

  // From a frame that was filled. Of no mass, the position is not finite.
  const MassCentre<S>& fill(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const InertialFrame<S>& frame) {
    const Vector3<S> none = Vector3<S>::zero();
    first_ = model.bodies ? blocks.pose[0].p : none;
    travel_ = model.bodies ? frame_travel(frame, blocks, 0) : none;
    S mass(0);
    Vector3<S> moment = none, momentum = none;
    for (int k = model.bodies - 1; k >= 0; --k) {  // tips first, which are the lightest as a rule
      const MassProperties& of = model.mass_properties[k];
      const Matrix3<S>& world = blocks.pose[root_[k]].R;
      const Vector3<S> com = frame.axes[k] * cast<S>(of.com);
      centre_[k] = blocks.pose[root_[k]].p - first_ + world * (frame.origin[k] + com);
      speed_[k] = frame_travel(frame, blocks, root_[k]) - travel_ + world * (frame.V[k].linear + cross(frame.V[k].angular, com));
      mass += S(of.mass);
      moment = moment + S(of.mass) * centre_[k];
      momentum = momentum + S(of.mass) * speed_[k];
    }
    offset_ = (S(1) / mass) * moment, speed_of_all_ = (S(1) / mass) * momentum;
    all_ = {mass, first_ + offset_, travel_ + speed_of_all_, Symmetric3<S>::zero(), Vector6<S>::zero()};
    for (int k = model.bodies - 1; k >= 0; --k) add(model, blocks, frame, k);
    all_.momentum.linear = momentum + mass * travel_;
    return all_;
  }

  // Columns of A, Ȧ and ∂h_G/∂q, (6 x nv) each.
  void columns(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const InertialFrame<S>& frame, S* matrix, S* rate, S* dq) const {
    const int N = model.nv;
    for (int j = 0; j < N; ++j) {
      const int k = frame.body_of[j];
      check_interrupt_at(j);
      const Matrix3<S>& world = blocks.pose[root_[k]].R;
      const Vector3<S> s = blocks.pose[root_[k]].p - first_ - offset_ + world * frame.origin[k];
      const Vector3<S> travel = frame_travel(frame, blocks, root_[k]) - travel_;  // of the frame that sees the body, beside the first
      const Vector6<S>& twist = frame.twist[j];
      const MomentumRate<S>& B = frame.B[k];
      const auto turned = [&](const Vector6<S>& f) { return Vector6<S>{world * f.angular, world * f.linear}; };
      const Vector6<S> own = turned(frame.R[k] * twist);
      const Vector6<S> changing = turned(Vector6<S>{B.rate * twist.angular + cross(B.momentum.linear, twist.linear), -cross(B.momentum.linear, twist.angular)} +
                                         frame.R[k] * frame.twist_rate[j]);
      Vector6<S> changed = turned(cross_force(twist, B.momentum) + frame.R[k] * frame.psi_dot[j]);
      changed.angular = changed.angular + cross(own.linear, travel);
      const Vector6<S> column = force_inboard(s, own);
      Vector6<S> column_rate = force_inboard(s, changing), change = force_inboard(s, changed);
      column_rate.angular = column_rate.angular - cross(speed_of_all_ - travel, own.linear);
      change.angular = change.angular - cross(column.linear, speed_of_all_);
      for (int i = 0; i < 6; ++i) {
        const size_t at = size_t(i) * N + j;
        matrix[at] = column[i], rate[at] = column_rate[i], dq[at] = change[i];
      }
    }
  }

 private:
  static Vector3<S> frame_travel(const InertialFrame<S>& frame, const RigidBlocks<S>& blocks, int root) { return blocks.pose[root].R * frame.travel[root]; }

  void add(const CompiledModel<S>& model, const RigidBlocks<S>& blocks, const InertialFrame<S>& frame, int k) {
    const MassProperties& of = model.mass_properties[k];
    const Matrix3<S>& world = blocks.pose[root_[k]].R;
    const Vector3<S> arm = centre_[k] - offset_, speed = speed_[k] - speed_of_all_;
    const Symmetric3<S> own = rotate(world * frame.axes[k], cast<S>(of.about_com)), point = point_inertia(arm);
    for (int i = 0; i < 6; ++i) all_.inertia.s[i] += own.s[i] + S(of.mass) * point.s[i];
    all_.momentum.angular = all_.momentum.angular + own * (world * frame.V[k].angular) + S(of.mass) * cross(arm, speed);
  }

  std::vector<int> root_;
  std::vector<Vector3<S>> centre_, speed_;  // per body: of its centre of mass, from the first root's origin, seen from its frame
  Vector3<S> first_, travel_, offset_, speed_of_all_;
  MassCentre<S> all_;
};

}  // namespace pycraft
