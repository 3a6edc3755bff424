#include "model/hinge.h"

#include <algorithm>
#include <cmath>

#include "runtime/errors.h"

namespace pycraft {

namespace {

Vector3<double> unit(const Vector3<double>& axis, const std::string& hinge) {
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(axis[i])) throw ModelError("hinge '" + hinge + "': its axis has an entry that is not a number");
  const double largest = std::max({std::abs(axis[0]), std::abs(axis[1]), std::abs(axis[2])});
  if (largest > 1e150) return unit({axis[0] / largest, axis[1] / largest, axis[2] / largest}, hinge);  // whose square is no number
  const double length = norm(axis);
  if (!(length > 1e-12)) throw ModelError("hinge '" + hinge + "': its axis has length " + std::to_string(length) + "; give a direction");
  // A length that is one to rounding is left alone: an axis along a coordinate stays exactly so.
  if (std::abs(length - 1) <= 4e-16) return axis;
  return {axis[0] / length, axis[1] / length, axis[2] / length};
}

constexpr int none = -1;  // no axis

template <class Records>
size_t row_called(const std::string& name, const char* what, const Records& records) {
  std::string all;
  size_t i = 0;
  for (const auto& row : records) {
    if (name == row.name) return i;
    all += (i++ ? ", " : "") + std::string(row.name);
  }
  throw ModelError(std::string("no ") + what + " kind is called '" + name + "'; there are " + all);
}

// A point and a pitch are numbers, and given to hinges that have them.
void check_numbers(const std::string& kind, const std::vector<std::pair<SubhingeKind, int>>& subhinges, const Vector3<double>& point, double pitch,
                   const std::string& hinge) {
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(point[i])) throw ModelError("hinge '" + hinge + "': its point has an entry that is not a number");
  if (!std::isfinite(pitch)) throw ModelError("hinge '" + hinge + "': its pitch is not a number");
  const auto any = [&](bool SubhingeRecord::* has) {
    return std::any_of(subhinges.begin(), subhinges.end(), [&](const auto& s) { return record_of(s.first).*has; });
  };
  const auto has_no = [&](const char* what) { throw ModelError("hinge '" + hinge + "' of kind '" + kind + "' has no " + what + "; leave it out"); };
  if (pitch != 0 && !any(&SubhingeRecord::pitch)) has_no("pitch");
  if (norm(point) != 0 && !any(&SubhingeRecord::point)) has_no("point");
}

Subhinge subhinge_along(SubhingeKind kind, const Vector3<double>& axis, const Vector3<double>& point, double pitch) {
  return {kind, axis, point, record_of(kind).pitch ? pitch : 0};
}

// A plane's x and y after its normal: x is the coordinate axis least aligned with the normal, made orthogonal to it; y completes the
// right-handed frame.
void add_axes_across(std::vector<Vector3<double>>& axes, const std::string& hinge) {
  const Vector3<double> n = axes[0];
  Vector3<double> x{1, 0, 0}, y{0, 1, 0};
  if (n[2] != 1) {
    const int least = std::abs(n[0]) <= std::abs(n[1]) && std::abs(n[0]) <= std::abs(n[2]) ? 0 : std::abs(n[1]) <= std::abs(n[2]) ? 1 : 2;
    Vector3<double> e{0, 0, 0};
    e[least] = 1;
    x = unit(e - dot(e, n) * n, hinge);
    y = cross(n, x);
  }
  axes.push_back(x), axes.push_back(y);
}

}  // namespace

const std::vector<HingeRecord>& hinge_records() {
  using enum SubhingeKind;
  static const std::vector<HingeRecord> records = {
      {"weld", 0, {}},
      {"pin", 1, {{pin, 0}}},
      {"slider", 1, {{slider, 0}}},
      {"screw", 1, {{screw, 0}}},
      {"universal", 2, {{pin, 0}, {pin, 1}}},
      {"gimbal", 3, {{pin, 0}, {pin, 1}, {pin, 2}}},
      {"cylindrical", 1, {{pin, 0}, {slider, 0}}},
      {"planar", 1, {{slider, 1}, {slider, 2}, {pin, 0}}},  // the normal is given, two axes across it are found
      {"ball", 0, {{ball, none}}},
      {"free", 0, {{free, none}}},
      {"custom", 0, {}},
  };
  return records;
}
const HingeRecord& record_of(HingeKind kind) { return hinge_records()[static_cast<size_t>(kind)]; }

HingeKind hinge_kind_from_name(const std::string& name) { return static_cast<HingeKind>(row_called(name, "hinge", hinge_records())); }
SubhingeKind subhinge_kind_from_name(const std::string& name) { return static_cast<SubhingeKind>(row_called(name, "subhinge", subhinge_records)); }

int HingeRecord::nv() const {
  int n = 0;
  for (const auto& [kind, axis] : subhinges) n += record_of(kind).nv;
  return n;
}
int Hinge::nq() const {
  int n = 0;
  for (const Subhinge& s : subhinges) n += s.nq();
  return n;
}
int Hinge::nv() const {
  int n = 0;
  for (const Subhinge& s : subhinges) n += s.nv();
  return n;
}

std::vector<Subhinge> subhinges_of(HingeKind kind, const std::vector<Vector3<double>>& given, const Vector3<double>& point, double pitch,
                                   const std::string& hinge) {
  if (kind == HingeKind::custom) throw ModelError("hinge '" + hinge + "' of kind 'custom' takes its subhinges one by one");
  const HingeRecord& row = record_of(kind);
  check_numbers(row.name, row.subhinges, point, pitch, hinge);
  std::vector<Vector3<double>> axes;
  for (const Vector3<double>& a : given) axes.push_back(unit(a, hinge));
  if (static_cast<int>(axes.size()) != row.axes)
    throw ModelError("hinge '" + hinge + "' of kind '" + row.name + "' takes " + std::to_string(row.axes) + " axes, not " + std::to_string(axes.size()));
  if (kind == HingeKind::planar) add_axes_across(axes, hinge);
  std::vector<Subhinge> made;
  for (const auto& [subhinge, axis] : row.subhinges) made.push_back(subhinge_along(subhinge, axis == none ? Vector3<double>{0, 0, 1} : axes[axis], point, pitch));
  return made;
}

Subhinge subhinge_of(SubhingeKind kind, const Vector3<double>& axis, const Vector3<double>& point, double pitch, const std::string& hinge) {
  check_numbers(record_of(kind).name, {{kind, 0}}, point, pitch, hinge);
  return subhinge_along(kind, record_of(kind).axis ? unit(axis, hinge) : Vector3<double>{0, 0, 1}, point, pitch);
}

void append_zero(const Hinge& hinge, std::vector<double>& q) {
  for (const Subhinge& s : hinge.subhinges) {
    const size_t at = q.size();
    q.resize(at + s.nq(), 0.0);
    if (s.record().quaternion >= 0) q[at + s.record().quaternion] = 1;
  }
}

}  // namespace pycraft
