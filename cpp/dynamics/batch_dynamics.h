// The direct calls of rigid dynamics on one state or a batch: forward and inverse dynamics, mass matrices and their inverses by the kernels of
// the machine's instruction set where that is the plain case, by the general recursions else; Jacobians, poses, energies. Arrays are row-major, state after state; SI units, spatial quantities angular first.
#pragma once

#include <memory>
#include <span>
#include <tuple>
#include <vector>

#include "dynamics/batches.h"
#include "dynamics/link_dynamics.h"
#include "dynamics/packed_dynamics.h"
#include "dynamics/rigid_dynamics.h"

namespace pycraft {

// The corrections of a refined call and what is left of its error, |x - exact|/|x|.
struct RefinementReport {
  std::vector<double> corrections;
  double estimated_error = 0;
};

class BatchDynamics : public Batches<RigidDynamics> {
 public:
  using Batches::Batches;

  // v̇, nv a state. `applied` acts at every state; null: the model's gravity alone. SingularHingeError names the coordinate.
  void forward_dynamics(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* vdot,
                        const Applied<double>* applied = nullptr, int threads = 1);
  // The same of one state, and how it was refined.
  RefinementReport refinement(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* vdot);
  // T, nv a state; without vdot the bias forces 𝒞.
  void inverse_dynamics(const Given& q, const Given& v, const Given* vdot, Precision precision, double* tau, const Applied<double>* applied = nullptr, int threads = 1);
  void mass_matrix(const Given& q, Precision precision, double* out);                                     // ℳ + J, (nv, nv) a state
  void mass_matrix_inverse(const Given& q, const Solving& how, Precision precision, double* out);         // (ℳ + J)⁻¹, (nv, nv) a state
  void jacobian(const Node& node, const Given& q, Precision precision, double* out);                      // (6, nv) a state, the node's axes
  void pose(const Node& node, const Given& q, double* out);                                               // X_WN, (4, 4) a state
  void energy(const Given& q, const Given& v, const Vector3<double>& datum, double* out);                 // kinetic, potential

  // The derivatives of inverse or forward dynamics by kernels, double precision; false where that is not the plain case, or a state in doubt:
  // BatchSensitivities decides then.
  bool derivatives(kernels::Call call, const Given& q, const Given& v, const Given& u, const std::array<double*, 3>& out);
  // C, (nv, nv) a state: Hφ(MJ̇ + 𝓑J) or Christoffel's. BatchSensitivities decides as above.
  bool coriolis_matrix(bool skew, const Given& q, const Given& v, double* out);
  // (B*ΩB)⁻¹, or without the inverse, (6m, 6m) a state, of m nodes in their axes: what the operators say (Λ, B*ΩB) is left where this is false.
  bool operational_space(bool inverse, std::span<const Node> nodes, const Given& q, double* out);
  // By kernels, where the plain case is there for this model and precision; else false. again(from, to): states in doubt. What is given was
  // checked, and the model is in use.
  template <class Again>
  bool by_links(Precision precision, const LinkCall& asked, int states, int size, double* out, Again again) {
    bool done = false;
    const auto run = [&]<class S>(S) {
      std::get<WorkspacePool<LinkDynamics<S>>>(links_).with(model(), [&](LinkDynamics<S>& w) {
        done = w.there(asked.call);
        if (done) w.run(asked, states, size, out, again);
      });
    };
    if (precision == Precision::double_) run(double());
    if (precision == Precision::single) run(Single());
    if (asked.call != kernels::Call::forward_dynamics) return done;  // what there is for wide numbers
    if (precision == Precision::extended) run(Extended());
    if (precision == Precision::quad) run(Quad());
    return done;
  }

 private:
  // The values of unrefined calls, which refinement starts from, so that its corrections are their errors.
  struct Starts {
    std::vector<double> values;
    std::vector<char> there;
    int first = 0, size = 0;
    Solving of(int b, Solving how) const {
      if (!there.empty() && there[b - first]) how.start = values.data() + size_t(b - first) * size;
      return how;
    }
  };
  Starts refined_from(Precision precision, const LinkCall& asked, int from, int to, int size, const Solving& how);
  template <class S>
  void forward_dynamics_at(const Given& q, const Given& v, const Given& tau, int from, int to, int states, const Solving& how, const Starts& starts, double* vdot,
                           const Applied<double>* applied);

  // Whether they were there and sure of all states, in double precision. What is given is checked.
  bool surely(const LinkCall& asked, Givens given, int size, double* out);
  // The same of calls that never leave a state in doubt: general(out) where kernels are not there, or where a number left its range.
  template <class General>
  void plainly(Precision precision, const LinkCall& asked, Givens given, int size, double* out, General general);

  std::tuple<WorkspacePool<PackedDynamics<Single>>, WorkspacePool<PackedDynamics<double>>> packs_;
  std::tuple<WorkspacePool<LinkDynamics<Single>>, WorkspacePool<LinkDynamics<double>>, WorkspacePool<LinkDynamics<Extended>>, WorkspacePool<LinkDynamics<Quad>>> links_;
};

}  // namespace pycraft
