#include "recursions/curve_rows.h"

#include <array>

#include "model/curve.h"
#include "recursions/carried.h"
#include "recursions/motion_functions.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr double least_slope = 1e-6;  // of |t|²: nearer to a centre of curvature u is taken to stay
constexpr int refinements = 4;        // 16 digits, to 256; and 15 orders of derivatives

// f(u) and its first three derivatives.
template <class S>
std::array<Vector3<S>, 4> derivatives(const std::vector<Vector3<double>>& coefficients, const S& u) {
  std::array<Vector3<S>, 4> d;
  d.fill(Vector3<S>::zero());
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) {
    for (int k = 3; k > 0; --k) d[k] = u * d[k] + S(k) * d[k - 1];
    d[0] = u * d[0] + Vector3<S>{S((*c)[0]), S((*c)[1]), S((*c)[2])};
  }
  return d;
}

template <class S>
using Functions = std::array<MotionFunction<S>, 3>;

// f(u) of the motion, of f, f' and f'' at the value of u.
template <class S>
Functions<S> along(const MotionFunction<S>& u, const Vector3<S>& f, const Vector3<S>& first, const Vector3<S>& second) {
  const auto one = [&](int i) { return MotionFunction<S>(f[i], first[i] * u.gradient, first[i] * u.dot, first[i] * u.rate + second[i] * u.dot * u.dot); };
  return {one(0), one(1), one(2)};
}
template <class S>
MotionFunction<S> product(const Functions<S>& a, const Functions<S>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
template <class S>
Functions<S> crossed(const Functions<S>& a, const Functions<S>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// -t·t + (p - c)·c'': the derivative of (p - c)·t by u, zero where it is taken to stay.
template <class S>
S slope_at(const Vector3<S>& p, const std::array<Vector3<S>, 4>& c) {
  const S square = dot(c[1], c[1]), slope = dot(p - c[0], c[2]) - square;
  return to_double(slope) < -least_slope * to_double(square) ? slope : S(0);
}

}  // namespace

template <class S>
void curve_rows(const Curve& curve, const RelativeMotion<S>& m, S* residual, Vector6<S>* gradients, S* rates) {
  const Vector3<S>& p = m.X.p;
  const Curve::Place place = curve.nearest({to_double(p[0]), to_double(p[1]), to_double(p[2])});
  S at(place.u);
  for (int i = 0; i < refinements; ++i) {
    const auto c = derivatives(place.piece->c, at);
    const S slope = slope_at(p, c);
    if (!(slope == S(0))) at = at - dot(p - c[0], c[1]) / slope;
  }
  const auto c = derivatives(place.piece->c, at), n = derivatives(place.piece->m, at);
  const S slope = slope_at(p, c);
  const Functions<S> point{position_entry(m, 0), position_entry(m, 1), position_entry(m, 2)};
  MotionFunction<S> u(at);
  const auto off = [&] {
    const Functions<S> on = along(u, c[0], c[1], c[2]);
    return Functions<S>{point[0] - on[0], point[1] - on[1], point[2] - on[2]};
  };
  if (!(slope == S(0)))
    for (int i = 0; i < 2; ++i) {
      const S value = u.value;
      u = u - S(1) / slope * product(off(), along(u, c[1], c[2], c[3]));
      u.value = value;  // at which the derivatives are taken
    }
  const Functions<S> t = along(u, c[1], c[2], c[3]), across = crossed(along(u, n[0], n[1], n[2]), t), other = crossed(t, across);
  const MotionFunction<S> rows[] = {product(across, off()) / sqrt(product(across, across)), product(other, off()) / sqrt(product(other, other))};
  for (int i = 0; i < 2; ++i) residual[i] = rows[i].value, gradients[i] = rows[i].gradient, rates[i] = rows[i].rate;
}

// A search is not written down; such loops are refused before, by name (loop_pairs.h, check_on_tape).
#define PYCRAFT_NO_ROWS(S)                                                                                                  \
  template <>                                                                                                            \
  void curve_rows(const Curve&, const RelativeMotion<S>&, S*, Vector6<S>*, S*) {                                   \
    throw EvaluationError("rows of a point on a curve are sought, and cannot be written down");                                      \
  }
PYCRAFT_FOR_EACH_RECORDED(PYCRAFT_NO_ROWS)

#define PYCRAFT_CURVE_ROWS(S) template void curve_rows(const Curve&, const RelativeMotion<S>&, S*, Vector6<S>*, S*);
PYCRAFT_FOR_EACH_CARRIED(PYCRAFT_CURVE_ROWS)

}  // namespace pycraft
