#include "model/checks.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr double given_digits = 1e-6;  // a rotation with fewer right digits is none
constexpr double rounding = 1e-14;     // products of a few rotations stay below; what does is left to the last bit

double off_orthogonal(const Matrix3<double>& R) {
  const Matrix3<double> gram = transpose(R) * R;
  double off = 0;
  for (int i = 0; i < 9; ++i) off = std::max(off, std::abs(gram.m[i] - (i % 4 == 0)));
  return off;
}

// The orthogonal factor of the polar decomposition, by Newton's iteration without an inverse [N. Higham, Functions of Matrices, SIAM 2008, chapter 8]:
// R ← R (3 I − R*R) / 2 squares what R is off, so that three steps from 1e-6 end at rounding.
Matrix3<double> nearest_rotation(Matrix3<double> R) {
  for (int step = 0; step < 3; ++step) {
    Matrix3<double> half = transpose(R) * R;
    for (int i = 0; i < 9; ++i) half.m[i] = ((i % 4 == 0 ? 3.0 : 0.0) - half.m[i]) / 2;
    R = R * half;
  }
  return R;
}

std::string listed(const std::vector<SubhingeKind>& kinds) {
  std::string text;
  for (SubhingeKind kind : kinds) text += (text.empty() ? "" : ", ") + std::string(record_of(kind).name);
  return text.empty() ? "none" : text;
}

}  // namespace

std::string short_number(double x) {
  char buffer[32];
  std::snprintf(buffer, sizeof buffer, "%.6g", x);
  return buffer;
}

void throw_unknown(const char* what, const std::string& name, const std::string& model, const std::unordered_map<std::string, int>& known) {
  std::string text = std::string("no ") + what + " of '" + model + "' is called '" + name + "'; there are ";
  std::vector<std::string> names;
  for (const auto& [known_name, _] : known) names.push_back(known_name);
  std::sort(names.begin(), names.end());
  if (names.empty()) text += "none";
  for (size_t i = 0; i < names.size() && i < 12; ++i) text += (i ? ", " : "") + names[i];
  if (names.size() > 12) text += ", ... (" + std::to_string(names.size()) + " in all)";
  throw ModelError(text);
}

Pose<double> checked_pose(const Pose<double>& pose, const std::string& what) {
  for (int i = 0; i < 9; ++i)
    if (!std::isfinite(pose.R.m[i]) || (i < 3 && !std::isfinite(pose.p[i]))) throw ModelError(what + " has an entry that is not a number");
  const double off = off_orthogonal(pose.R);
  if (!(off <= given_digits))
    throw ModelError("the rotation of " + what + " is not orthogonal (off by " + short_number(off) + "); its columns are three unit vectors at right angles");
  if (determinant(pose.R) < 0) throw ModelError("the rotation of " + what + " is a reflection; its columns are a right-handed frame");
  return off <= rounding ? pose : Pose<double>{nearest_rotation(pose.R), pose.p};
}

Pose<double> placed_on(const Pose<double>& frame, const Pose<double>& pose, const std::string& what) {
  const Pose<double> checked = checked_pose(pose, what), none = Pose<double>::identity();
  const bool moved = !std::equal(frame.R.m, frame.R.m + 9, none.R.m) || frame.p[0] != 0 || frame.p[1] != 0 || frame.p[2] != 0;
  return moved ? checked_pose(frame * checked, what) : checked;
}

std::vector<double> checked_rotor_inertia(const Hinge& hinge, std::vector<double> values) {
  const int nv = hinge.nv();
  if (values.empty()) values.assign(nv, 0.0);
  if (values.size() == 1 && nv > 1) values.assign(nv, values[0]);
  if (static_cast<int>(values.size()) != nv)
    throw ModelError("hinge '" + hinge.name + "' has " + std::to_string(nv) + " coordinates and " + std::to_string(values.size()) + " rotor inertias");
  for (double j : values)
    if (!(j >= 0) || !std::isfinite(j)) throw ModelError("hinge '" + hinge.name + "': rotor inertia " + short_number(j) + " is not a nonnegative number");
  return values;
}

void check_limits(const Hinge& hinge, const std::vector<double>& lower, const std::vector<double>& upper) {
  if (lower.empty() && upper.empty()) return;
  const std::string name = "hinge '" + hinge.name + "'";
  const size_t count = hinge.subhinges.size();
  if (lower.size() != count || upper.size() != count)
    throw ModelError(name + " takes " + std::to_string(count) + " lower and " + std::to_string(count) + " upper limits, one a subhinge (" +
                     record_of(hinge.kind).name + "), not " + std::to_string(lower.size()) + " and " + std::to_string(upper.size()));
  for (size_t i = 0; i < count; ++i) {
    const auto pair = [&] { return "(" + short_number(lower[i]) + ", " + short_number(upper[i]) + ")"; };
    if (!(lower[i] < std::numeric_limits<double>::infinity()) || !(upper[i] > -std::numeric_limits<double>::infinity()))
      throw ModelError(name + ": limits " + pair() + " leave no position; a side without a limit is -inf below, inf above");
    if (lower[i] > upper[i]) throw ModelError(name + ": limits " + pair() + " are the wrong way round; give (lower, upper)");
    if (!hinge.subhinges[i].record().limits() && (std::isfinite(lower[i]) || std::isfinite(upper[i])))
      throw ModelError(name + ": limits " + pair() + " of a " + hinge.subhinges[i].record().name +
                       " subhinge; only one coordinate has limits, give it (-inf, inf)");
  }
}

Hinge checked_hinge(Hinge hinge) {
  std::vector<SubhingeKind> wanted, given;
  for (const auto& [kind, axis] : record_of(hinge.kind).subhinges) wanted.push_back(kind);
  for (const Subhinge& s : hinge.subhinges) given.push_back(s.kind);
  if (hinge.kind != HingeKind::custom && given != wanted)
    throw ModelError("hinge '" + hinge.name + "' of kind '" + record_of(hinge.kind).name + "' has the subhinges " + listed(wanted) + ", not " + listed(given) +
                     "; a hinge of your own is of kind 'custom'");
  hinge.placement = checked_pose(hinge.placement, "the placement of hinge '" + hinge.name + "'");
  hinge.rotor_inertia = checked_rotor_inertia(hinge, std::move(hinge.rotor_inertia));
  check_limits(hinge, hinge.lower, hinge.upper);
  return hinge;
}

void check_configuration(const Hinge& hinge, const double* q) {
  int first = 0;
  for (const Subhinge& s : hinge.subhinges) {
    const SubhingeRecord& r = s.record();
    for (int i = first; i < first + r.nq; ++i)
      if (!std::isfinite(q[i])) throw ModelError("q of hinge '" + hinge.name + "': entry " + std::to_string(i) + " is " + short_number(q[i]));
    if (r.quaternion >= 0) {
      const double* at = q + first + r.quaternion;
      const double size = length(Quaternion<double>{at[0], at[1], at[2], at[3]});
      if (size < 1e-8)
        throw ModelError("q of hinge '" + hinge.name + "': its quaternion has length " + short_number(size) + " and no direction; (1, 0, 0, 0) is no rotation");
    }
    first += r.nq;
  }
}

void check_rates(const Hinge& hinge, const double* v, const char* what) {
  for (int i = 0; i < hinge.nv(); ++i)
    if (!std::isfinite(v[i])) throw ModelError(std::string(what) + " of hinge '" + hinge.name + "': entry " + std::to_string(i) + " is " + short_number(v[i]));
}

std::string check_mass_properties(const std::string& body, double mass, const Vector3<double>& com, const Symmetric3<double>& inertia) {
  if (!std::isfinite(mass)) throw ModelError("body '" + body + "': its mass is " + short_number(mass));
  if (mass < 0) throw ModelError("body '" + body + "': its mass is " + short_number(mass) + " kg; a mass is not negative");
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(com[i])) throw ModelError("body '" + body + "': its centre of mass has an entry that is " + short_number(com[i]));
  double largest = 0;
  for (double x : inertia.s) {
    if (!std::isfinite(x)) throw ModelError("body '" + body + "': its inertia has an entry that is " + short_number(x));
    largest = std::max(largest, std::abs(x));
  }
  if (largest == 0) return "";
  Eigen::Matrix3d A;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) A(i, j) = inertia(i, j);
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(A, Eigen::EigenvaluesOnly).eigenvalues();
  // Published numbers carry rounding: a negative moment within 1e-12 of the largest entry, or of a point mass of 30 nm, is that.
  const double printed = 1e-12 * largest + 1e-15 * mass;
  if (moments[0] < -printed)
    throw ModelError("body '" + body + "': its inertia has the principal moment " + short_number(moments[0]) + " kg m²; an inertia is positive semidefinite");
  const double violation = moments[2] - moments[0] - moments[1];
  if (violation <= 1e-9 * largest + printed) return "";
  return "body '" + body + "': its principal moments " + short_number(moments[0]) + ", " + short_number(moments[1]) + ", " + short_number(moments[2]) +
         " kg m² violate the triangle inequality by " + short_number(violation) + "; no distribution of mass has them";
}

}  // namespace pycraft
