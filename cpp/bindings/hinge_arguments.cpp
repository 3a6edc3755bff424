#include "bindings/hinge_arguments.h"

#include "runtime/errors.h"

namespace pycraft {

namespace {

std::string subhinge_kinds() {
  std::string all;
  for (const SubhingeRecord& row : subhinge_records) all += (all.empty() ? "" : ", ") + std::string(row.name);
  return all;
}

// A subhinge from a mapping with "kind", and "axis", "point", "pitch" as far as the kind has them.
Subhinge subhinge_from(const py::handle& item, const std::string& hinge) {
  const std::string name = "hinge '" + hinge + "'";
  if (!py::isinstance<py::dict>(item))
    throw ModelError(name + ": a subhinge is a dict with kind, axis, point and pitch, not " + std::string(py::repr(item)).substr(0, 80));
  const py::dict d = py::reinterpret_borrow<py::dict>(item);
  for (const auto& [key, _] : d) {
    const std::string text = py::str(key);
    if (text != "kind" && text != "axis" && text != "point" && text != "pitch")
      throw ModelError(name + ": a subhinge has no '" + text + "'; there are kind, axis, point, pitch");
  }
  if (!d.contains("kind") || !py::isinstance<py::str>(d["kind"]))
    throw ModelError(name + ": a subhinge says its kind, one of " + subhinge_kinds() + ": {\"kind\": \"pin\"}");
  const SubhingeKind kind = subhinge_kind_from_name(py::cast<std::string>(d["kind"]));
  Vector3<double> axis{0, 0, 1}, point{0, 0, 0};
  double pitch = 0;
  if (d.contains("axis")) axis = to_vector3(d["axis"], ("axis of " + name).c_str());
  if (d.contains("point")) point = to_vector3(d["point"], ("point of " + name).c_str());
  if (d.contains("pitch")) pitch = one_number(d["pitch"], ("pitch of " + name).c_str());
  return subhinge_of(kind, axis, point, pitch, hinge);
}

}  // namespace

Pose<double> pose_from(const py::object& rotation, const py::object& position, const std::string& what) {
  Pose<double> X = Pose<double>::identity();
  if (!rotation.is_none()) X.R = to_matrix3(rotation, ("rotation of " + what).c_str());
  if (!position.is_none()) X.p = to_vector3(position, ("position of " + what).c_str());
  return X;
}

Hinge hinge_from(const std::string& name, const std::string& kind, const std::vector<py::object>& axes, const py::object& point, const py::object& pitch,
                 const py::object& subhinges, const py::object& rotation, const py::object& position, const py::object& rotor_inertia,
                 const py::object& lower, const py::object& upper) {
  Hinge hinge;
  hinge.name = name;
  const std::string shown = "hinge '" + name + "'";
  hinge.kind = hinge_kind_from_name(kind);
  if (!subhinges.is_none()) {
    for (const auto& item : subhinges) hinge.subhinges.push_back(subhinge_from(item, name));
  } else {
    std::vector<Vector3<double>> directions;
    for (const py::object& a : axes) directions.push_back(to_vector3(a, ("axis of " + shown).c_str()));
    const Vector3<double> at = point.is_none() ? Vector3<double>{0, 0, 0} : to_vector3(point, ("point of " + shown).c_str());
    hinge.subhinges = subhinges_of(hinge.kind, directions, at, one_number(pitch, ("pitch of " + shown).c_str()), name);
  }
  hinge.placement = pose_from(rotation, position, "the placement of " + shown);
  if (!rotor_inertia.is_none()) hinge.rotor_inertia = list_of_numbers(rotor_inertia, ("rotor inertia of " + shown).c_str());
  if (!lower.is_none()) hinge.lower = list_of_numbers(lower, ("lower limit of " + shown).c_str());
  if (!upper.is_none()) hinge.upper = list_of_numbers(upper, ("upper limit of " + shown).c_str());
  return hinge;
}

}  // namespace pycraft
