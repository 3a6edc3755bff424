// The derivatives of the direct calls on one state or a batch: those of inverse and forward dynamics by kernels where that is the plain case,
// `run` for what takes a state in the scalar of the precision. Forward dynamics is given the doubles of the states, as there: what a narrower
// scalar rounds away, a wider residual sees.
#pragma once

#include <algorithm>
#include <vector>

#include "dynamics/batch_dynamics.h"
#include "dynamics/packed_gradients.h"
#include "dynamics/sensitivities.h"

namespace pycraft {

template <>
inline constexpr bool available_at<Sensitivities, Digits50> = false;
template <>
inline constexpr bool available_at<Sensitivities, Digits100> = false;

class BatchSensitivities : public Batches<Sensitivities> {
 public:
  explicit BatchSensitivities(std::shared_ptr<Multibody> model) : Batches(model), dynamics_(std::move(model)) {}

  // ∂T/∂q, ∂T/∂v and ∂T/∂v̇ = ℳ + J, (nv, nv) a state each.
  void inverse_dynamics(const Given& q, const Given& v, const Given& vdot, Precision precision, const std::array<double*, 3>& out) {
    const ModelInUse use(model());
    check_given(model(), {q, v, vdot});
    const int batch = common_batch({q, v, vdot}), states = batch < 0 ? 1 : batch;
    const size_t square = size_t(model().nv()) * model().nv();
    const auto general = [&](int from, int to) {
      at_precision(precision, [&]<class S>(S) {
        if constexpr (!available_at<Sensitivities, S>) {
          throw EvaluationError(to_quad);
        } else {
          std::vector<S> x[3], y(2 * square);
          each<S>(from, to, states, [&](Sensitivities<S>& w, int b) {
            convert(q.at(b), q.width, x[0]), convert(v.at(b), v.width, x[1]), convert(vdot.at(b), vdot.width, x[2]);
            w.inverse_dynamics(x[0].data(), x[1].data(), x[2].data(), y.data(), y.data() + square);
            for (int i = 0; i < 2; ++i) {
              std::transform(y.begin() + i * square, y.begin() + (i + 1) * square, out[i] + b * square, [](const S& x) { return to_double(x); });
              require_finite(out[i] + b * square, square, model());
            }
            dynamics_.mass_matrix({q.name, q.at(b), q.width}, precision, out[2] + b * square);
          });
        }
      });
    };
    if (!dynamics_.by_links(precision, {.call = kernels::Call::inverse_dynamics_derivatives, .q = q, .v = &v, .u = &vdot, .others = &out[1]}, states, static_cast<int>(square), out[0], general)) general(0, states);
  }

  // Gradients of ln det(ℳ + J), in packs where there are states enough.
  void log_determinant(GradientOver over, const Given& q, Precision precision, double* out) {
    const auto compute = [over](auto& w, auto in, auto* y) {
      using P = decltype(y);
      const auto wanted = [&](GradientOver one) { return one == over ? y : P(nullptr); };
      w.log_determinant(in[0], wanted(GradientOver::coordinates), wanted(GradientOver::inertias), wanted(GradientOver::geometry), wanted(GradientOver::axes));
    };
    const int size = gradient_size(model(), over);
    const int states = q.batch < 0 ? 1 : q.batch;
    if (precision != Precision::double_ || !gradients_.worth(model(), over, states)) return run(precision, {q}, size, out, compute);
    const ModelInUse use(model());
    check_given(model(), {q});
    const std::vector<int> left = gradients_.run(model(), over, q.data, states, out);
    each<double>(0, static_cast<int>(left.size()), 1, [&](Sensitivities<double>& w, int i) {
      naming_state(left[i], states, [&] {
        const double* const in[] = {q.at(left[i])};
        double* const y = out + size_t(left[i]) * size;
        compute(w, in, y);
        require_finite(y, size, model());
      });
    });
  }

  // C, (nv, nv) a state: Hφ(MJ̇ + 𝓑J) or Christoffel's.
  void coriolis_matrix(bool skew, const Given& q, const Given& v, Precision precision, double* out) {
    if (precision == Precision::double_ && dynamics_.coriolis_matrix(skew, q, v, out)) return;
    run(precision, {q, v}, model().nv() * model().nv(), out, [&](auto& w, auto in, auto* y) { w.coriolis_matrix(in[0], in[1], skew, y); });
  }

  // ∂v̇/∂q, ∂v̇/∂v, ∂v̇/∂τ, (nv, nv) a state each.
  void forward_dynamics(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, const std::array<double*, 3>& out) {
    const ModelInUse use(model());
    check_given(model(), {q, v, tau});
    const int batch = common_batch({q, v, tau}), states = batch < 0 ? 1 : batch;
    const size_t square = size_t(model().nv()) * model().nv();
    const auto general = [&](int from, int to) {
      at_precision(precision, [&]<class S>(S) {
        if constexpr (!available_at<Sensitivities, S>) {
          throw EvaluationError(to_quad);
        } else {
          std::vector<S> y(3 * square);
          each<S>(from, to, states, [&](Sensitivities<S>& w, int b) {
            w.forward_dynamics(q.at(b), v.at(b), tau.at(b), how, y.data(), y.data() + square, y.data() + 2 * square);
            for (int i = 0; i < 3; ++i) {
              std::transform(y.begin() + i * square, y.begin() + (i + 1) * square, out[i] + b * square, [](const S& x) { return to_double(x); });
              require_finite(out[i] + b * square, square, model());
            }
          });
        }
      });
    };
    const bool plain = how.form == Form::fast && how.refinement.steps == 0;
    if (!plain || !dynamics_.by_links(precision, {.call = kernels::Call::forward_dynamics_derivatives, .q = q, .v = &v, .u = &tau, .others = &out[1]}, states, static_cast<int>(square), out[0], general)) general(0, states);
  }

 private:
  BatchDynamics dynamics_;
  PackedGradients gradients_;
};

}  // namespace pycraft
