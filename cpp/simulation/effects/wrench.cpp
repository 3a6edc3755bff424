#include "simulation/effects/wrench.h"

#include "model/unit_data.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundWrench : public BoundEffect<S> {
 public:
  explicit BoundWrench(const Wrench& of)
      : body_(of.node.body), other_(of.axes.body), fixed_(of.fixed), origin_(cast<S>(of.node.pose.p)), turn_(renormalised<S>(of.axes.pose).R), wrench_(of.wrench) {}

  void forces(const At<S>& at, const Forces<S>& out) override {
    S w[6];
    values_at(*wrench_, at.t, w);
    const Vector3<S> moment = on_body(at, {w[0], w[1], w[2]}), force = on_body(at, {w[3], w[4], w[5]});
    out.wrench[body_] = out.wrench[body_] + Vector6<S>{moment + cross(origin_, force), force};
  }

 private:
  Vector3<S> on_body(const At<S>& at, const Vector3<S>& x) const {
    const Vector3<S> turned = turn_ * x;
    if (fixed_) return turned;
    return transpose_times(at.pose[body_].R, other_ < 0 ? turned : at.pose[other_].R * turned);
  }
  int body_, other_;
  bool fixed_;
  Vector3<S> origin_;
  Matrix3<S> turn_;
  TimeFunction wrench_;
};

}  // namespace

Wrench::Wrench(const Multibody& model, const std::string& on, TimeFunction given, const std::string& in)
    : node(node_named(model, on, "wrench")), axes{"world", -1, Pose<double>::identity()}, fixed(false), wrench(std::move(given)) {
  if (node.body < 0) throw ModelError("wrench: node '" + on + "' is on the base, which no wrench moves");
  if (wrench->size() != 6) throw ModelError("wrench: on '" + on + "' it has " + std::to_string(wrench->size()) + " numbers; a wrench has six, the moment first");
  if (in == "body")
    axes = {"body", node.body, Pose<double>::identity()};
  else if (in != "world")
    axes = node_named(model, in, "wrench");
  fixed = axes.body == node.body;
}

Declaration Wrench::declaration() const {
  Declaration d;
  d.time = !wrench->constant(), d.foreign = wrench->foreign(), d.knots = wrench->knots();
  d.wrenches = {node.body};
  d.work = true;
  if (!fixed) d.poses = {node.body};
  if (!fixed && axes.body >= 0) d.poses.push_back(axes.body);
  return d;
}

PYCRAFT_BIND_EFFECT(Wrench, BoundWrench)

}  // namespace pycraft
