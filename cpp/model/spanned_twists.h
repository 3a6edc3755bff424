// An orthonormal basis of what twists span, in any scalar.
#pragma once

#include <cmath>
#include <vector>

#include "spatial/pose.h"

namespace pycraft {

constexpr double still_moves = 1e-7;  // of a twist, by its length: less beside the others is rounding, or a place where the hinge locks

// Gram and Schmidt, each twice; returns the rank, so many of `twists` are the basis then. The rest hang on them.
template <class S>
int orthonormal(std::vector<Vector6<S>>& twists) {
  using std::sqrt;
  const auto product = [](const Vector6<S>& a, const Vector6<S>& b) { return dot(a.angular, b.angular) + dot(a.linear, b.linear); };
  int rank = 0;
  const std::vector<Vector6<S>> all = twists;
  for (const Vector6<S>& given : all) {
    const S square = product(given, given);
    if (!(square > S(0))) continue;
    Vector6<S> left = (S(1) / sqrt(square)) * given;
    for (int pass = 0; pass < 2; ++pass)
      for (int i = 0; i < rank; ++i) left = left - product(twists[i], left) * twists[i];
    const S rest = product(left, left);
    if (rest > S(still_moves * still_moves)) twists[rank++] = (S(1) / sqrt(rest)) * left;
  }
  return rank;
}

}  // namespace pycraft
