// Bodies welded together as one, summed in long double: a heavy body keeps the digits of a light one on it.
#pragma once

#include "model/multibody.h"

namespace pycraft {

// `body` with `welded` on it, X the pose of welded's frame in body's. ModelError where the sum is no rigid body.
Body lumped(Body body, const Pose<double>& X, const Body& welded);
// `body` without `welded`, which is part of it. ModelError where what is left is no rigid body.
Body parted(Body body, const Pose<double>& X, const Body& welded);

}  // namespace pycraft
