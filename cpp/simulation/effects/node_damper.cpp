#include "simulation/effects/node_damper.h"

#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundNodeDamper : public BoundEffect<S> {
 public:
  explicit BoundNodeDamper(const NodeDamper& of) : a_(of.nodes.a), b_(of.nodes.b), c_(of.coefficient) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    const Vector3<S> along = span_of(b_.position(at) - a_.position(at)).along, none = Vector3<S>::zero();
    const Vector3<S> pull = (c_ * dot(along, b_.velocity(at) - a_.velocity(at))) * along;  // on a
    a_.push(at, none, pull, out);
    b_.push(at, none, -pull, out);
  }
  std::optional<Edge> edge(const At<S>& at) override {
    const Vector3<S> d = b_.position(at) - a_.position(at);
    if (c_ == S(0) || dot(d, d) > S(0)) return {};
    return Edge{"its nodes are at one place"};
  }

 private:
  PlacedNode<S> a_, b_;
  S c_;
};

}  // namespace

NodeDamper::NodeDamper(const Multibody& model, const std::string& a, const std::string& b, double c) : nodes(model, a, b, "node_damper"), coefficient(c) {
  if (!std::isfinite(c)) throw ModelError("node_damper: coefficient is " + short_number(c));
}

Declaration NodeDamper::declaration() const {
  Declaration d;
  d.velocities = d.only_in_motion = d.work = true;
  nodes.declare(d, true);
  return d;
}

PYCRAFT_BIND_EFFECT(NodeDamper, BoundNodeDamper)

}  // namespace pycraft
