#include "model/curve.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr double without_end = std::numeric_limits<double>::infinity();
constexpr int samples = 9;      // of a piece, in search of the nearest place
constexpr int most_steps = 80;  // halving alone takes 53

// f(u) and f'(u), f''(u).
struct Derivatives {
  Vector3<double> f{0, 0, 0}, first{0, 0, 0}, half_second{0, 0, 0};
  Derivatives(const std::vector<Vector3<double>>& coefficients, double u) {
    for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) {
      half_second = u * half_second + first;
      first = u * first + f;
      f = u * f + *c;
    }
  }
};

// Straight on from the end u = ±1 of a piece.
CurvePiece straight_on(const CurvePiece& piece, double end) {
  const Derivatives at(piece.c, end), normal(piece.m, end);
  CurvePiece on;
  on.c = {at.f, at.first}, on.m = {normal.f};
  on.from = end < 0 ? -without_end : 0, on.to = end < 0 ? 0 : without_end;
  return on;
}

double square_from(const Vector3<double>& p, const Vector3<double>& c) { return dot(p - c, p - c); }

// The nearest place of a straight piece without end.
double nearest_on_line(const CurvePiece& piece, const Vector3<double>& p) {
  const double u = dot(p - piece.c[0], piece.c[1]) / dot(piece.c[1], piece.c[1]);
  return std::min(std::max(u, piece.from), piece.to);
}

// The root of the slope of |p - c|²/2 between u where it falls and u where it rises: Newton's steps, and halves where they leave that.
double least_between(const CurvePiece& piece, const Vector3<double>& p, double falls, double rises) {
  double u = (falls + rises) / 2;
  for (int step = 0; step < most_steps && falls < rises; ++step) {
    const Derivatives at(piece.c, u);
    const double slope = -dot(p - at.f, at.first), bend = dot(at.first, at.first) - 2 * dot(p - at.f, at.half_second);
    (slope > 0 ? rises : falls) = u;
    double to = u - slope / bend;
    if (!(bend > 0) || !(to >= falls && to <= rises)) to = (falls + rises) / 2;
    if (std::abs(to - u) <= std::numeric_limits<double>::epsilon()) return to;
    u = to;
  }
  return u;
}

}  // namespace

Curve::Curve(const double* coefficients, int pieces, int order, bool closed, const std::string& what) {
  if (pieces < 1 || order < 2) throw ModelError(what + ": a curve has a piece at least, of degree one at least");
  for (int k = 0; k < pieces; ++k) {
    CurvePiece piece;
    for (int i = 0; i < order; ++i) {
      const double* const at = coefficients + 6 * (k * order + i);
      for (int j = 0; j < 6; ++j)
        if (!std::isfinite(at[j])) throw ModelError(what + ": its curve has a number that is not finite");
      piece.c.push_back({at[0], at[1], at[2]}), piece.m.push_back({at[3], at[4], at[5]});
      if (i > 0) piece.radius += norm(piece.c[i]);
    }
    if (piece.radius == 0) throw ModelError(what + ": its curve stands still in its piece " + std::to_string(k));
    piece.centre = piece.c[0];
    pieces_.push_back(std::move(piece));
  }
  if (closed) return;
  const CurvePiece before = straight_on(pieces_.front(), -1), after = straight_on(pieces_.back(), 1);
  pieces_.push_back(before), pieces_.push_back(after);
}

Curve::Place Curve::nearest(const Vector3<double>& p) const {
  Place best{&pieces_[0], 0};
  double least = without_end;
  const auto take = [&](const CurvePiece& piece, double u) {
    const double square = square_from(p, Derivatives(piece.c, u).f);
    if (square < least) least = square, best = {&piece, u};
  };
  for (const CurvePiece& piece : pieces_)  // the middle of one to begin with, so that few are searched
    std::isinf(piece.from) || std::isinf(piece.to) ? take(piece, nearest_on_line(piece, p)) : take(piece, 0);
  for (const CurvePiece& piece : pieces_) {
    if (std::isinf(piece.from) || std::isinf(piece.to)) continue;
    const double off = norm(p - piece.centre) - piece.radius;
    if (off > 0 && off * off > least) continue;
    double slopes[samples], places[samples];
    for (int i = 0; i < samples; ++i) {
      places[i] = -1 + 2.0 * i / (samples - 1);
      const Derivatives at(piece.c, places[i]);
      slopes[i] = -dot(p - at.f, at.first);
    }
    if (slopes[0] >= 0) take(piece, -1);
    if (slopes[samples - 1] <= 0) take(piece, 1);
    for (int i = 0; i + 1 < samples; ++i)
      if (slopes[i] <= 0 && slopes[i + 1] >= 0) take(piece, least_between(piece, p, places[i], places[i + 1]));
  }
  return best;
}

}  // namespace pycraft
