// Hybrid dynamics as a direct call, of one state or a batch, in any form and precision: accelerations where forces are given, forces where
// accelerations are. Nothing prescribed is forward dynamics and everything inverse dynamics, by the calls of those names, bit for bit.
//
// In the form fast and unrefined by kernels (kernels/prescribed_links.h), in packs for batches; else, and where kernels are in doubt, by the
// general recursions (recursions/prescribed_hinges.h). Cost: O(N).
#pragma once

#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "dynamics/batch_dynamics.h"
#include "model/hinge_terms.h"

namespace pycraft {

class BatchHybridDynamics {
 public:
  // prescribed: per coordinate. ModelError where a subhinge is prescribed in part.
  BatchHybridDynamics(std::shared_ptr<Multibody> model, std::vector<char> prescribed);

  const Multibody& model() const { return whole_.model(); }
  const std::vector<char>& prescribed() const { return terms_.prescribed; }
  // v̇ and T of all coordinates, nv a state each. tau is read at coordinates that are free, vdot at the others. SingularHingeError names the coordinate.
  void run(const Given& q, const Given& v, const Given& tau, const Given& vdot, const Solving& how, Precision precision, double* accelerations, double* forces, int threads = 1);

 private:
  using Runs = std::vector<std::pair<int, int>>;  // of states, from and to
  // u and out: forces and accelerations at free coordinates, accelerations and forces at the others.
  void mixed(const Given& q, const Given& v, const Given& u, int states, const Solving& how, Precision precision, double* out);
  bool by_links(const Given& q, const Given& v, const Given& u, int states, Precision precision, double* out, Runs& doubted);
  template <class S>
  void generally(const Given& q, const Given& v, const Given& u, int b, int states, const Solving& how, double* out);

  BatchDynamics whole_;
  HingeTerms terms_;
  std::vector<int> free_;
  PerScalar<DynamicsPool> general_;
  std::tuple<WorkspacePool<LinkDynamics<Single>>, WorkspacePool<LinkDynamics<double>>, WorkspacePool<LinkDynamics<Extended>>, WorkspacePool<LinkDynamics<Quad>>> links_;
};

}  // namespace pycraft
