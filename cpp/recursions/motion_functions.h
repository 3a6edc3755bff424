// Functions f of a relative motion, with what rows take of them: the gradient g, ḟ = g·V, and what is left of f̈ at V̇ = 0.
//
//   f(X),   ḟ = g·V,   f̈ = g·V̇ + rate,   rate = ġ·V
//   R_ij = r_i·e_j, r_i = R* e_i:   g = (e_j × r_i; 0),   rate = r_i·(ω × (ω × e_j))
//   p_i:                            g = (0; r_i),         rate = r_i·(ω × v)
//
// and products, quotients, roots and angles of these by the rules of second derivatives. V = (ω; v) in the axes of the moving frame.
#pragma once

#include <cmath>

#include "recursions/frame_motions.h"

namespace pycraft {

template <class S>
struct MotionFunction {
  S value;
  Vector6<S> gradient = Vector6<S>::zero();
  S dot = S(0), rate = S(0);
  explicit MotionFunction(const S& constant) : value(constant) {}
  MotionFunction(const S& f, const Vector6<S>& g, const Vector6<S>& V, const S& r) : value(f), gradient(g), dot(pycraft::dot(g, V)), rate(r) {}
  MotionFunction(const S& f, const Vector6<S>& g, const S& d, const S& r) : value(f), gradient(g), dot(d), rate(r) {}

  friend MotionFunction operator+(const MotionFunction& f, const MotionFunction& g) {
    return {f.value + g.value, f.gradient + g.gradient, f.dot + g.dot, f.rate + g.rate};
  }
  friend MotionFunction operator*(const S& a, const MotionFunction& f) { return {a * f.value, a * f.gradient, a * f.dot, a * f.rate}; }
  friend MotionFunction operator-(const MotionFunction& f) { return S(-1) * f; }
  friend MotionFunction operator-(const MotionFunction& f, const MotionFunction& g) { return f + -g; }
  friend MotionFunction operator*(const MotionFunction& f, const MotionFunction& g) {
    return {f.value * g.value, g.value * f.gradient + f.value * g.gradient, g.value * f.dot + f.value * g.dot,
            g.value * f.rate + f.value * g.rate + S(2) * f.dot * g.dot};
  }
  // h with h g = f.
  friend MotionFunction operator/(const MotionFunction& f, const MotionFunction& g) {
    const S by = S(1) / g.value, h = by * f.value, h_dot = by * (f.dot - h * g.dot);
    return {h, by * (f.gradient - h * g.gradient), h_dot, by * (f.rate - h * g.rate - S(2) * h_dot * g.dot)};
  }
  // h with h² = f.
  friend MotionFunction sqrt(const MotionFunction& f) {
    using std::sqrt;
    const S h = sqrt(f.value), by = S(1) / (S(2) * h), h_dot = by * f.dot;
    return {h, by * f.gradient, h_dot, by * (f.rate - S(2) * h_dot * h_dot)};
  }
  // The angle of (c, s):  ρ² θ̇ = c ṡ - s ċ,  ρ² θ̈ = c s̈ - s c̈ - 2 θ̇ (c ċ + s ṡ).
  friend MotionFunction atan2(const MotionFunction& s, const MotionFunction& c) {
    using std::atan2;
    const S by = S(1) / (c.value * c.value + s.value * s.value), dot = by * (c.value * s.dot - s.value * c.dot);
    return {atan2(s.value, c.value), by * (c.value * s.gradient - s.value * c.gradient), dot,
            by * (c.value * s.rate - s.value * c.rate - S(2) * dot * (c.value * c.dot + s.value * s.dot))};
  }
};

template <class S>
inline Vector3<S> row_of(const Matrix3<S>& R, int i) {
  return {R(i, 0), R(i, 1), R(i, 2)};
}

// R_ij and p_i of a motion, of its velocity where rates are wanted.
template <class S>
inline MotionFunction<S> rotation_entry(const RelativeMotion<S>& m, int i, int j) {
  Vector3<S> e = Vector3<S>::zero();
  e[j] = S(1);
  const Vector3<S> row = row_of(m.X.R, i), &w = m.V.angular;
  return {m.X.R(i, j), Vector6<S>{cross(e, row), Vector3<S>::zero()}, m.V, dot(row, cross(w, cross(w, e)))};
}
template <class S>
inline MotionFunction<S> position_entry(const RelativeMotion<S>& m, int i) {
  const Vector3<S> row = row_of(m.X.R, i);
  return {m.X.p[i], Vector6<S>{Vector3<S>::zero(), row}, m.V, dot(row, cross(m.V.angular, m.V.linear))};
}

}  // namespace pycraft
