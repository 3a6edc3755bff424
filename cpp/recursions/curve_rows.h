// Rows of a point p on a curve c(u) (model/curve.h), from the nearest place u of it:
//
//   (p - c(u))·c'(u) = 0,   r_i = n_i(u)·(p - c(u)),   n_1 = m × t/|m × t|,   n_2 = t × n_1/|t|,   t = c'(u)
//
// so that |r| is the distance, and both rows are zero on the curve and nowhere else. g and ġ·V are those of r(p) exactly, u a function of p: u is sought
// in double, refined in S by Newton's steps, each of which takes twice the digits and the orders of derivatives that S carries, and two steps more give
// it as a function of the motion, to second order. Where the point is at a centre of curvature every place near is as near: there u is taken to stay.
#pragma once

#include "recursions/frame_motions.h"

namespace pycraft {

class Curve;

// r, g, and ġ·V of a point in motion: two each.
template <class S>
void curve_rows(const Curve& curve, const RelativeMotion<S>& m, S* residual, Vector6<S>* gradients, S* rates);

}  // namespace pycraft
