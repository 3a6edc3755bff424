// Forward dynamics by methods other than the articulated-body algorithm, for comparison: (ℳ + J) θ̈ = T - 𝒞 with 𝒞 from Newton-Euler.
//
// method               how                                                                        cost
// cholesky             ℳ + J by composite bodies, dense Cholesky factor                           O(N³)
// ldl                  ℳ + J by composite bodies, L*DL in tree order without fill-in               O(N depth²)
// conjugate-gradients  products (ℳ + J)x by two sweeps, Jacobi preconditioner                     O(N) an iteration
// inverse              (ℳ + J)⁻¹ formed by the innovations factors, then times T - 𝒞              O(N²)
// divide-and-conquer   segments joined two by two, in threads (divided_dynamics.h)                O(N), on a way of O(log N)
//
// No allocation after the first call of a method.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dynamics/tree_factors.h"
#include "model/multibody.h"
#include "numerics/conjugate_gradients.h"
#include "numerics/dense_factors.h"
#include "recursions/applied.h"
#include "recursions/point_accelerations.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

template <class S>
class DividedDynamics;

enum class Method { cholesky, ldl, conjugate_gradients, inverse, divide_and_conquer };
inline constexpr Method methods[] = {Method::cholesky, Method::ldl, Method::conjugate_gradients, Method::inverse, Method::divide_and_conquer};
const char* method_name(Method method);
// Throws EvaluationError that lists the names there are.
Method method_from_name(const std::string& name);

template <class S>
class DynamicsMethods {
 public:
  explicit DynamicsMethods(const Multibody& model);
  ~DynamicsMethods();

  // Throws SingularOperatorError that names the coordinate where a pivot of a factor is noise, or where conjugate gradients do not get the
  // residual below sqrt(eps), or the hinge where divide and conquer loses its digits; SingularHingeError for `inverse` and for that.
  // threads: of divide and conquer alone; they change no bit.
  void forward_dynamics(Method method, const S* q, const S* v, const S* tau, S* vdot, const Applied<S>* applied = nullptr, int threads = 1);

  // Of the last call with conjugate gradients: iterations, and ‖T - 𝒞 - ℳθ̈‖/‖T - 𝒞‖ in the norm of the preconditioner.
  int iterations() const { return gradients_.iterations; }
  S residual() const { return gradients_.residual; }

  // Bytes that a method reads and writes at one evaluation: kinematics, velocities, what it factors and its vectors; of divide and conquer
  // what is held in all, most of it read and written.
  size_t memory(Method method);

 private:
  void factor_and_solve(Method method, S* x);
  void solve_by_gradients(const S* b, S* x);
  void multiply_by_inverse(const S* b, S* x);
  DividedDynamics<S>& divided();
  [[noreturn]] void refuse(Method method, const PivotFailure<S>& failure) const;

  const Multibody& source_;
  const SkoStructure tree_;
  std::shared_ptr<const CompiledModel<S>> model_;
  RigidBlocks<S> blocks_;
  PointAccelerations<S> points_;
  TreeOrder order_;
  std::vector<Vector6<S>> alpha_, force_;
  std::vector<S> right_side_, work_, matrix_, identity_, scratch_;
  ConjugateGradients<S> gradients_;
  std::unique_ptr<DividedDynamics<S>> divided_;  // from its first call on
};

#define PYCRAFT_EXTERN(S) extern template class DynamicsMethods<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_EXTERN)
#undef PYCRAFT_EXTERN

}  // namespace pycraft
