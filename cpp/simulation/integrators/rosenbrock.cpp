#include "simulation/integrators/rosenbrock.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "simulation/integrators/steps_on_the_group.h"

namespace pycraft {

namespace {

using Vector = Eigen::VectorXd;
constexpr int stages = 6;
constexpr double gamma = 0.25;
constexpr double d[stages] = {0.25, -0.1043, 0.1035, -0.03620000000000023, 0, 0};
constexpr double c[stages] = {0, 0.386, 0.21, 0.63, 1, 1};
// k_j in the argument of stage i, and over h beside it. The last two arguments add k_5 to that of the one before, the result k_6 to that.
constexpr double a[stages][5] = {{},
                                 {1.544},
                                 {0.9466785280815826, 0.2557011698983284},
                                 {3.314825187068521, 2.896124015972201, 0.9986419139977817},
                                 {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950},
                                 {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1}};
constexpr double C[stages][5] = {{},
                                 {-5.6688},
                                 {-2.430093356833875, -0.2063599157091915},
                                 {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
                                 {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160},
                                 {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054}};
constexpr double between[2][5] = {{10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662},
                                  {-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872}};

class Rodas : public Attempts<double> {
 public:
  Rodas(LinearizedEquations<double>& equations, const IntegratorOptions& options)
      : equations_(equations), model_(equations.model()), options_(options), nq_(equations.nq()), nv_(equations.nv()), n_(nv_ + equations.rest() - equations.integrals()),
        rest_rate_(equations.rest()), q_(nq_), lanes_(nv_), vdot_(nv_) {
    for (Vector* v : {&z0_, &z_, &right_z_}) v->resize(n_);
    for (Vector* v : {&u_, &right_u_, &swept_}) v->resize(nv_);
    for (int i = 0; i < stages; ++i) k_u_[i].resize(nv_), k_z_[i].resize(n_);
    for (int i = 0; i < 2; ++i) between_u_[i].resize(nv_), between_z_[i].resize(n_);
    swept_columns_.resize(n_, nv_);
  }

  bool attempt(double& t, State& x, double& h) override {
    take(t, x, h);
    const double error = worst_error(x, h);
    const double change = std::clamp(std::pow(error, 0.25) / 0.9, 0.2, 6.0);  // a bound that is not a number is passed on
    if (!(error <= 1)) {
      h = std::isfinite(error) ? h / std::max(change, 1.1) : h / 10;
      return false;
    }
    finish(x, h);
    t += h, x = to_;
    h /= change;
    return true;
  }
  bool interpolate(const double& t, State& out) override {
    const double s = (t - t0_) / h_, r = 1 - s;
    u_ = s * (u1_ + r * (between_u_[0] + s * between_u_[1]));
    z_ = r * z0_ + s * (z1_ + r * (between_z_[0] + s * between_z_[1]));
    out.resize(from_.size());
    move_configuration(model_, from_.data(), u_.data(), out.data());
    std::copy_n(z_.data(), n_, out.data() + nq_);
    const size_t first = nq_ + n_;
    for (size_t i = 0; i < first_powers_.size(); ++i) {  // what a parabola through the powers at both ends and in the middle adds up to
      const double p = first_powers_[i], bend = middle_powers_[i] - p, end = last_powers_[i] - p;
      out[first + i] = from_[first + i] + h_ * s * (p + s * (2 * bend - end / 2 + s * (2 * end / 3 - 4 * bend / 3)));
    }
    return true;
  }
  bool again(const double& from, const State& x, const double& to) override {
    take(from, x, to - from);
    finish(x, to - from);
    return true;
  }

 private:
  // u̇ and ż at (u, z), the integrals' rates in rest_rate_.
  void rates(double t, const Vector& u, const Vector& z, Vector& u_rate, Vector& z_rate) {
    move_configuration(model_, from_.data(), u.data(), q_.data());
    std::copy_n(z.data() + nv_, n_ - nv_, rest_.data());
    equations_.evaluate(t, q_.data(), z.data(), rest_.data(), vdot_.data(), rest_rate_.data());
    exponential_coordinates_rate(model_, u.data(), equations_.velocities(), u_rate.data());
    std::copy_n(vdot_.data(), nv_, z_rate.data());
    std::copy_n(rest_rate_.data(), n_ - nv_, z_rate.data() + nv_);
  }
  // The six stages from (t, x).
  void take(double t, const State& x, double h) {
    from_ = x, to_ = x, t0_ = t, h_ = h;
    rest_.assign(x.begin() + nq_ + nv_, x.end());
    std::copy_n(x.data() + nq_, n_, z0_.data());
    for (int i = 0; i < stages; ++i) {
      u_.setZero(), z_ = z0_;
      for (int j = 0; j < std::min(i, 5); ++j) u_ += a[i][j] * k_u_[j], z_ += a[i][j] * k_z_[j];
      rates(t + c[i] * h, u_, z_, right_u_, right_z_);
      if (i == 0) {
        first_powers_.assign(rest_rate_.end() - equations_.integrals(), rest_rate_.end());
        factorize(t, h);
      }
      right_z_ += h * d[i] * linear_.along_t;
      for (int j = 0; j < std::min(i, 5); ++j) right_u_ += C[i][j] / h * k_u_[j], right_z_ += C[i][j] / h * k_z_[j];
      solve(k_u_[i], k_z_[i]);
    }
    u1_ = u_ + k_u_[5], z1_ = z_ + k_z_[5];
    for (int i = 0; i < 2; ++i) {
      between_u_[i].setZero(), between_z_[i].setZero();
      for (int j = 0; j < 5; ++j) between_u_[i] += between[i][j] * k_u_[j], between_z_[i] += between[i][j] * k_z_[j];
    }
  }
  void factorize(double t, double h) {
    ++equations_.linearizations;
    equations_.linearize(t, h, from_.data(), from_.data() + nq_, rest_.data(), vdot_.data(), rest_rate_.data(), linear_);
    const double scale = 1 / (gamma * h);
    each_subhinge(model_, [&](auto row, int, int at) {
      if constexpr (row.nv > 1) {  // ½ [e_i, v] is column i
        Eigen::Matrix<double, row.nv, row.nv> M;
        for (int i = 0; i < row.nv; ++i) {
          double e[row.nv] = {}, column[row.nv];
          e[i] = 1;
          row.bracket(static_cast<const double*>(e), from_.data() + nq_ + at, column);
          for (int k = 0; k < row.nv; ++k) M(k, i) = (i == k ? scale : 0) - column[k] / 2;
        }
        lanes_[at] = M.inverse();
      }
    });
    // ∂g/∂u W, by rows.
    for (int i = 0; i < n_; ++i) {
      each_subhinge(model_, [&](auto row, int, int at) {
        if constexpr (row.nv == 1)
          swept_columns_(i, at) = linear_.along_u(i, at) / scale;
        else
          swept_columns_.block(i, at, 1, row.nv).noalias() = linear_.along_u.block(i, at, 1, row.nv) * lanes_[at];
      });
    }
    system_ = scale * linear_.mass - linear_.along_z;
    system_.leftCols(nv_) -= swept_columns_;
    factors_.compute(system_);
  }
  // k of the right sides.
  void solve(Vector& k_u, Vector& k_z) {
    both_.noalias() = linear_.mass * right_z_;
    both_.noalias() += swept_columns_ * right_u_;
    k_z = factors_.solve(both_);
    swept_ = right_u_ + k_z.head(nv_);
    each_subhinge(model_, [&](auto row, int, int at) {
      if constexpr (row.nv == 1)
        k_u[at] = gamma * h_ * swept_[at];
      else
        k_u.segment(at, row.nv).noalias() = lanes_[at] * swept_.segment(at, row.nv);
    });
  }
  double worst_error(const State& x, double h) {
    double worst = 0;
    const auto judge = [&](double error, double size, double rate) {
      const double share = std::abs(error) / (options_.atol + options_.rtol * (size + std::abs(h * rate)));
      if (!(share <= worst)) worst = std::isnan(share) ? HUGE_VAL : share;
    };
    each_subhinge(model_, [&](auto row, int q, int at) {
      for (int i = 0; i < row.nv; ++i)
        if (!linear_.known[at + i]) judge(k_u_[5][at + i], row.nv == 1 ? std::abs(x[q]) : i < 3 ? 1 : std::abs(x[q + 1 + i]), u1_[at + i] / h);
    });
    for (int i = 0; i < n_; ++i)
      if (i >= nv_ || !linear_.known[i]) judge(k_z_[5][i], std::abs(z0_[i]), (z1_[i] - z0_[i]) / h);
    return worst;
  }
  void finish(const State& x, double h) {
    move_configuration(model_, x.data(), u1_.data(), to_.data());
    std::copy_n(z1_.data(), n_, to_.data() + nq_);
    const int count = equations_.integrals();
    if (count == 0) return;
    const auto powers = [&](const State& at, double t, State& out) {
      equations_.evaluate(t, at.data(), at.data() + nq_, at.data() + nq_ + nv_, vdot_.data(), rest_rate_.data());
      out.assign(rest_rate_.end() - count, rest_rate_.end());
    };
    middle_powers_ = last_powers_ = first_powers_;  // none is read yet
    interpolate(t0_ + h / 2, middle_);
    powers(middle_, t0_ + h / 2, middle_powers_);
    powers(to_, t0_ + h, last_powers_);
    for (int i = 0; i < count; ++i) to_[to_.size() - count + i] += h / 6 * (first_powers_[i] + 4 * middle_powers_[i] + last_powers_[i]);
  }

  LinearizedEquations<double>& equations_;
  const CompiledModel<double>& model_;
  IntegratorOptions options_;
  int nq_, nv_, n_;
  State from_, to_, middle_, rest_, rest_rate_, q_;
  State first_powers_, middle_powers_, last_powers_;
  std::vector<Eigen::MatrixXd> lanes_;  // W of hinges of several coordinates, at the first of them
  Linearization linear_;
  Eigen::MatrixXd system_, swept_columns_;
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
  Vector z0_, z_, z1_, u_, u1_, right_u_, right_z_, both_, swept_, k_u_[stages], k_z_[stages], between_u_[2], between_z_[2];
  std::vector<double> vdot_;
  double t0_ = 0, h_ = 1;
};

}  // namespace

std::unique_ptr<ControlledSteps<double>> rosenbrock_steps(LinearizedEquations<double>& equations, const IntegratorOptions& options) {
  const auto make = [&] { return std::make_unique<Rodas>(equations, options); };
  return std::make_unique<ControlledSteps<double>>(equations, make(), make(), options);
}

}  // namespace pycraft
