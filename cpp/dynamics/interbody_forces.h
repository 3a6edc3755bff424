// Interbody forces as direct calls: the force that every hinge puts on the body that it moves, after accelerations that are given, or found by
// forward dynamics; with wrenches on nodes, and with derivatives.
//
//   f(k) = M(k) α(k) + b(k) - w(k) + Σ_{children c} E(k,c) f(c),   T(k) = H(k) f(k) + J(k) θ̈(k)
//
// Newton-Euler (recursions/newton_euler.h), also after forward dynamics: the book's f = P⁺E_φ*α + z + Gε is the same, with as many digits (docs/interbody_forces.md).
// Derivatives by the arithmetic of the same recursion on numbers with derivatives, four directions at once. Cost O(N), of derivatives O(N nv).
#pragma once

#include <array>
#include <memory>
#include <vector>

#include "dynamics/batches.h"
#include "dynamics/rigid_dynamics.h"
#include "numerics/tangent.h"

namespace pycraft {

// Nodes that wrenches (n; f) act on, about their origins: in the world's axes, or in those of the nodes themselves.
struct PushedNodes {
  std::vector<Node> nodes;
  bool in_world = true;
};
// ModelError that names the node, and the state of a batch, where a wrench is not finite; six numbers a node. pushed may be null where there are none.
void check_wrenches(const PushedNodes* pushed, const Given& wrenches);

template <class S>
class InterbodyForces {
 public:
  InterbodyForces(const SkoStructure& tree, std::shared_ptr<const CompiledModel<S>> model);

  void place(const S* q);
  // At bodies that are placed: what these wrenches, six numbers each, are on all bodies, in their axes about their origins.
  const Vector6<S>* on_bodies(const PushedNodes& pushed, const S* wrenches);
  void find(const S* v, const S* vdot, const Applied<S>& applied);

  const CompiledModel<S>& model() const { return *model_; }
  const std::vector<Pose<S>>& poses() const { return world_; }        // X_WB
  const std::vector<Vector6<S>>& forces() const { return force_; }    // in the bodies' axes about their origins
  const std::vector<S>& generalized() const { return generalized_; }  // T
  // What of a force does no work along the coordinates of its hinge: f - H⁺H f, with the body's origin for the point and metres for the unit.
  Vector6<S> reaction(int k) const;

 private:
  std::shared_ptr<const CompiledModel<S>> model_;
  RigidBlocks<S> blocks_;
  PointAccelerations<S> points_;
  std::vector<Pose<S>> world_;
  std::vector<Vector6<S>> alpha_, force_, wrench_;
  std::vector<S> generalized_;
};

template <class S>
inline void write(const Vector6<S>& f, double* to) {
  for (int i = 0; i < 6; ++i) to[i] = to_double(f[i]);
}
template <class S>
inline void write(const Pose<S>& X, double* to) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) to[4 * i + j] = to_double(X.R(i, j));
    to[4 * i + 3] = to_double(X.p[i]), to[12 + i] = 0;
  }
  to[15] = 1;
}

// What computes at one state of a direct call.
template <class S>
struct InterbodyWorkspace {
  explicit InterbodyWorkspace(const Multibody& model) : forces(model.structure(), model.compiled<S>()) {}
  InterbodyForces<S> forces;
  std::unique_ptr<RigidDynamics<S>> dynamics;  // made where it is first needed
  std::vector<S> q, v, input, wrenches, vdot;
};
template <>
inline constexpr bool available_at<InterbodyWorkspace, Digits50> = false;
template <>
inline constexpr bool available_at<InterbodyWorkspace, Digits100> = false;

class BatchInterbodyForces : public Batches<InterbodyWorkspace> {
 public:
  using Batches::Batches;

  // What is asked: accelerations are given as `input`, or found under the generalized forces that it is.
  struct Asked {
    Given q, v, input, wrenches;  // of wrenches six numbers a node
    bool moving = true;
    const PushedNodes* pushed = nullptr;
    Solving how;
    Precision precision = Precision::double_;
    bool reaction = false;
    int states() const;
  };
  // Forces (bodies x 6), X_WB (bodies x 4 x 4), T and v̇ (nv each), a state.
  struct Results {
    double *forces, *poses, *generalized, *vdot;
  };
  void run(const Asked& asked, const Results& out);
  // After accelerations: of the forces (6 bodies x nv) and of T (nv x nv) a state, along q, and along v and v̇ where they are not null.
  void derivatives(const Asked& asked, const std::array<double*, 3>& forces, const std::array<double*, 3>& generalized);

 private:
  void check(const Asked& asked) const;
};

extern template class InterbodyForces<Single>;
extern template class InterbodyForces<double>;
extern template class InterbodyForces<Extended>;
extern template class InterbodyForces<Quad>;
extern template class InterbodyForces<Tangent<double, 4>>;

}  // namespace pycraft
