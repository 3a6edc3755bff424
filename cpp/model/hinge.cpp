#include "model/hinge.h"

#include <cmath>

#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr const char* kinds[] = {"weld", "pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free", "custom"};
constexpr const char* subhinge_kinds[] = {"pin", "slider", "screw", "ball", "free"};

Vector3<double> unit(const Vector3<double>& axis, const std::string& hinge) {
  const double length = norm(axis);
  if (!std::isfinite(length)) throw ModelError("hinge '" + hinge + "': its axis has an entry that is not a number");
  if (!(length > 1e-12)) throw ModelError("hinge '" + hinge + "': its axis has length " + std::to_string(length) + "; give a direction");
  // A length that is one to rounding is left alone: an axis along a coordinate stays exactly so.
  if (std::abs(length - 1) <= 4e-16) return axis;
  return {axis[0] / length, axis[1] / length, axis[2] / length};
}

}  // namespace

const char* hinge_kind_name(HingeKind kind) { return kinds[static_cast<int>(kind)]; }
const char* subhinge_kind_name(SubhingeKind kind) { return subhinge_kinds[static_cast<int>(kind)]; }

HingeKind hinge_kind_from_name(const std::string& name) {
  std::string all;
  for (int i = 0; i < 11; ++i) {
    if (name == kinds[i]) return static_cast<HingeKind>(i);
    all += (i ? ", " : "") + std::string(kinds[i]);
  }
  throw ModelError("no hinge kind is called '" + name + "'; there are " + all);
}

SubhingeKind subhinge_kind_from_name(const std::string& name) {
  for (int i = 0; i < 5; ++i)
    if (name == subhinge_kinds[i]) return static_cast<SubhingeKind>(i);
  throw ModelError("no subhinge kind is called '" + name + "'; there are pin, slider, screw, ball, free");
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
  const auto need = [&](size_t count) {
    if (given.size() != count)
      throw ModelError("hinge '" + hinge + "' of kind '" + hinge_kind_name(kind) + "' takes " + std::to_string(count) + " axes, not " +
                       std::to_string(given.size()));
  };
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(point[i])) throw ModelError("hinge '" + hinge + "': its point has an entry that is not a number");
  if (!std::isfinite(pitch)) throw ModelError("hinge '" + hinge + "': its pitch is not a number");
  const auto has_no = [&](const char* what, bool given_all_the_same) {
    if (given_all_the_same) throw ModelError("hinge '" + hinge + "' of kind '" + hinge_kind_name(kind) + "' has no " + what + "; leave it out");
  };
  has_no("pitch", pitch != 0 && kind != HingeKind::screw);
  has_no("point", (kind == HingeKind::weld || kind == HingeKind::free) && norm(point) != 0);
  std::vector<Vector3<double>> axes;
  for (const Vector3<double>& a : given) axes.push_back(unit(a, hinge));
  switch (kind) {
    case HingeKind::weld: need(0); return {};
    case HingeKind::pin: need(1); return {{SubhingeKind::pin, axes[0], point}};
    case HingeKind::slider: need(1); return {{SubhingeKind::slider, axes[0], point}};
    case HingeKind::screw: need(1); return {{SubhingeKind::screw, axes[0], point, pitch}};
    case HingeKind::universal: need(2); return {{SubhingeKind::pin, axes[0], point}, {SubhingeKind::pin, axes[1], point}};
    case HingeKind::gimbal:
      need(3);
      return {{SubhingeKind::pin, axes[0], point}, {SubhingeKind::pin, axes[1], point}, {SubhingeKind::pin, axes[2], point}};
    case HingeKind::cylindrical: need(1); return {{SubhingeKind::pin, axes[0], point}, {SubhingeKind::slider, axes[0], point}};
    case HingeKind::planar: {
      // x is the coordinate axis least aligned with the normal, made orthogonal to it; y completes the right-handed frame.
      need(1);
      const Vector3<double> n = axes[0];
      Vector3<double> x, y;
      if (n[2] == 1) {
        x = {1, 0, 0}, y = {0, 1, 0};
      } else {
        const int least = std::abs(n[0]) <= std::abs(n[1]) && std::abs(n[0]) <= std::abs(n[2]) ? 0 : std::abs(n[1]) <= std::abs(n[2]) ? 1 : 2;
        Vector3<double> e{0, 0, 0};
        e[least] = 1;
        const Vector3<double> projected = e - dot(e, n) * n;
        x = unit(projected, hinge);
        y = cross(n, x);
      }
      return {{SubhingeKind::slider, x, point}, {SubhingeKind::slider, y, point}, {SubhingeKind::pin, n, point}};
    }
    case HingeKind::ball: need(0); return {{SubhingeKind::ball, {0, 0, 1}, point}};
    case HingeKind::free: need(0); return {{SubhingeKind::free, {0, 0, 1}, {0, 0, 0}}};
    case HingeKind::custom: throw ModelError("hinge '" + hinge + "' of kind 'custom' takes its subhinges one by one");
  }
  return {};
}

}  // namespace pycraft
