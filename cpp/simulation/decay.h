// What holds the steps of an explicit method: the fastest decay of the equations linearized at a state.
//
// With x = (u, z) about the state (integrators/rosenbrock.h), ẋ = J x,
//
//   J = (½ [·, v]   1)        u' = ½ [u, v] + z_v,    A z' = ∂g/∂u u + ∂g/∂z z
//       (A⁻¹ ∂g/∂u   A⁻¹ ∂g/∂z)
//
// the eigenvalue of largest size is found by powers of J on one vector: from three in a row, x, J x, J² x, the two coefficients of the quadratic that has a
// conjugate pair, or one real number, as its roots. O(n³) once, for the factors of A, and O(n²) a power. A decay is a rate with a negative real part
// that is at least a third of its size: oscillations that are hardly damped are no stiffness, as a method that damped them would be wrong.
// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Springer 1996, IV.2; G. H. Golub, C. F. Van Loan, Matrix Computations,
// Johns Hopkins 2013, 7.3.
#pragma once

#include <Eigen/LU>
#include <vector>

#include "simulation/equations.h"

namespace pycraft {

struct Decay {
  double real = 0, size = 0;       // 1/s: of the eigenvalue
  Eigen::VectorXd displacement, z;  // along which that is, of the first power that has it
  // Whether it holds the steps of an explicit method of this size, s.
  bool holds(double step) const { return real < 0 && -3 * real >= size && size * step >= 1.5; }
};

class DecayFinder {
 public:
  explicit DecayFinder(LinearizedEquations<double>& equations) : equations_(equations) {}
  // At a state x of the equations; step: to come, s.
  const Decay& fastest(double t, const std::vector<double>& x, double step);

 private:
  void apply(const double* v, const Eigen::VectorXd& u, const Eigen::VectorXd& z, Eigen::VectorXd& to_u, Eigen::VectorXd& to_z);

  LinearizedEquations<double>& equations_;
  Linearization linear_;
  Eigen::PartialPivLU<Eigen::MatrixXd> mass_;
  Eigen::VectorXd u_[3], z_[3], right_;
  std::vector<double> vdot_, rest_rate_;
  Decay found_;
};

}  // namespace pycraft
