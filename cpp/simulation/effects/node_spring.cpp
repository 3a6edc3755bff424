#include "simulation/effects/node_spring.h"

#include <cmath>

#include "model/checks.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

template <class S>
class BoundNodeSpring : public BoundEffect<S> {
 public:
  explicit BoundNodeSpring(const NodeSpring& of) : a_(of.nodes.a), b_(of.nodes.b), k_(of.stiffness), rest_(of.length) {}
  void forces(const At<S>& at, const Forces<S>& out) override {
    const Vector3<S> d = b_.position(at) - a_.position(at), none = Vector3<S>::zero();
    Vector3<S> pull = k_ * d;  // on a
    if (!(rest_ == S(0))) {
      const Span<S> span = span_of(d);
      pull = (k_ * (span.length - rest_)) * span.along;
    }
    a_.push(at, none, pull, out);
    b_.push(at, none, -pull, out);
  }
  S potential(const At<S>& at) override {
    const Vector3<S> d = b_.position(at) - a_.position(at);
    if (rest_ == S(0)) return k_ * dot(d, d) / S(2);
    const S off = span_of(d).length - rest_;
    return k_ * off * off / S(2);
  }
  std::optional<Edge> edge(const At<S>& at) override {
    const Vector3<S> d = b_.position(at) - a_.position(at);
    if (rest_ == S(0) || k_ == S(0) || dot(d, d) > S(0)) return {};
    return Edge{"its nodes are at one place"};
  }

 private:
  PlacedNode<S> a_, b_;
  S k_, rest_;
};

}  // namespace

NodeSpring::NodeSpring(const Multibody& model, const std::string& a, const std::string& b, double k, double rest)
    : nodes(model, a, b, "node_spring"), stiffness(k), length(rest) {
  if (!std::isfinite(k)) throw ModelError("node_spring: stiffness is " + short_number(k));
  if (!(rest >= 0) || !std::isfinite(rest)) throw ModelError("node_spring: length is " + short_number(rest) + "; it is a length, 0 or more");
}

Declaration NodeSpring::declaration() const {
  Declaration d;
  d.potential = true;
  nodes.declare(d, false);
  return d;
}

PYCRAFT_BIND_EFFECT(NodeSpring, BoundNodeSpring)

}  // namespace pycraft
