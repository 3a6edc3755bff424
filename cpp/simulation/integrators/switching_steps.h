// Steps of an explicit method where the motion lets it, of an implicit one where it is stiff.
//
// The explicit method reports, from the stages of its own steps, when stability and not accuracy holds their size (Stepper::held). The decay found from the
// derivatives of the equations confirms it (decay.h), and the implicit method goes on from the same state with the same size. Back it goes when
// its steps are, at two looks in a row, ten steps apart, so short that the explicit method would be stable with them. What is counted is part of the pace: a run that is resumed
// switches where one that never ended does.
// Source of the test: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Springer 1996, IV.2.
#pragma once

#include <memory>

#include "simulation/integrators/stepper.h"

namespace pycraft {

// explicit_steps and implicit_steps: of these equations.
std::unique_ptr<Stepper<double>> switching_steps(LinearizedEquations<double>& equations, std::unique_ptr<ControlledSteps<double>> explicit_steps,
                                                 std::unique_ptr<ControlledSteps<double>> implicit_steps);

}  // namespace pycraft
