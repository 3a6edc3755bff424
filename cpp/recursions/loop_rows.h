// Rows of loops (model/loops.h): residuals, the Jacobian Q and Q̇θ̇, in any scalar, without allocation where the buffers have been used before.
//
// X is the pose of the end frame on b in the end frame on a, V its twist, A = V̇ (recursions/frame_motions.h). Every row is g·V = 0, g a function
// of X, and of a row of positions g the gradient of its residual r(X), so that with V = 𝒥θ̇
//
//   Q = g·𝒥,   Qθ̈ + Q̇θ̇ = 0,   Q̇θ̇ = g·𝒥̇θ̇ + ġ·V
//
// exactly, where the loop is open too. The residuals, with ε the vector of X's quaternion of w >= 0 (|ε| the sine of half the angle):
//
//   about x, y, z   2ε                                                       g = (w ω + ε × ω),  ġ·V = -½ |ω|² ε
//   about x, y      (-R_yz, R_xz)/√((1 + R_zz)/2): |r| = 2 sin(angle between the axes / 2)
//   along x, y, z   p;   between the axes   R_zz - cos;   along and about z   p_z - pitch (angle about z + 2π n), n such that |r| is least
//   custom          what is left of about and along all axes at the nearest place of the hinge (custom_rows.h)
//   across          the quadric of p;   across 1, 2   along two normals at the nearest place of a curve (curve_rows.h);   contact   the height of the wheel's or ball's lowest point
//
// Each is zero where the loop is closed and nowhere else, and smooth but where a turn of half a circle is missing: there 2ε changes its sign,
// and the direction of (about x, y) is none; its length 2 is right. Exchanging a and b leaves what the rows span, where the loop is closed.
//
// Rows of velocities: the velocity of the point of contact, in the ground's directions (z its normal), of a wheel of radius ρ about its axis z,
//
//   e = (g_x, g_y, 0)/μ, g = R*z, μ² = g_x² + g_y²:   c = -ρ e,  u = v + ω × c = 0:   rolling (z × e)·u,  sideways (g × (z × e))·u
//
// of a ball c = -ρ g, and of a blade v_z. Source: A. Jain, Robot and Multibody Dynamics, Springer 2011, ch. 11 (Q of loops); quaternions of
// joints: A. Shabana, Dynamics of Multibody Systems, Cambridge 2013.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "model/loops.h"
#include "model/unit_data.h"
#include "recursions/curve_rows.h"
#include "recursions/custom_rows.h"
#include "recursions/motion_functions.h"
#include "runtime/errors.h"

namespace pycraft {

// A row of a pair: r, zero of velocities; g; ġ·V.
template <class S>
struct PairRow {
  S residual;
  Vector6<S> gradient;
  S rate;
  PairRow() : residual(0), gradient(Vector6<S>::zero()), rate(0) {}
  PairRow(const MotionFunction<S>& f) : residual(f.value), gradient(f.gradient), rate(f.rate) {}
  // Of velocities: the sum of coefficient functions times entries of V.
  PairRow(const std::array<MotionFunction<S>, 6>& c, const Vector6<S>& V) : PairRow() {
    for (int i = 0; i < 6; ++i) gradient[i] = c[i].value, rate = rate + c[i].dot * V[i];
  }
};
constexpr int most_pair_rows = 6;

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
  if (!(square.value > S(0))) throw EvaluationError("the wheel on '" + pair.b + "' lies flat on its ground: no point of it is the lowest, and its rows have no direction");
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

// The rows of a pair at its motion, of its velocity where rates are wanted.
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

// ------------------------------------------------------------------ all rows at a state

// A twist fixed in the hinge of a body before one of its subhinges, in the axes there, by an amount of which derivatives alone are taken
// (operators/directions.h): X <- X (1 + ξ~), ξ carried outboard by the steps that follow, and rows of H inboard of it move along.
template <class S>
struct InsertedMotion {
  int body, position;
  Vector6<S> twist;
};
template <class S>
void insert_motion(const CompiledModel<S>& model, const S* q, const InsertedMotion<S>& inserted, RelativeMotion<S>& m, HingeRows<S>& hinge) {
  const int k = inserted.body, first = model.first_subhinge[k];
  const S* at = q + model.q_offset[k];
  Pose<S> later = Pose<S>::identity();
  int before = 0;
  for (int i = first; i < model.first_subhinge[k + 1]; ++i) {
    const CompiledSubhinge<S>& h = model.subhinges[i];
    if (i - first >= inserted.position) later = later * subhinge_step(h, at);
    else before += record_of(h.kind).nv;
    at += record_of(h.kind).nq;
  }
  const Vector6<S> xi = motion_to_child(later, inserted.twist);
  for (int j = 0; j < before; ++j) hinge.rows[j] = hinge.rows[j] - cross_motion(xi, hinge.rows[j]);
  Matrix3<S> turned = m.X.R;
  for (int i = 0; i < 3; ++i) {
    const Vector3<S> turning = cross(row_of(m.X.R, i), xi.angular);
    for (int j = 0; j < 3; ++j) turned(i, j) += turning[j];
  }
  m.X.p = m.X.p + m.X.R * xi.linear, m.X.R = turned;
}

template <class S>
struct LoopBuffers {
  HingeRows<S> hinge;
  std::vector<std::pair<int, Vector6<S>>> columns;     // 𝒥 of one pair
  PairRow<S> rows[most_pair_rows];
  std::vector<S> at_rest;                              // zeros
  std::vector<double> coordinates, gradient, second;   // of a function of the user's
  std::vector<InsertedMotion<S>> inserted;             // inboard first where they are of one hinge
};

// The motion of a step at q; its V and A at rest accelerations, as far as `part` wants them. hinge: w.hinge.
template <class S>
RelativeMotion<S> loop_step(const CompiledModel<S>& model, const FrameStep& step, const S* q, const S* v, MotionPart part, HingeRows<S>& hinge,
                            const LoopBuffers<S>& w) {
  if (step.pose) return {renormalised<S>(*step.pose)};
  RelativeMotion<S> m;
  hinge_pose(model, step.number, q, m, hinge);
  for (const InsertedMotion<S>& inserted : w.inserted)
    if (inserted.body == step.number) insert_motion(model, q, inserted, m, hinge);
  const S* const own = v + model.v_offset[step.number];
  if (part >= MotionPart::velocity) hinge_velocity(model, step.number, own, m, hinge);
  if (part == MotionPart::acceleration) hinge_acceleration(own, w.at_rest.data(), m, hinge);
  return m;
}

// The polynomials of a coupling, or its function: constant + Σ P_i(q_i), P_i' per coordinate to entry(i, P_i'), and Σ P_i'' v_i² in `rate`.
template <class S, class F>
S coupling_row(const ResolvedLoop& loop, const S* q, const S* v, LoopBuffers<S>& w, S& rate, F entry) {
  const Coupling& of = loop.loop->coupling;
  const int n = static_cast<int>(of.coordinates.size());
  rate = S(0);
  if (of.function) {
    if constexpr (!std::is_same_v<S, double>) throw EvaluationError("coupling '" + loop.loop->name + "' is a function in double precision; ask for that, or give polynomials");
    w.coordinates.resize(n), w.gradient.resize(n), w.second.resize(n * n);
    for (int i = 0; i < n; ++i) w.coordinates[i] = to_double(q[loop.q[i]]);
    double r = 0;
    of.function(w.coordinates.data(), &r, w.gradient.data(), w.second.data(), nullptr);
    for (int i = 0; i < n; ++i) {
      entry(i, S(w.gradient[i]));
      for (int j = 0; v && j < n; ++j) rate += S(w.second[i * n + j]) * v[loop.v[i]] * v[loop.v[j]];
    }
    return S(r);
  }
  S r(of.constant);
  for (int i = 0; i < n; ++i) {
    const S& x = q[loop.q[i]];
    S value(0), slope(0), half_bend(0);  // Horner's scheme with its derivatives
    for (auto c = of.coordinates[i].coefficients.rbegin(); c != of.coordinates[i].coefficients.rend(); ++c) {
      half_bend = half_bend * x + slope;
      slope = slope * x + value;
      value = value * x + S(*c);
    }
    r += value;
    entry(i, slope);
    if (v) rate += S(2) * half_bend * v[loop.v[i]] * v[loop.v[i]];
  }
  return r;
}

// r (rows), at q.
template <class S>
void loop_residuals(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, LoopBuffers<S>& w, S* residual) {
  for (const ResolvedLoop& loop : loops.loops) {
    if (loop.loop->is_coupling()) {
      S rate;
      residual[loop.first_row] = coupling_row(loop, q, static_cast<const S*>(nullptr), w, rate, [](int, const S&) {});
      continue;
    }
    const auto m = along<S>(loop.path, MotionPart::pose, [&](const FrameStep& step) { return loop_step<S>(model, step, q, nullptr, MotionPart::pose, w.hinge, w); });
    std::fill_n(w.rows, loop.rows, PairRow<S>());
    pair_rows(loop.loop->pair, m, w.rows);
    for (int i = 0; i < loop.rows; ++i) residual[loop.first_row + i] = w.rows[i].residual;
  }
}

// Calls coupling(loop, i, slope) for every coordinate of a coupling, and pair(loop, X) for a pair, whose rows' gradients are w.rows and whose 𝒥
// is w.columns then.
template <class S, class C, class P>
void visit_loop_rows(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, LoopBuffers<S>& w, C coupling, P pair) {
  for (const ResolvedLoop& loop : loops.loops) {
    if (loop.loop->is_coupling()) {
      S rate;
      coupling_row(loop, q, static_cast<const S*>(nullptr), w, rate, [&](int i, const S& slope) { coupling(loop, i, slope); });
      continue;
    }
    w.columns.clear();
    const auto m = jacobian_along(
        model, loop.path, false, w.hinge,
        [&](const FrameStep& step, HingeRows<S>& hinge) { return loop_step<S>(model, step, q, nullptr, MotionPart::pose, hinge, w); },
        [&](int i, const Vector6<S>& J, const Vector6<S>&) { w.columns.emplace_back(i, J); });
    std::fill_n(w.rows, loop.rows, PairRow<S>());
    pair_rows(loop.loop->pair, m, w.rows);
    pair(loop, m.X);
  }
}

// entry(row, coordinate, number) of Q at q, for those that may be other than zero.
template <class S, class F>
void loop_jacobian(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, LoopBuffers<S>& w, F entry) {
  visit_loop_rows(
      model, loops, q, w, [&](const ResolvedLoop& loop, int i, const S& slope) { entry(loop.first_row, loop.v[i], slope); },
      [&](const ResolvedLoop& loop, const Pose<S>&) {
        for (int r = 0; r < loop.rows; ++r)
          for (const auto& [i, J] : w.columns) entry(loop.first_row + r, i, dot(w.rows[r].gradient, J));
      });
}

// Q̇θ̇ (rows), at q and v.
template <class S>
void loop_bias(const CompiledModel<S>& model, const ResolvedLoops& loops, const S* q, const S* v, LoopBuffers<S>& w, S* bias) {
  w.at_rest.assign(model.nv, S(0));
  for (const ResolvedLoop& loop : loops.loops) {
    if (loop.loop->is_coupling()) {
      coupling_row(loop, q, v, w, bias[loop.first_row], [](int, const S&) {});
      continue;
    }
    const auto m = along<S>(loop.path, MotionPart::acceleration,
                            [&](const FrameStep& step) { return loop_step(model, step, q, v, MotionPart::acceleration, w.hinge, w); });
    std::fill_n(w.rows, loop.rows, PairRow<S>());
    pair_rows(loop.loop->pair, m, w.rows);
    for (int i = 0; i < loop.rows; ++i) bias[loop.first_row + i] = dot(w.rows[i].gradient, m.A) + w.rows[i].rate;
  }
}

}  // namespace pycraft
