// Hinges: a named sequence of subhinges, each with its axis and point. The outboard side of hinge k is body k's frame.
//
//   X_PB(q) = placement · step_1(q_1) · step_2(q_2) · ...
//
// kind      q                     v                       step, H row(s) in the frame after the step
// pin       angle (rad)           its rate                exp((a; c×a) q)
// slider    travel (m)            its rate                exp((0; a) q)
// screw     angle (rad)           its rate                exp((a; c×a + pitch a) q), pitch in metres per radian
// ball      quaternion w,x,y,z    body-frame ω            rotation about the point c; rows (e_i; c×e_i)
// free      quaternion, x,y,z     body-frame twist (ω; v) pose in the axes before the step; rows the identity
//
// universal: two pins; gimbal: three; cylindrical: pin and slider on one axis (angle, travel); planar: (x, y, angle), two sliders
// and a pin along their cross product; custom: any sequence.
#pragma once

#include <string>
#include <vector>

#include "spatial/pose.h"

namespace pycraft {

enum class SubhingeKind { pin, slider, screw, ball, free };
// Velocity coordinates of one.
constexpr int coordinates(SubhingeKind kind) { return kind == SubhingeKind::ball ? 3 : kind == SubhingeKind::free ? 6 : 1; }

struct Subhinge {
  SubhingeKind kind;
  Vector3<double> axis{0, 0, 1}, point{0, 0, 0};
  double pitch = 0;
  int nq() const { return kind == SubhingeKind::ball ? 4 : kind == SubhingeKind::free ? 7 : 1; }
  int nv() const { return coordinates(kind); }
};

enum class HingeKind { weld, pin, slider, screw, universal, gimbal, cylindrical, planar, ball, free, custom };
const char* hinge_kind_name(HingeKind kind);
HingeKind hinge_kind_from_name(const std::string& name);  // ModelError that lists the kinds
const char* subhinge_kind_name(SubhingeKind kind);
SubhingeKind subhinge_kind_from_name(const std::string& name);

struct Hinge {
  std::string name;
  HingeKind kind = HingeKind::weld;
  Pose<double> placement = Pose<double>::identity();
  std::vector<Subhinge> subhinges;
  std::vector<double> rotor_inertia;  // one per coordinate
  std::vector<double> lower, upper;   // position limits of one-coordinate subhinges, or empty
  int nq() const;
  int nv() const;
};

// The subhinges of a kind from its axes: none for weld, ball and free; one for pin, slider, screw, cylindrical, planar (its normal);
// two for universal, three for gimbal. Axes are normalised; one of zero length is an error that names the hinge.
std::vector<Subhinge> subhinges_of(HingeKind kind, const std::vector<Vector3<double>>& axes, const Vector3<double>& point, double pitch,
                                   const std::string& hinge_name);

}  // namespace pycraft
