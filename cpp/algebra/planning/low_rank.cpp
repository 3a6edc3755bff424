#include "algebra/planning/low_rank.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "numerics/scalar.h"
#include "numerics/small_lu.h"

namespace pycraft {

namespace {

// Whether that holds in the widest digits, and not to the rounding of a double only.
bool exactly(const LowRank& factors, const std::vector<double>& C, int rows, int columns) {
  using Widest = Digits100;
  const int r = factors.rank;
  std::vector<Widest> core(factors.core->dense.begin(), factors.core->dense.end()), X(factors.rows->dense.begin(), factors.rows->dense.end()), work(size_t(r) * columns);
  SmallLU<Widest> lu;
  if (r > 0 && !lu.factor(core.data(), r, nullptr)) return false;
  if (r > 0) lu.solve(X.data(), columns, work.data());
  const Widest tolerance = Widest(1e-80) * Widest(std::abs(*std::max_element(C.begin(), C.end(), [](double a, double b) { return std::abs(a) < std::abs(b); })));
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      Widest rest = C[size_t(i) * columns + j];
      for (int a = 0; a < r; ++a) rest -= Widest(factors.columns->dense[size_t(i) * r + a]) * X[size_t(a) * columns + j];
      if (abs(rest) > tolerance) return false;
    }
  return true;
}

}  // namespace

std::optional<LowRank> low_rank_factors(const ConstantData& c, int rows, int columns, bool more_digits) {
  constexpr int limit = 16;
  std::vector<double> rest = c.dense;
  const auto largest = [&] {
    return static_cast<size_t>(std::max_element(rest.begin(), rest.end(), [](double a, double b) { return std::abs(a) < std::abs(b); }) - rest.begin());
  };
  if (rest.empty()) return std::nullopt;
  const double tolerance = std::max(rows, columns) * epsilon<double>() * std::abs(rest[largest()]);
  std::vector<int> I, J;
  for (size_t at = largest(); std::abs(rest[at]) > tolerance; at = largest()) {
    if (static_cast<int>(I.size()) == std::min(limit, std::min(rows, columns) - 1)) return std::nullopt;
    const int i = static_cast<int>(at / columns), j = static_cast<int>(at % columns);
    I.push_back(i), J.push_back(j);
    const std::vector<double> row(rest.begin() + size_t(i) * columns, rest.begin() + size_t(i + 1) * columns);
    for (int a = 0; a < rows; ++a) {
      const double f = rest[size_t(a) * columns + j] / row[j];
      for (int b = 0; b < columns; ++b) rest[size_t(a) * columns + b] -= f * row[b];
    }
  }
  const auto part = [&](const std::vector<int>* of_rows, const std::vector<int>* of_columns) {
    auto made = std::make_shared<ConstantData>();
    made->name = c.name;
    for (int a = 0; a < (of_rows ? static_cast<int>(of_rows->size()) : rows); ++a)
      for (int b = 0; b < (of_columns ? static_cast<int>(of_columns->size()) : columns); ++b)
        made->dense.push_back(c.dense[size_t(of_rows ? (*of_rows)[a] : a) * columns + (of_columns ? (*of_columns)[b] : b)]);
    return made;
  };
  const LowRank factors{static_cast<int>(I.size()), part(nullptr, &J), part(&I, &J), part(&I, nullptr)};
  if (more_digits && !exactly(factors, c.dense, rows, columns)) return std::nullopt;
  return factors;
}

}  // namespace pycraft
