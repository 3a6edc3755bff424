// Rows of a pair of frames (model/loops.h) as functions of the motion of one, the end frame on b, in the other, that on a:
//
//   r(X),   ṙ = g·V,   r̈ = g·V̇ + ġ·V
//
// The residuals, with ε the vector of X's quaternion of w >= 0 (|ε| the sine of half the angle):
//
//   about x, y, z   2ε                                                       g = (w ω + ε × ω),  ġ·V = -½ |ω|² ε
//   about x, y      (-R_yz, R_xz)/√((1 + R_zz)/2): |r| = 2 sin(angle between the axes / 2)
//   along x, y, z   p;   between the axes   R_zz - cos;   along and about z   p_z - pitch (angle about z + 2π n), n such that |r| is least
//   custom          what is left of about and along all axes at the nearest place of the hinge (custom_rows.h)
//   across          the quadric of p;   across 1, 2   along two normals at the nearest place of a curve (curve_rows.h);   contact   the height of the wheel's or ball's lowest point
//
// Each is zero where the loop is closed and nowhere else, and smooth but where a turn of half a circle is missing: there 2ε changes its sign,
// and the direction of (about x, y) is none; its length 2 is right. Exchanging a and b leaves what the rows span, where the loop is closed.
//
// Rows of velocities: the velocity of the point of contact, in the ground's directions (z its normal), of a wheel of radius ρ about its axis z,
//
//   e = (g_x, g_y, 0)/μ, g = R*z, μ² = g_x² + g_y²:   c = -ρ e,  u = v + ω × c = 0:   rolling (z × e)·u,  sideways (g × (z × e))·u
//
// of a ball c = -ρ g, and of a blade v_z. Source: A. Jain, Robot and Multibody Dynamics, Springer 2011 (Q of loops); quaternions of
// joints: A. Shabana, Dynamics of Multibody Systems, Cambridge 2013.
#pragma once

#include <array>

#include "model/loops.h"
#include "recursions/motion_functions.h"

namespace pycraft {

// A row of a pair: r, zero of velocities; g; ġ·V.
template <class S>
struct PairRow {
  S residual;
  Vector6<S> gradient;
  S rate;
  PairRow() : residual(0), gradient(Vector6<S>::zero()), rate(0) {}
  PairRow(const MotionFunction<S>& f) : residual(f.value), gradient(f.gradient), rate(f.rate) {}
  // Of velocities: the sum of coefficient functions times entries of V.
  PairRow(const std::array<MotionFunction<S>, 6>& c, const Vector6<S>& V) : PairRow() {
    for (int i = 0; i < 6; ++i) gradient[i] = c[i].value, rate = rate + c[i].dot * V[i];
  }
};
constexpr int most_pair_rows = 6;

// The rows of a pair at its motion, of its velocity where rates are wanted. Compiled once a scalar (pair_rows.cpp), its derivatives among them.
template <class S>
void pair_rows(const FramePair& pair, const RelativeMotion<S>& m, PairRow<S>* out);

}  // namespace pycraft
