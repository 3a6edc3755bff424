// A plan: what an expression becomes before any number is touched. An ordered list of steps over registers, each with its cost.
// Plans hold no expression and no number but the user's constants, so they are shared, cached and shown.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "algebra/language/expression.h"
#include "algebra/language/source.h"

namespace pycraft {

struct Plan;
struct Realization;

enum class StepKind {
  values,            // kinematics, articulated inertia, composite inertia, ... of a model at a state (cached between runs)
  gather,            // y = φ x or ψ x, tip to base
  scatter,           // y = φ* x or ψ* x, base to tip
  apply_symbol,      // y = A x, A* x or A⁻¹ x for a block-diagonal or edge symbol
  apply_blocks,      // y = B x or B* x for a block register
  apply_constant,    // y = C x or C* x for a dense constant
  apply_column,      // y = v x or v* x for a vector register v
  apply_external,    // y = L x or L* x for somebody else's operator
  combine,           // y = Σ c_i x_i
  vector_symbol,     // y = a vector of the model, or a constant one
  zero,              // y = 0
  load_blocks,       // blocks of a symbol or a block-diagonal constant
  identity_blocks,
  multiply_blocks,   // B = B1 B2
  combine_blocks,    // B = Σ c_i B_i
  transpose_blocks,
  invert_blocks,     // body by body
  root_blocks,       // Cholesky factor, body by body
  function_blocks,   // a linear function of a vector or of blocks, body by body
  congruence_blocks, // blockdiag(E B E*), tip to base; blockdiag(E* B E), base to tip (transposed)
  lyapunov_blocks,   // blockdiag(φBφ*), blockdiag(ψBψ*) tip to base; blockdiag(φ*Bφ), blockdiag(ψ*Bψ) base to tip (transposed)
  factor,            // block elimination of a realization over the tree
  solve,             // y = T⁻¹-solution of a factored realization
  selected_blocks,   // the diagonal blocks of a factored realization's operator
  mass_matrix,       // fused: y = (HφMφ*H* [+ J]) x
  mass_matrix_solve, // fused: y = [I-HψK]* D⁻¹ [I-HψK] x; flag: by Group::inverse
  mass_matrix_solve_tangent, // y = ∂(HφMφ*H* + J)⁻¹ x by the derivative of the Riccati sweep; where it has none, by the operand
  mass_matrix_dense, // composite-body assembly of HφMφ*H* [+ J]
  dense_factor,      // LU of an operator made dense, column by column
  dense_solve,
  blocks_of_dense,   // the diagonal blocks of an operator made dense
  gather_blocks,     // a block-diagonal operator as a dense matrix
  diagonal_of_blocks,
  trace_of_blocks,
  logdet_of_blocks,
  logdet_of_D,
  logdet_of_factor,
  logdet_of_dense,
  norm_of_vector,    // root of the sum of squares of all columns
  root_of_trace,     // norm from tr(X*X)
  combine_scalars
};
constexpr int step_kinds = static_cast<int>(StepKind::combine_scalars) + 1;
const char* step_kind_name(StepKind kind);

enum class RegisterKind { vector, blocks, factor, dense, scalar };

struct Register {
  RegisterKind kind;
  Space space;              // vector: its space; blocks: rows; dense: rows
  Space columns;            // blocks, dense: columns
  std::shared_ptr<const Realization> realization;  // factor
  bool wide = false;        // vector with as many columns as the run has (else one)
  int shared = -1;          // in the plan of an operand: the register of the whole plan that it stands for (factors of a dense matrix)
};

struct Step {
  StepKind kind;
  int out = -1;
  std::vector<int> in;
  int context = -1;                         // which (source, binding)
  Symbol symbol{};                          // apply_symbol, load_blocks, vector_symbol, gather, scatter: its binding is dropped
  bool transposed = false, inverted = false, flag = false;  // flag: with J (mass_matrix); of X*X, the operand being X (dense_factor)
  unsigned groups = 0;                      // values
  std::vector<Coefficient> coefficients;
  std::shared_ptr<const ConstantData> constant;
  std::shared_ptr<const ExternalData> external;
  std::shared_ptr<const Realization> realization;
  std::shared_ptr<const Plan> operand;      // dense_factor, mass_matrix_solve_tangent: the plan that applies the operator
  double flops = 0;                         // for one column
  double bytes = 0;                         // of the register written
  int tier = 2;                             // 0 values, 1 recognised kernel, 2 sweep, 3 realization, 4 dense
  std::string text;                         // as explain() shows it
};

enum class Request { apply, dense, block_diagonal, diagonal, trace, logdet, norm };

struct Plan {
  Request request;
  Space domain, codomain;
  std::vector<Context> contexts;
  std::vector<bool> hinge_diagonal;         // per context: whether J was there when the plan was made
  std::vector<unsigned> groups;             // per context: the values it needs
  std::vector<Register> registers;
  std::vector<Step> steps;
  int input = -1;                           // register of x (apply)
  std::map<std::string, int> vectors;       // registers of the named vectors
  int output = -1;
  bool columns_of_identity = false;         // dense, norm: the apply steps run over the columns of the identity, some at a time
  bool batched = false;
  int batch = -1;
  Precision precision = Precision::double_;
  std::vector<std::string> notes;           // theorems used, reasons for a dense step
  std::string text;                         // the expression planned, as typed
  double flops() const;
  double bytes() const;
  bool has_dense_step() const;
  bool calls_outside() const;               // an operator that is somebody else's
};

struct PlanOptions {
  bool rules = true;           // false: no theorem is used, everything is evaluated as it is typed
};

std::shared_ptr<const Plan> make_plan(const Expression& e, Request request, const PlanOptions& options);

}  // namespace pycraft
