// Cross products of motions and forces, each vector a column (angular; linear).
#pragma once

#include "letters.h"

namespace pycraft::written {

inline Eigen::Matrix3d skew(const Eigen::Vector3d& w) {  // w~ x = w × x
  Eigen::Matrix3d W;
  W << 0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0;
  return W;
}

inline Matrix crm(const Matrix& V) {  // [[ω~, 0], [v~, ω~]]: the cross product of motions
  Matrix X = Matrix::Zero(6, 6);
  X.block(0, 0, 3, 3) = X.block(3, 3, 3, 3) = skew(V.block(0, 0, 3, 1));
  X.block(3, 0, 3, 3) = skew(V.block(3, 0, 3, 1));
  return X;
}

inline Matrix crf(const Matrix& V) {  // [[ω~, v~], [0, ω~]]: the cross product of a motion with forces
  Matrix X = Matrix::Zero(6, 6);
  X.block(0, 0, 3, 3) = X.block(3, 3, 3, 3) = skew(V.block(0, 0, 3, 1));
  X.block(0, 3, 3, 3) = skew(V.block(3, 0, 3, 1));
  return X;
}

inline Matrix cross_of_momentum(const Matrix& h) {  // -[[n~, f~], [f~, 0]] of a momentum (n; f)
  Matrix X = Matrix::Zero(6, 6);
  X.block(0, 0, 3, 3) = -skew(h.block(0, 0, 3, 1));
  X.block(0, 3, 3, 3) = X.block(3, 0, 3, 3) = -skew(h.block(3, 0, 3, 1));
  return X;
}

}  // namespace pycraft::written
