// What a rotation by an angle is made of, with the bits that packs of states have.
#pragma once

namespace pycraft::kernels {

// cos, sin, and sin of the half.
void turn_sines(double angle, double* out);

}  // namespace pycraft::kernels
