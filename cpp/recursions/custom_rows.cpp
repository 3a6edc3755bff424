#include "recursions/custom_rows.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "model/compiled_model.h"
#include "model/configuration.h"
#include "model/hinge_kinematics.h"
#include "model/spanned_twists.h"
#include "recursions/carried.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

constexpr int places = 24;             // that s is sought from
constexpr double near_enough = 1e-6;   // of e: larger is no state on the loops, as embedding has it
constexpr int most_steps = 100;

// A scalar without the derivatives that it carries, and how many orders of them.
template <class S>
struct Carried {
  using Bare = S;
  static constexpr int orders = 0;
};
template <class T, int W>
struct Carried<Tangent<T, W>> {
  using Bare = typename Carried<T>::Bare;
  static constexpr int orders = Carried<T>::orders + 1;
};

template <class S>
Vector6<S> product(const Vector6<S>* G, const Vector6<S>& V) {
  Vector6<S> x;
  for (int i = 0; i < 6; ++i) x[i] = dot(G[i], V);
  return x;
}

// e, G and B at a place of the hinge.
template <class S>
struct Off {
  Vector6<S> e, G[6];
  std::vector<Vector6<S>> B;

  void find(const CompiledModel<S>& hinge, const Pose<S>& X, const std::vector<S>& s) {
    B.resize(hinge.nv);
    const Pose<S> Y = inverse(hinge_kinematics(hinge, 0, s.data(), B.data())) * X;
    const Quaternion<S> q = rotation_quaternion(Y.R);
    const Vector3<S> epsilon{q.x, q.y, q.z};
    for (int i = 0; i < 3; ++i) {
      Vector3<S> unit = Vector3<S>::zero();
      unit[i] = S(1);
      e[i] = S(2) * epsilon[i], e[3 + i] = Y.p[i];
      G[i] = {q.w * unit + cross(unit, epsilon), Vector3<S>::zero()};
      G[3 + i] = {Vector3<S>::zero(), {Y.R(i, 0), Y.R(i, 1), Y.R(i, 2)}};
    }
    for (Vector6<S>& b : B) b = product(G, motion_to_child(Y, b));
  }
  // B*e
  std::vector<S> slopes() const {
    std::vector<S> all;
    for (const Vector6<S>& b : B) all.push_back(dot(b, e));
    return all;
  }
};

// s moved along δ on the hinge's group; rotations by (1, δ/2) made a unit, which has derivatives at δ = 0.
template <class S>
std::vector<S> moved(const CompiledModel<S>& hinge, const std::vector<S>& s, const std::vector<S>& delta) {
  std::vector<S> to(s.size());
  each_subhinge(hinge, [&](auto row, int at, int from) {
    if constexpr (decltype(row)::record.quaternion < 0) {
      row.move(s.data() + at, delta.data() + from, to.data() + at);
    } else {
      const S half = S(1) / S(2);
      const Quaternion<S> turned = Quaternion<S>{s[at], s[at + 1], s[at + 2], s[at + 3]} * Quaternion<S>{S(1), half * delta[from], half * delta[from + 1], half * delta[from + 2]};
      const S scale = S(1) / length(turned);
      to[at] = scale * turned.w, to[at + 1] = scale * turned.x, to[at + 2] = scale * turned.y, to[at + 3] = scale * turned.z;
    }
  });
  return to;
}

// A⁻¹ of a positive n x n matrix, by rows, with so much of its trace on its diagonal that there is one where the hinge locks.
std::vector<double> damped_inverse(std::vector<double> A, int n, double damping) {
  double trace = 1e-300;
  for (int i = 0; i < n; ++i) trace += std::abs(A[i * n + i]);
  std::vector<double> inverse(n * n, 0.0);
  for (int i = 0; i < n; ++i) A[i * n + i] += damping * trace, inverse[i * n + i] = 1;
  for (int k = 0; k < n; ++k) {
    int best = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(A[i * n + k]) > std::abs(A[best * n + k])) best = i;
    for (int j = 0; j < n; ++j) std::swap(A[k * n + j], A[best * n + j]), std::swap(inverse[k * n + j], inverse[best * n + j]);
    const double pivot = A[k * n + k];
    for (int j = 0; j < n; ++j) A[k * n + j] /= pivot, inverse[k * n + j] /= pivot;
    for (int i = 0; i < n; ++i) {
      const double factor = A[i * n + k];
      if (i == k || factor == 0) continue;
      for (int j = 0; j < n; ++j) A[i * n + j] -= factor * A[k * n + j], inverse[i * n + j] -= factor * inverse[k * n + j];
    }
  }
  return inverse;
}

template <class S>
std::vector<S> times(const std::vector<double>& A, const std::vector<S>& x) {
  const size_t n = x.size();
  std::vector<S> y(n, S(0));
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < n; ++j) y[i] += S(A[i * n + j]) * x[j];
  return y;
}

// Levenberg's method from one place: s with the least |e| near it, and |e|²/2.
double descend(const CompiledModel<double>& hinge, const Pose<double>& X, std::vector<double>& s) {
  const int n = hinge.nv;
  Off<double> here, there;
  here.find(hinge, X, s);
  double half = dot(here.e, here.e) / 2, damping = 1e-3;
  for (int step = 0; step < most_steps && damping < 1e8; ++step) {
    const std::vector<double> slopes = here.slopes();
    std::vector<double> A(n * n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) A[i * n + j] = dot(here.B[i], here.B[j]);
    const std::vector<double> delta = times(damped_inverse(A, n, damping), slopes);
    const std::vector<double> onto = moved(hinge, s, delta);
    there.find(hinge, X, onto);
    const double left = dot(there.e, there.e) / 2;
    double gain = 0;
    for (int i = 0; i < n; ++i) gain += delta[i] * slopes[i];
    if (left < half) {
      const bool done = half - left <= 1e-14 * half;
      s = onto, half = left, damping = std::max(damping / 10, 1e-12);
      std::swap(here, there);
      if (done) break;
    } else {
      if (gain <= 1e-15 * half || half == 0) break;
      damping *= 10;
    }
  }
  return half;
}

// Where to begin, the k-th time: zero, then all over the hinge, by the fractional parts of multiples of powers of a root (R. Roberts' sequence).
std::vector<double> start(const CompiledModel<double>& hinge, const Pose<double>& X, int k) {
  std::vector<double> s(hinge.nq, 0.0), delta(hinge.nv);
  each_subhinge(hinge, [&](auto row, int at, int) {
    if constexpr (decltype(row)::record.quaternion >= 0) s[at] = 1;
  });
  if (k == 0) return s;
  double root = 1.5;
  for (int i = 0; i < 30; ++i) root = std::pow(1 + root, 1.0 / (hinge.nv + 1));
  const double far = 1 + norm(X.p);
  each_subhinge(hinge, [&](auto row, int, int from) {
    for (int j = from; j < from + row.nv; ++j) {
      const double share = k * std::pow(root, -(j + 1));
      delta[j] = (2 * (share - std::floor(share)) - 1) * (decltype(row)::record.translations ? far : M_PI);
    }
  });
  return moved(hinge, s, delta);
}

std::vector<double> nearest_place(const CompiledModel<double>& hinge, const Pose<double>& X) {
  std::vector<double> best;
  double least = 0;
  for (int k = 0; k < places; ++k) {
    std::vector<double> s = start(hinge, X, k);
    const double half = descend(hinge, X, s);
    if (best.empty() || half < least * (1 - 1e-6)) best = std::move(s), least = half;
    if (least < near_enough * near_enough) break;
  }
  return best;
}

// The inverse of the slope of B*e by s, at s, of which -B*B is all where e is zero.
std::vector<double> inverse_slope(const CompiledModel<double>& hinge, const Pose<double>& X, const std::vector<double>& s) {
  using T = Tangent<double, 1>;
  const int n = hinge.nv;
  const CompiledModel<T> model = broadcast<T>(hinge);
  const Pose<T> at = cast<T>(X);
  const std::vector<T> from(s.begin(), s.end());
  std::vector<double> slope(n * n);
  std::vector<T> delta(n, T(0.0));
  Off<T> off;
  for (int j = 0; j < n; ++j) {
    delta[j].d[0] = 1;
    off.find(model, at, moved(model, from, delta));
    const std::vector<T> slopes = off.slopes();
    for (int i = 0; i < n; ++i) slope[i * n + j] = -slopes[i].d[0];
    delta[j].d[0] = 0;
  }
  return damped_inverse(slope, n, 1e-14);
}

// (R, p) in motion along a twist V in its own axes, with derivatives by time.
template <class S>
Pose<Tangent<S, 1>> in_motion(const Pose<S>& X, const Vector6<S>& V) {
  Pose<Tangent<S, 1>> moving = cast<Tangent<S, 1>>(X);
  const Vector3<S> velocity = X.R * V.linear;
  for (int i = 0; i < 3; ++i) {
    const Vector3<S> turning = cross(Vector3<S>{X.R(i, 0), X.R(i, 1), X.R(i, 2)}, V.angular);  // rows of R ω~
    for (int j = 0; j < 3; ++j) moving.R(i, j).d[0] = turning[j];
    moving.p[i].d[0] = velocity[i];
  }
  return moving;
}

}  // namespace

template <class S>
void custom_rows(const Multibody& permitted, const Pose<S>& X, const Vector6<S>& V, S* residual, Vector6<S>* gradients, S* rates) {
  using T = Tangent<S, 1>;
  using Bare = typename Carried<S>::Bare;
  const auto in_double = permitted.compiled<double>();
  const CompiledModel<T> hinge = broadcast<T>(*permitted.compiled<Bare>());
  Pose<double> near;
  for (int i = 0; i < 3; ++i) {
    near.p[i] = to_double(X.p[i]);
    for (int j = 0; j < 3; ++j) near.R(i, j) = to_double(X.R(i, j));
  }
  const std::vector<double> place = nearest_place(*in_double, near), slope = inverse_slope(*in_double, near, place);
  const Pose<T> moving = in_motion(X, V);
  std::vector<T> s(place.begin(), place.end());
  Off<T> off;
  const int refinements = 1 + Carried<T>::orders + std::numeric_limits<Bare>::digits10 / 12;
  for (int i = 0; i < refinements; ++i) {
    off.find(hinge, moving, s);
    s = moved(hinge, s, times(slope, off.slopes()));
  }
  off.find(hinge, moving, s);
  std::vector<Vector6<T>> basis = off.B;
  const int rank = orthonormal(basis);
  for (int i = 0; i < 6; ++i) {
    Vector6<T> g = off.G[i];
    for (int b = 0; b < rank; ++b)
      for (int k = 0; k < 6; ++k) g = g - (basis[b][i] * basis[b][k]) * off.G[k];
    residual[i] = off.e[i].x;
    rates[i] = S(0);
    for (int k = 0; k < 6; ++k) gradients[i][k] = g[k].x, rates[i] += g[k].d[0] * V[k];
  }
}

// A search is not written down; such loops are refused before, by name (loop_pairs.h, check_on_tape).
#define PYCRAFT_NO_ROWS(S)                                                                                                  \
  template <>                                                                                                            \
  void custom_rows(const Multibody&, const Pose<S>&, const Vector6<S>&, S*, Vector6<S>*, S*) {                                   \
    throw EvaluationError("rows of a hinge that is any sequence of subhinges are sought, and cannot be written down");                                      \
  }
PYCRAFT_FOR_EACH_RECORDED(PYCRAFT_NO_ROWS)

#define PYCRAFT_CUSTOM_ROWS(S) template void custom_rows(const Multibody&, const Pose<S>&, const Vector6<S>&, S*, Vector6<S>*, S*);
PYCRAFT_FOR_EACH_CARRIED(PYCRAFT_CUSTOM_ROWS)

}  // namespace pycraft
