#include "dynamics/batch_dynamics.h"

namespace pycraft {

namespace {

template <class S>
using Wrenches = std::vector<Vector6<S>>;

}  // namespace

template <class S>
void BatchDynamics::forward_dynamics_at(const Given& q, const Given& v, const Given& tau, int states, const Solving& how, double* vdot,
                                        const Applied<double>* applied) {
  const int nv = model().nv();
  std::vector<S> own(std::is_same_v<S, double> ? 0 : nv);
  const auto one_by_one = [&](int from, int to) {
    each<S>(from, to, states, [&](RigidDynamics<S>& w, int b) {
      double* out = vdot + size_t(b) * nv;
      if constexpr (std::is_same_v<S, double>) {
        w.forward_dynamics(q.at(b), v.at(b), tau.at(b), out, how, applied);
      } else {
        w.forward_dynamics(q.at(b), v.at(b), tau.at(b), own.data(), how, applied);
        for (int j = 0; j < nv; ++j) out[j] = to_double(own[j]);
      }
      require_finite(out, nv, model());
    });
  };
  int b = 0;
  if constexpr (std::is_same_v<S, double> || std::is_same_v<S, Single>) {
    constexpr int width = PackedDynamics<S>::width;
    if (states >= width && how.form != Form::square_root && how.refinement.steps == 0 && how.on_singular == OnSingular::raise)
      std::get<WorkspacePool<PackedDynamics<S>>>(packs_).with(model(), [&](PackedDynamics<S>& w) {
        const auto stride = [](const Given& g) { return g.batch < 0 ? size_t(0) : size_t(g.width); };
        for (; b + width <= states; b += width) {
          double* to = vdot + size_t(b) * nv;
          if (!w.forward_dynamics(q.at(b), stride(q), v.at(b), stride(v), tau.at(b), stride(tau), to, how.form, applied) || !all_finite(to, size_t(width) * nv))
            one_by_one(b, b + width);
          if (b % 1024 == 0) check_interrupt();
        }
      });
  }
  one_by_one(b, states);
}

void BatchDynamics::forward_dynamics(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* vdot,
                                     const Applied<double>* applied) {
  const ModelInUse use(model());
  check_given(model(), {q, v, tau});
  const int batch = common_batch({q, v, tau});
  at_precision(precision, [&]<class S>(S) { forward_dynamics_at<S>(q, v, tau, batch < 0 ? 1 : batch, how, vdot, applied); });
}

RefinementReport BatchDynamics::refinement(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* vdot) {
  if (common_batch({q, v, tau}) >= 0) throw ModelError("the corrections of a refinement are those of one state; a batch has as many as states");
  const ModelInUse use(model());
  check_given(model(), {q, v, tau});
  Solving estimated = how;
  estimated.estimate = true;
  RefinementReport report;
  at_precision(precision, [&]<class S>(S) {
    std::vector<S> own(model().nv());
    each<S>(0, 1, 1, [&](RigidDynamics<S>& w, int) {
      w.forward_dynamics(q.data, v.data, tau.data, own.data(), estimated);
      report = {w.corrections(), w.estimated_error()};
    });
    for (size_t j = 0; j < own.size(); ++j) vdot[j] = to_double(own[j]);
    require_finite(vdot, own.size(), model());
  });
  return report;
}

void BatchDynamics::inverse_dynamics(const Given& q, const Given& v, const Given* vdot, Precision precision, double* tau, const Applied<double>* applied) {
  const bool moving = vdot;
  const Given given[] = {q, v, moving ? *vdot : Given{}};
  PerScalar<Wrenches> wrenches;
  run(precision, Givens(given, moving ? 3 : 2), model().nv(), tau, [&](auto& w, auto in, auto* y) {
    using S = std::remove_pointer_t<decltype(y)>;
    const S* accelerations = moving ? in[2] : nullptr;
    if (!applied) return w.inverse_dynamics(in[0], in[1], accelerations, y);
    const Applied<S> own = converted(*applied, model().bodies(), std::get<Wrenches<S>>(wrenches));
    w.inverse_dynamics(in[0], in[1], accelerations, y, &own);
  });
}

void BatchDynamics::mass_matrix(const Given& q, Precision precision, double* out) {
  run(precision, {q}, model().nv() * model().nv(), out, [](auto& w, auto in, auto* y) { w.mass_matrix(in[0], y); });
}

void BatchDynamics::mass_matrix_inverse(const Given& q, const Solving& how, Precision precision, double* out) {
  const ModelInUse use(model());
  check_given(model(), {q});
  const size_t size = size_t(model().nv()) * model().nv();
  const int states = q.batch < 0 ? 1 : q.batch;
  at_precision(precision, [&]<class S>(S) {
    std::vector<S> inverse(size);
    each<S>(0, states, states, [&](RigidDynamics<S>& w, int b) {
      w.mass_matrix_inverse(q.at(b), inverse.data(), how);
      for (size_t i = 0; i < size; ++i) out[b * size + i] = to_double(inverse[i]);
      require_finite(out + b * size, size, model());
    });
  });
}

void BatchDynamics::jacobian(const Node& node, const Given& q, Precision precision, double* out) {
  run(precision, {q}, 6 * model().nv(), out, [&](auto& w, auto in, auto* y) { w.jacobian(node, in[0], y); });
}

void BatchDynamics::pose(const Node& node, const Given& q, double* out) {
  run(Precision::double_, {q}, 16, out, [&](auto& w, auto in, auto* y) {
    const auto X = w.pose(node, in[0]);
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) y[4 * i + j] = X.R(i, j);
      y[4 * i + 3] = X.p[i];
      y[12 + i] = 0;
    }
    y[15] = 1;
  });
}

void BatchDynamics::energy(const Given& q, const Given& v, const Vector3<double>& datum, double* out) {
  run(Precision::double_, {q, v}, 2, out, [&](auto& w, auto in, auto* y) {
    using S = std::remove_pointer_t<decltype(y)>;
    y[0] = w.kinetic_energy(in[0], in[1]);
    y[1] = w.potential_energy(in[0], cast<S>(datum));
  });
}

}  // namespace pycraft
