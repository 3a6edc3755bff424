#include "recursions/pair_rows.h"

#include <cmath>

#include "model/recorded_model.h"
#include "recursions/carried.h"
#include "recursions/curve_rows.h"
#include "recursions/custom_rows.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

// 2ε
template <class S>
void rows_about_all(const RelativeMotion<S>& m, PairRow<S>* out) {
  const Quaternion<S> q = rotation_quaternion(m.X.R);
  const Vector3<S> epsilon{q.x, q.y, q.z};
  const S half_square = dot(m.V.angular, m.V.angular) / S(2);
  for (int i = 0; i < 3; ++i) {
    Vector3<S> e = Vector3<S>::zero();
    e[i] = S(1);
    out[i].residual = S(2) * epsilon[i];
    out[i].gradient = {q.w * e + cross(e, epsilon), Vector3<S>::zero()};  // e·(ε × ω) = (e × ε)·ω
    out[i].rate = -(half_square * epsilon[i]);
  }
}

template <class S>
void rows_about_two(const RelativeMotion<S>& m, PairRow<S>* out) {
  const MotionFunction<S> square = S(1) / S(2) * (MotionFunction<S>(S(1)) + rotation_entry(m, 2, 2));
  if (square.value > epsilon<S>() * epsilon<S>()) {
    const MotionFunction<S> root = sqrt(square);
    out[0] = -rotation_entry(m, 1, 2) / root, out[1] = rotation_entry(m, 0, 2) / root;
  } else {
    out[0] = MotionFunction<S>(S(2)), out[1] = MotionFunction<S>(S(0));
  }
}

template <class S>
MotionFunction<S> screw_row(const RelativeMotion<S>& m, const S& pitch) {
  using std::atan2;
  const MotionFunction<S> angle = atan2(rotation_entry(m, 1, 0) - rotation_entry(m, 0, 1), rotation_entry(m, 0, 0) + rotation_entry(m, 1, 1));
  const MotionFunction<S> off = position_entry(m, 2) - pitch * angle;
  const S turn = S(8) * atan2(S(1), S(1)) * pitch;
  const double turns = pitch == S(0) ? 0 : std::nearbyint(to_double(S(off.value / turn)));
  return off - MotionFunction<S>(S(turns) * turn);
}

template <class S>
MotionFunction<S> quadric_row(const RelativeMotion<S>& m, const Quadric& of) {
  MotionFunction<S> f(S(of.c));
  for (int i = 0; i < 3; ++i) {
    const MotionFunction<S> p = position_entry(m, i);
    f = f + S(of.b[i]) * p;
    for (int j = 0; j < 3; ++j)
      if (of.A(i, j) != 0) f = f + S(of.A(i, j)) * (p * position_entry(m, j));
  }
  return f;
}

template <class S>
void wheel_rows(const FramePair& pair, const RelativeMotion<S>& m, PairRow<S>* out) {
  const S radius(pair.number);
  using Function = MotionFunction<S>;
  const Function zero(S(0)), gx = rotation_entry(m, 2, 0), gy = rotation_entry(m, 2, 1), gz = rotation_entry(m, 2, 2), square = gx * gx + gy * gy;
  if (!(square.value > S(0))) throw EvaluationError("the wheel on '" + pair.b + "' lies flat on its ground: no point of it is the lowest, and its rows have no direction; tilt it");
  const Function mu = sqrt(square), ex = gx / mu, ey = gy / mu;
  out[0] = position_entry(m, 2) - radius * mu;
  out[1] = {{zero, zero, Function(-radius), -ey, ex, zero}, m.V};
  out[2] = {{-(radius * gy), radius * gx, zero, -(gz * ex), -(gz * ey), mu}, m.V};
}

// The wheel's with e = g, in the ground's x and y: r_x·(ω × g) = ω·r_y, as g × r_x = r_y; r_y·(ω × g) = -ω·r_x.
template <class S>
void ball_rows(const RelativeMotion<S>& m, const S& radius, PairRow<S>* out) {
  out[0] = position_entry(m, 2) - MotionFunction<S>(radius);
  for (int i = 0; i < 2; ++i) {
    const S arm = i ? radius : -radius;
    const auto along = [&](int j) { return rotation_entry(m, i, j); };
    const auto across = [&](int j) { return arm * rotation_entry(m, 1 - i, j); };
    out[1 + i] = {{across(0), across(1), across(2), along(0), along(1), along(2)}, m.V};
  }
}

}  // namespace

template <class S>
void pair_rows(const FramePair& pair, const RelativeMotion<S>& m, PairRow<S>* out) {
  const auto along = [&](std::initializer_list<int> which) {
    for (const int i : which) *out++ = position_entry(m, i);
  };
  switch (pair.kind) {
    case PairKind::weld: return rows_about_all(m, out), out += 3, along({0, 1, 2});
    case PairKind::slider: return rows_about_all(m, out), out += 3, along({0, 1});
    case PairKind::pin: return rows_about_two(m, out), out += 2, along({0, 1, 2});
    case PairKind::cylindrical: return rows_about_two(m, out), out += 2, along({0, 1});
    case PairKind::planar: return rows_about_two(m, out), out += 2, along({2});
    case PairKind::screw:
      rows_about_two(m, out), out += 2, along({0, 1});
      *out = screw_row(m, S(pair.number));
      return;
    case PairKind::universal:
      *out++ = rotation_entry(m, 2, 2) - MotionFunction<S>(S(pair.number));
      return along({0, 1, 2});
    case PairKind::ball: return along({0, 1, 2});
    case PairKind::blade: out[0].gradient[5] = S(1); return;
    case PairKind::wheel: return wheel_rows(pair, m, out);
    case PairKind::rolling_ball: return ball_rows(m, S(pair.number), out);
    case PairKind::surface: out[0] = quadric_row(m, pair.surface); return;
    case PairKind::custom: case PairKind::curve: {
      S residual[most_pair_rows], rates[most_pair_rows];
      Vector6<S> gradients[most_pair_rows];
      const bool custom = pair.kind == PairKind::custom;
      custom ? custom_rows(*pair.permitted, m.X, m.V, residual, gradients, rates) : curve_rows(*pair.curve, m, residual, gradients, rates);
      for (int i = 0; i < (custom ? most_pair_rows : 2); ++i) out[i].residual = residual[i], out[i].gradient = gradients[i], out[i].rate = rates[i];
      return;
    }
    case PairKind::free: return;
  }
}

#define PYCRAFT_PAIR_ROWS(S) template void pair_rows(const FramePair&, const RelativeMotion<S>&, PairRow<S>*);
PYCRAFT_FOR_EACH_CARRIED(PYCRAFT_PAIR_ROWS)
PYCRAFT_FOR_EACH_RECORDED(PYCRAFT_PAIR_ROWS)

}  // namespace pycraft
