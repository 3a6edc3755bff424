// A scene linearized at a state, for methods that solve by derivatives: with z = (v, y), y the effects' own states, A = (ℳ + J, 1),
//
//   A ż = g:    ∂g/∂u = ∂T/∂q - ∂ID/∂q,    ∂g/∂v = ∂T/∂v - ∂ID/∂v,    ∂g/∂y = ∂T/∂y,    rows of ẏ likewise
//
// ID = ℳv̇ + 𝒞 with gravity, at v̇ held: its derivatives are those of the kernels (O(N²) numbers), of the recursions where these are in doubt. T, the
// forces of all effects as generalized ones, is differentiated by its own arithmetic on numbers with derivatives, four directions at once, and by
// differences where an effect is written in Python. Along time by differences, where an effect depends on it. Prescribed coordinates are known:
// their rows are the identity's, and nothing is taken along them.
#pragma once

#include <memory>
#include <vector>

#include "dynamics/link_dynamics.h"
#include "dynamics/sensitivities.h"
#include "simulation/scene_equations.h"
#include "simulation/tangent_states.h"

namespace pycraft {

class SceneLinearized : public SceneEquations<double, LinearizedEquations> {
 public:
  SceneLinearized(CompiledScene<double>& scene, bool works);

  void linearize(const double& t, const double& h, const double* q, const double* v, const double* rest, const double* vdot, const double* rest_rate, Linearization& out) override;

 private:
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  void differentiate_motion(const double* q, const double* v, const double* vdot, Linearization& out);
  void differentiate_forces(double t, const double* q, const double* v, const double* rest, Linearization& out);
  void difference_forces(double t, const double* q, const double* v, const double* rest, Linearization& out);
  void difference_time(double t, double h, const double* q, const double* v, const double* rest, const double* vdot, const double* rest_rate, Linearization& out);
  void leave_out_known(Linearization& out) const;
  void add_column(int direction, const double* along, Linearization& out) const;

  Vector3<double> gravity_{0, 0, 0};
  bool acts_ = false, differenced_ = false, in_time_ = false;
  std::vector<double> J_;  // of rotors that effects bring
  Matrix along_q_, along_v_, mass_;
  LinkDynamics<double> links_;
  Sensitivities<double> sensitivities_;
  RigidDynamics<double> dynamics_;
  std::unique_ptr<SceneForces<WithDerivatives>> forces_;
  TangentStates<double, 4> seeded_;
  std::vector<WithDerivatives> sum_, y_rate_;
  State direction_, moved_, faster_, other_, column_, vdot_, rest_rate_;
};

}  // namespace pycraft
