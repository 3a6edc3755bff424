// RODAS, a Rosenbrock method for stiff motions: six stages, order 4 with an estimate of order 3, L-stable and stiffly accurate.
//
// It works in coordinates about the step's start q₀, x = (u, z), q = q₀ exp(u), z = (v, y), y what the motion depends on besides:
//
//   u̇ = dexp⁻¹(u) v,   A ż = g,      J = ∂ẋ/∂x at the start: ∂u̇/∂u δ = ½ [δ, v], ∂u̇/∂v = 1, ∂g/∂u and ∂g/∂z exact (A ż held)
//   (1/(γh) - J) k_i = f(x₀ + Σ a_ij k_j) + h d_i ∂f/∂t + Σ c_ij k_j/h        each i
//
// u is eliminated hinge by hinge, W = (1/(γh) - ½ [·, v])⁻¹, which leaves one factorization of n = nv + |y| rows a step,
//
//   (A/(γh) - ∂g/∂z - ∂g/∂u W (1, 0)) k_z = A r_z + ∂g/∂u W r_u,    k_u = W (r_u + k_v).
//
// Boost.Odeint's rosenbrock4 has the same coefficients; it takes a Jacobian of the whole of x, with quaternions as numbers and twice the rows, and
// keeps no group. Integrals beside the motion are summed by Simpson's rule over the step. Dense output of order 3 is the method's own.
// Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Springer 1996, IV.7 and its code RODAS.
#pragma once

#include <memory>

#include "simulation/integrators/stepper.h"

namespace pycraft {

std::unique_ptr<ControlledSteps<double>> rosenbrock_steps(LinearizedEquations<double>& equations, const IntegratorOptions& options);

}  // namespace pycraft
