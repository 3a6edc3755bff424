// Second derivatives of a scene's equations at a state, contracted: with F = (T, ẏ), the forces of all effects as generalized ones and the rates of
// their own states, z = (δ, v, y), δ exponential coordinates of displacements,
//
//   μ*∂²F/∂z∂z    and those of μ*ID (dynamics/curvature.h) in the scene's uniform gravity
//
// F on numbers with derivatives along four directions of derivatives along four others: along displacements of ball and free hinges, which do not commute,
// one order in (i, j) and the other in (j, i), of which those along exponential coordinates are the mean. Where an effect is written in Python F is differenced instead: centrally, with steps h = ε^¼ of four values
// that are right to a rounding each, so that of functions of the size of their arguments 4ε/h² + h²/6 of their size, 1e-7, is wrong. Directions of
// prescribed coordinates, and what μ has there, count for nothing. Cost O(N n²) for n directions.
// Source: A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, second derivatives by the forward mode over itself; the step of second
// differences as in P. Gill, W. Murray, M. Wright, Practical Optimization, Academic Press 1981, on finite differences.
#pragma once

#include <vector>

#include "dynamics/curvature.h"
#include "simulation/scene_equations.h"
#include "simulation/tangent_states.h"

namespace pycraft {

// EvaluationError that names the effect which has no derivatives of this order at a state. Of the first order those are missed that no side of it has:
// nodes at one place, where nothing says which way. Beside a stop there are derivatives on either side, and a linear model is of the side that forces are of.
void refuse_edges(CompiledScene<double>& scene, int order, double t, const double* q, const double* v, const double* own);

class SceneCurvature {
 public:
  explicit SceneCurvature(CompiledScene<double>& scene);

  int directions() const { return 2 * nv() + own(); }
  // For each of `count` μ (nv + own) a matrix (n x n).
  void forces(double t, const double* q, const double* v, const double* own, const double* mu, int count, double* out);
  // And four blocks (nv x nv), those of Curvature.
  void motion(const double* q, const double* v, const double* vdot, const double* mu, int count, double* out);

 private:
  int nv() const { return scene_.numbers().nv; }
  int own() const { return scene_.effects().own(); }
  void differentiate(double t, const double* q, const double* v, const double* own, const double* mu, int count, double* out);
  void difference(double t, const double* q, const double* v, const double* own, const double* mu, int count, double* out);
  [[noreturn]] void refuse(double t) const;
  // F displaced along directions i and j by so much, contracted.
  void values(double t, const double* q, const double* v, const double* own, int i, double by_i, int j, double by_j, const double* mu, int count, std::vector<double>& to);

  CompiledScene<double>& scene_;
  Vector3<double> gravity_{0, 0, 0};
  bool acts_ = false, differenced_ = false;
  std::vector<char> known_;
  std::vector<double> along_, q_, v_, y_, F_, J_;  // J: of rotors that effects bring
};

}  // namespace pycraft
