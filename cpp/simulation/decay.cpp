#include "simulation/decay.h"

#include <cmath>

namespace pycraft {

namespace {

constexpr int powers = 60;

}  // namespace

const Decay& DecayFinder::fastest(double t, const std::vector<double>& x, double step) {
  const int nq = equations_.nq(), nv = equations_.nv(), n = nv + equations_.rest() - equations_.integrals();
  const double *q = x.data(), *v = q + nq, *rest = v + nv;
  vdot_.resize(nv), rest_rate_.resize(equations_.rest());
  equations_.evaluate(t, q, v, rest, vdot_.data(), rest_rate_.data());
  equations_.linearize(t, step, q, v, rest, vdot_.data(), rest_rate_.data(), linear_);
  mass_.compute(linear_.mass);
  for (auto& u : u_) u.setZero(nv);
  for (auto& z : z_) z.setZero(n);
  // Some vector that no symmetry of a mechanism is at right angles to.
  for (int i = 0; i < n; ++i) z_[0][i] = 1 + 0.5 * std::sin(1.7 * i + 0.3);
  for (int i = 0; i < nv; ++i)
    if (linear_.known[i]) z_[0][i] = 0;
  found_ = {};
  const auto product = [&](int a, int b) { return u_[a].dot(u_[b]) + z_[a].dot(z_[b]); };
  for (int i = 0; i < powers; ++i) {
    apply(v, u_[0], z_[0], u_[1], z_[1]);
    const double size = std::sqrt(product(1, 1));
    if (!(size > 0) || !std::isfinite(size)) return found_;
    if (i + 1 < powers) u_[0] = u_[1] / size, z_[0] = z_[1] / size;
  }
  const double length = std::sqrt(product(0, 0));
  for (int k : {0, 1}) u_[k] /= length, z_[k] /= length;
  apply(v, u_[1], z_[1], u_[2], z_[2]);
  // J² x = p J x + s x in least squares, where x and J x are no multiples of each other.
  const double a = product(0, 0), b = product(0, 1), c = product(1, 1), d = a * c - b * b, f = product(0, 2), g = product(1, 2);
  if (d <= 1e-8 * a * c) {
    found_.real = b / a, found_.size = std::abs(b / a);
  } else {
    const double p = (a * g - b * f) / d, s = (c * f - b * g) / d, within = p * p / 4 + s;
    if (within >= 0)
      found_.real = p / 2 + std::copysign(std::sqrt(within), p), found_.size = std::abs(found_.real);
    else
      found_.real = p / 2, found_.size = std::sqrt(-s);
  }
  found_.displacement = u_[1], found_.z = z_[1];
  return found_;
}

void DecayFinder::apply(const double* v, const Eigen::VectorXd& u, const Eigen::VectorXd& z, Eigen::VectorXd& to_u, Eigen::VectorXd& to_z) {
  const int nv = equations_.nv();
  to_u = z.head(nv);
  each_subhinge(equations_.model(), [&](auto row, int, int at) {
    if constexpr (row.nv > 1) {
      double turned[row.nv];
      row.bracket(u.data() + at, v + at, turned);
      for (int i = 0; i < row.nv; ++i) to_u[at + i] += turned[i] / 2;
    }
  });
  right_.noalias() = linear_.along_u * u;
  right_.noalias() += linear_.along_z * z;
  to_z = mass_.solve(right_);
}

}  // namespace pycraft
