// A curve in space that a point stays on (model/loops.h): pieces, each a polynomial c(u), |u| <= 1, with a vector m(u) that is never along c'(u), from
// which the normals of the curve are made (recursions/curve_rows.h). An open curve goes on straight beyond its ends.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "spatial/vector3.h"

namespace pycraft {

struct CurvePiece {
  std::vector<Vector3<double>> c, m;  // coefficients of 1, u, u², ...
  double from = -1, to = 1;           // of u: one of them without end where the curve goes on straight
  Vector3<double> centre{0, 0, 0};    // c(u) is within the radius of it for u in [-1, 1]
  double radius = 0;
};

class Curve {
 public:
  // Coefficients (pieces, order, 6): of each power of u those of c (m) and of m. ModelError names the loop `what`: numbers that are not finite, a
  // curve that stands still.
  Curve(const double* coefficients, int pieces, int order, bool closed, const std::string& what);

  struct Place {
    const CurvePiece* piece;
    double u;
  };
  // The place nearest to a point; of two that are as near either. Cost: a distance a piece, and a search on those that may be nearest.
  Place nearest(const Vector3<double>& point) const;

 private:
  std::vector<CurvePiece> pieces_;
};

}  // namespace pycraft
