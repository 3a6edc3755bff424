// What velocities and impulses come of coordinates that stop at once, by impulses at their own hinges alone.
//
// With l the coordinates that stop and f the others, momenta along f stay what they were and impulses p act along l:
//
//   (ℳ_ff + J_f)(v_f⁺ - v_f) = ℳ_fl v_l,   p = ℳ_lf (v_f⁺ - v_f) - (ℳ_ll + J_l) v_l
//
// which is hybrid dynamics at rest without gravity: accelerations -v_l prescribed, no forces at the others. What is lost is -½ v_l·p, half the
// square of v_l by the Schur complement of ℳ + J, which is never negative. Cost: one forward dynamics.
#pragma once

#include <utility>
#include <vector>

#include "model/multibody.h"

namespace pycraft {

// v⁺, zero at the coordinates that stop, and impulses, zero at the others. stops: per coordinate, all of a subhinge or none.
// SingularHingeError where a coordinate that stays feels no inertia.
std::pair<std::vector<double>, std::vector<double>> stop_at_once(const Multibody& model, const std::vector<double>& q, const std::vector<double>& v,
                                                                 const std::vector<char>& stops);

}  // namespace pycraft
