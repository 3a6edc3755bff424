// What vectors, matrices and blocks are written with.
#pragma once

#include <Eigen/Dense>
#include <vector>

namespace pycraft::written {

using Matrix = Eigen::MatrixXd;
using Blocks = std::vector<Matrix>;
using Rows = std::vector<std::vector<int>>;

}  // namespace pycraft::written
