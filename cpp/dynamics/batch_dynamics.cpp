#include "dynamics/batch_dynamics.h"

#include <algorithm>
#include <cmath>

namespace pycraft {

namespace {

template <class S>
using Wrenches = std::vector<Vector6<S>>;

// What kernels do: at regular states what becomes of singular ones does not matter.
bool plain(const Solving& how) { return how.form == Form::fast && how.refinement.steps == 0; }
// Whether what is refined is what kernels give.
bool refines_regular(const Solving& how) { return how.refinement.steps != 0 && how.on_singular == OnSingular::raise; }
// Whether they refine it themselves.
bool refined_by_links(const Solving& how) { return refines_regular(how) && !how.refinement.wider(); }
LinkCall refined(LinkCall asked, const Solving& how) {
  asked.call = forward_dynamics_call(how.form, how.refinement);
  asked.steps = how.refinement.steps == Refinement::automatic ? most_corrections : how.refinement.steps;
  return asked;
}

}  // namespace

BatchDynamics::Starts BatchDynamics::refined_from(Precision precision, const LinkCall& asked, int from, int to, int size, const Solving& how) {
  Starts starts;
  if (!refines_regular(how) || (precision != Precision::single && precision != Precision::double_)) return starts;  // doubles would cut wider values short
  const int states = to - from;
  starts.first = from, starts.size = size;
  starts.values.resize(size_t(states) * size), starts.there.assign(states, 1);
  const auto rest = [from](const Given& all) { return Given{all.name, all.at(from), all.width, all.batch}; };
  const Given q = rest(asked.q), v = asked.v ? rest(*asked.v) : Given{}, u = asked.u ? rest(*asked.u) : Given{};
  const LinkCall plain{asked.call, q, asked.v ? &v : nullptr, asked.u ? &u : nullptr, asked.applied};
  const bool done = by_links(precision, plain, states, size, starts.values.data(),
                             [&](int from, int to) { std::fill(starts.there.begin() + from, starts.there.begin() + to, 0); });
  if (!done) starts.there.clear();
  return starts;
}

template <class General>
void BatchDynamics::plainly(Precision precision, const LinkCall& asked, Givens given, int size, double* out, General general) {
  const ModelInUse use(model());
  check_given(model(), given);
  const int batch = common_batch(given);
  bool doubt = false;
  const bool done = by_links(precision, asked, batch < 0 ? 1 : batch, size, out, [&](int, int) { doubt = true; });
  if (!done || doubt) general();
}

// At wider precisions, refined by wider residuals, or where kernels were in doubt.
template <class S>
void BatchDynamics::forward_dynamics_at(const Given& q, const Given& v, const Given& tau, int from, int to, int states, const Solving& how,
                                        const Starts& starts, double* vdot, const Applied<double>* applied) {
  const int nv = model().nv();
  std::vector<S> own(std::is_same_v<S, double> ? 0 : nv);
  const auto one_by_one = [&](int from, int to) {
    each<S>(from, to, states, [&](RigidDynamics<S>& w, int b) {
      double* out = vdot + size_t(b) * nv;
      const Solving of_state = starts.of(b, how);
      if constexpr (std::is_same_v<S, double>) {
        w.forward_dynamics(q.at(b), v.at(b), tau.at(b), out, of_state, applied);
      } else {
        w.forward_dynamics(q.at(b), v.at(b), tau.at(b), own.data(), of_state, applied);
        for (int j = 0; j < nv; ++j) out[j] = to_double(own[j]);
      }
      require_finite(out, nv, model());
    });
  };
  int b = from;
  if constexpr (std::is_same_v<S, double> || std::is_same_v<S, Single>) {
    constexpr int width = PackedDynamics<S>::width;
    if (to - from >= width && how.form != Form::square_root && how.refinement.steps == 0 && how.on_singular == OnSingular::raise)
      std::get<WorkspacePool<PackedDynamics<S>>>(packs_).with(model(), [&](PackedDynamics<S>& w) {
        const auto stride = [](const Given& g) { return g.batch < 0 ? size_t(0) : size_t(g.width); };
        for (; b + width <= to; b += width) {
          double* to_b = vdot + size_t(b) * nv;
          if (!w.forward_dynamics(q.at(b), stride(q), v.at(b), stride(v), tau.at(b), stride(tau), to_b, how.form, applied) || !all_finite(to_b, size_t(width) * nv))
            one_by_one(b, b + width);
          if (b % 1024 == 0) check_interrupt();
        }
      });
  }
  one_by_one(b, to);
}

void BatchDynamics::forward_dynamics(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* vdot,
                                     const Applied<double>* applied, int threads) {
  const ModelInUse use(model());
  check_given(model(), {q, v, tau});
  const int batch = common_batch({q, v, tau}), states = batch < 0 ? 1 : batch;
  const LinkCall asked{.call = forward_dynamics_call(how.form), .q = q, .v = &v, .u = &tau, .applied = applied, .threads = threads};
  const auto general = [&](int from, int to) {
    const Starts starts = refined_from(precision, asked, from, to, model().nv(), how);
    at_precision(precision, [&]<class S>(S) { forward_dynamics_at<S>(q, v, tau, from, to, states, how, starts, vdot, applied); });
  };
  const LinkCall whole = refined_by_links(how) ? refined(asked, how) : asked;
  if (!(how.refinement.steps == 0 || refined_by_links(how)) || !by_links(precision, whole, states, model().nv(), vdot, general)) general(0, states);
}

RefinementReport BatchDynamics::refinement(const Given& q, const Given& v, const Given& tau, const Solving& how, Precision precision, double* vdot) {
  if (common_batch({q, v, tau}) >= 0) throw ModelError("the corrections of a refinement are those of one state; a batch has as many as states");
  const ModelInUse use(model());
  check_given(model(), {q, v, tau});
  RefinementReport report;
  if (how.refinement.steps == 0) {
    forward_dynamics(q, v, tau, how, precision, vdot);
    return report;
  }
  const LinkCall asked{forward_dynamics_call(how.form), q, &v, &tau};
  const Starts starts = refined_from(precision, asked, 0, 1, model().nv(), how);
  Solving estimated = starts.of(0, how);
  estimated.estimate = true;
  at_precision(precision, [&]<class S>(S) {
    std::vector<S> own(model().nv());
    each<S>(0, 1, 1, [&](RigidDynamics<S>& w, int) {
      w.forward_dynamics(q.data, v.data, tau.data, own.data(), estimated);
      report = {w.corrections(), w.estimated_error()};
    });
    for (size_t j = 0; j < own.size(); ++j) vdot[j] = to_double(own[j]);
    require_finite(vdot, own.size(), model());
  });
  if (!refined_by_links(how)) return report;
  // What a call gives: as far off as this at most, and by how much they differ.
  std::vector<double> called(model().nv());
  bool sure = true;
  if (!by_links(precision, refined(asked, how), 1, model().nv(), called.data(), [&](int, int) { sure = false; }) || !sure) return report;
  double apart = 0, length = 0;
  for (size_t j = 0; j < called.size(); ++j) apart = std::hypot(apart, called[j] - vdot[j]), length = std::hypot(length, vdot[j]);
  if (apart > 0) report.estimated_error += apart / length;
  std::copy(called.begin(), called.end(), vdot);
  return report;
}

void BatchDynamics::inverse_dynamics(const Given& q, const Given& v, const Given* vdot, Precision precision, double* tau, const Applied<double>* applied, int threads) {
  const bool moving = vdot;
  const Given given[] = {q, v, moving ? *vdot : Given{}};
  const Givens all(given, moving ? 3 : 2);
  plainly(precision, {.call = kernels::Call::inverse_dynamics, .q = q, .v = &v, .u = vdot, .applied = applied, .threads = threads}, all, model().nv(), tau, [&] {
    PerScalar<Wrenches> wrenches;
    run(precision, all, model().nv(), tau, [&](auto& w, auto in, auto* y) {
      using S = std::remove_pointer_t<decltype(y)>;
      const S* accelerations = moving ? in[2] : nullptr;
      if (!applied) return w.inverse_dynamics(in[0], in[1], accelerations, y);
      const Applied<S> own = converted(*applied, model().bodies(), std::get<Wrenches<S>>(wrenches));
      w.inverse_dynamics(in[0], in[1], accelerations, y, &own);
    });
  });
}

void BatchDynamics::mass_matrix(const Given& q, Precision precision, double* out) {
  const int size = model().nv() * model().nv();
  plainly(precision, {kernels::Call::mass_matrix, q}, {q}, size, out,
          [&] { run(precision, {q}, size, out, [](auto& w, auto in, auto* y) { w.mass_matrix(in[0], y); }); });
}

void BatchDynamics::mass_matrix_inverse(const Given& q, const Solving& how, Precision precision, double* out) {
  const ModelInUse use(model());
  check_given(model(), {q});
  const size_t size = size_t(model().nv()) * model().nv();
  const int states = q.batch < 0 ? 1 : q.batch;
  const LinkCall asked{kernels::Call::mass_matrix_inverse, q};
  const auto general = [&](int from, int to) {
    const Starts starts = how.form == Form::fast ? refined_from(precision, asked, from, to, static_cast<int>(size), how) : Starts{};
    at_precision(precision, [&]<class S>(S) {
      std::vector<S> inverse(size);
      each<S>(from, to, states, [&](RigidDynamics<S>& w, int b) {
        w.mass_matrix_inverse(q.at(b), inverse.data(), starts.of(b, how));
        for (size_t i = 0; i < size; ++i) out[b * size + i] = to_double(inverse[i]);
        require_finite(out + b * size, size, model());
      });
    });
  };
  if (!plain(how) || !by_links(precision, asked, states, static_cast<int>(size), out, general)) general(0, states);
}

bool BatchDynamics::surely(const LinkCall& asked, Givens given, int size, double* out) {
  bool done = true;
  const auto general = [&] { done = false; };
  plainly(Precision::double_, asked, given, size, out, general);
  return done;
}

bool BatchDynamics::derivatives(kernels::Call call, const Given& q, const Given& v, const Given& u, const std::array<double*, 3>& out) {
  return surely({.call = call, .q = q, .v = &v, .u = &u, .others = &out[1]}, {q, v, u}, model().nv() * model().nv(), out[0]);
}

bool BatchDynamics::coriolis_matrix(bool skew, const Given& q, const Given& v, double* out) {
  const kernels::Call call = skew ? kernels::Call::skew_coriolis_matrix : kernels::Call::coriolis_matrix;
  return surely({.call = call, .q = q, .v = &v}, {q, v}, model().nv() * model().nv(), out);
}

bool BatchDynamics::operational_space(bool inverse, std::span<const Node> nodes, const Given& q, double* out) {
  if (nodes.empty() || std::any_of(nodes.begin(), nodes.end(), [](const Node& node) { return node.body < 0; })) return false;
  const kernels::Call call = inverse ? kernels::Call::operational_space_inertia : kernels::Call::operational_space_compliance;
  const int rows = 6 * static_cast<int>(nodes.size());
  return surely({.call = call, .q = q, .node = nodes.data(), .nodes = static_cast<int>(nodes.size())}, {q}, rows * rows, out);
}

void BatchDynamics::jacobian(const Node& node, const Given& q, Precision precision, double* out) {
  const int size = 6 * model().nv();
  plainly(precision, {.call = kernels::Call::jacobian, .q = q, .node = &node}, {q}, size, out,
          [&] { run(precision, {q}, size, out, [&](auto& w, auto in, auto* y) { w.jacobian(node, in[0], y); }); });
}

void BatchDynamics::pose(const Node& node, const Given& q, double* out) {
  plainly(Precision::double_, {.call = kernels::Call::pose, .q = q, .node = &node}, {q}, 16, out, [&] {
    run(Precision::double_, {q}, 16, out, [&](auto& w, auto in, auto* y) {
      const auto X = w.pose(node, in[0]);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) y[4 * i + j] = X.R(i, j);
        y[4 * i + 3] = X.p[i];
        y[12 + i] = 0;
      }
      y[15] = 1;
    });
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
