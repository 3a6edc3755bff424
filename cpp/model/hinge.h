// Hinges: a named sequence of subhinges, each with its axis and point. The outboard side of hinge k is body k's frame.
//
//   X_PB(q) = placement · step_1(q_1) · step_2(q_2) · ...,  the steps as model/subhinge_kinds.h has them
//
// universal: two pins; gimbal: three; cylindrical: pin and slider on one axis (angle, travel); planar: (x, y, angle), two sliders
// and a pin along their cross product; custom: any sequence; the others: the subhinge of that name alone.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "model/subhinge_kinds.h"
#include "spatial/pose.h"

namespace pycraft {

struct Subhinge {
  SubhingeKind kind;
  Vector3<double> axis{0, 0, 1}, point{0, 0, 0};
  double pitch = 0;
  const SubhingeRecord& record() const { return record_of(kind); }
  int nq() const { return record().nq; }
  int nv() const { return record().nv; }
};

enum class HingeKind { weld, pin, slider, screw, universal, gimbal, cylindrical, planar, ball, free, custom };
// A row of the table of kinds: which subhinges a hinge has, and along which of the axes that its user gives.
struct HingeRecord {
  const char* name;
  int axes;  // that a user gives
  std::vector<std::pair<SubhingeKind, int>> subhinges;
  int nv() const;
};
const std::vector<HingeRecord>& hinge_records();  // in the order of the enumeration
const HingeRecord& record_of(HingeKind kind);
HingeKind hinge_kind_from_name(const std::string& name);  // ModelError that lists the kinds

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

// The hinge's coordinates at zero, after those that are there: a quaternion is that of no rotation.
void append_zero(const Hinge& hinge, std::vector<double>& q);

// The subhinges of a kind from its axes, as many as it takes. Axes are normalised; one of zero length is an error that names the hinge.
std::vector<Subhinge> subhinges_of(HingeKind kind, const std::vector<Vector3<double>>& axes, const Vector3<double>& point, double pitch,
                                   const std::string& hinge_name);
// One subhinge of a custom hinge, by the same checks; what its kind does not have is left at its default.
Subhinge subhinge_of(SubhingeKind kind, const Vector3<double>& axis, const Vector3<double>& point, double pitch, const std::string& hinge_name);

}  // namespace pycraft
