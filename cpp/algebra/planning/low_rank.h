// Constant matrices of low rank, told by their entries: what borders a tree with few states.
#pragma once

#include <memory>
#include <optional>

#include "algebra/language/expression.h"

namespace pycraft {

// C = C(:,J) C(I,J)⁻¹ C(I,:) with r rows I and columns J, up to 16: entries of C alone, so that no digit is lost before the run. The rows and
// columns are found by elimination with complete pivoting in double precision.
struct LowRank {
  int rank;
  std::shared_ptr<const ConstantData> columns, core, rows;
};

// Of a dense constant (rows, columns); none of a higher rank. more_digits: it must hold in the widest digits, and not to the rounding of a double only.
std::optional<LowRank> low_rank_factors(const ConstantData& c, int rows, int columns, bool more_digits);

}  // namespace pycraft
