// Theorems of loops: of their rows beside the tree (tree augmentation), and of the compound bodies that the loops become (constraint embedding).
#pragma once

#include <memory>
#include <vector>

#include "operators/embedded_operators.h"
#include "operators/loop_operators.h"

namespace pycraft {

// Q of rows of which some are independent at the model's present state: multipliers are of these, q. None where no row asks anything there.
std::vector<Theorem> augmentation_theorems(const std::shared_ptr<LoopOperators>& loops);

// H, J, ℳ, velocities and accelerations by those of the tree, their calculus, and that both ways have the same accelerations: said at states on the loops.
std::vector<Theorem> embedding_theorems(const std::shared_ptr<EmbeddedOperators>& source);

}  // namespace pycraft
