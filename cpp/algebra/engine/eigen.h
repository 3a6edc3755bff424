// Operators and Eigen: y = A * x, X * A, dense(A). For C++ programs; the core itself does not use it.
#pragma once

#include <Eigen/Core>

#include "algebra/engine/engine.h"
#include "algebra/engine/evaluate.h"
#include "algebra/language/display.h"
#include "runtime/errors.h"

namespace pycraft {

using DenseMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// y = A x, column by column of x; nothing is formed. Throws SpaceError where the sizes do not fit.
template <class Derived>
auto operator*(const Expression& a, const Eigen::MatrixBase<Derived>& x) {
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, Derived::ColsAtCompileTime>;
  if (a.floating()) return Columns(x);
  if (x.rows() != a.domain().dimension())
    throw SpaceError(show(a) + " maps " + a.domain().description() + "; it cannot be applied to " + std::to_string(x.rows()) + " rows");
  const DenseMatrix packed = x;
  Inputs inputs;
  inputs.x = packed.data();
  inputs.columns = static_cast<int>(packed.cols());
  Result r;
  apply(a, inputs, r);
  return Columns(Eigen::Map<const DenseMatrix>(r.values.data(), r.rows, r.columns));
}

// x A = (A* x*)*
template <class Derived>
auto operator*(const Eigen::MatrixBase<Derived>& x, const Expression& a) {
  return (a.T() * x.transpose()).transpose().eval();
}

inline DenseMatrix dense(const Expression& a) {
  Result r;
  evaluate(a, Request::dense, r);
  return Eigen::Map<const DenseMatrix>(r.values.data(), r.rows, r.columns);
}

inline double value(const Scalar& s) { return evaluate(s, nullptr)[0]; }

}  // namespace pycraft
