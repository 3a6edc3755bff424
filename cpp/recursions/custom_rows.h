// Rows of a hinge that is any sequence of subhinges, X_h(s), without equations of its own for what it permits.
//
// Its place is the one nearest to X: with Y = X_h(s)⁻¹X, e = (2ε; p) of Y (ε the vector of its unit quaternion of w >= 0), ė = G V - B ṡ,
//
//   s: B*e = 0, the least |e|         r = e                g = Π G,  Π = 1 - B B⁺
//
// so that r is zero where the hinge can stand at X, and nowhere else. Of the six rows as many as the hinge has freedoms hang on the others, exactly,
// at any X; Q*r is the gradient of |r|²/2, and where r is zero Q is its derivative. (Where it is not they differ by r itself: six numbers that
// change with X in fewer directions than six are functions of fewer.) Where the hinge locks, as a gimbal does, fewer hang on the others.
//
// s is sought in double from places all over the hinge, the first with e near zero or else the best of them, and refined in S by Newton's steps
// with the slope of B*e in double: each takes as many digits as a double has, and one order of derivatives that S carries.
#pragma once

#include "model/multibody.h"
#include "spatial/pose.h"

namespace pycraft {

// r, g, and ġ·V at a motion of twist V: six each. `permitted`: one body on the hinge.
template <class S>
void custom_rows(const Multibody& permitted, const Pose<S>& X, const Vector6<S>& V, S* residual, Vector6<S>* gradients, S* rates);

}  // namespace pycraft
