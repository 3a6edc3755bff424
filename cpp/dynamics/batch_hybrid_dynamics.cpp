#include "dynamics/batch_hybrid_dynamics.h"

#include <algorithm>

namespace pycraft {

namespace {

void check_subhinges(const Multibody& model, const std::vector<char>& prescribed) {
  if (static_cast<int>(prescribed.size()) != model.nv())
    throw ModelError("'" + model.name() + "' has " + std::to_string(model.nv()) + " coordinates; which of them are prescribed was said of " + std::to_string(prescribed.size()));
  int j = 0;
  for (int k = 0; k < model.bodies(); ++k)
    for (const Subhinge& subhinge : model.body(k).hinge.subhinges) {
      const auto first = prescribed.begin() + j, last = first + subhinge.nv();
      if (std::count(first, last, prescribed[j]) != subhinge.nv())
        throw ModelError("hinge '" + model.body(k).hinge.name + "' moves by a " + record_of(subhinge.kind).name + " subhinge, whose coordinates are prescribed together: name the hinge");
      j += subhinge.nv();
    }
}

}  // namespace

BatchHybridDynamics::BatchHybridDynamics(std::shared_ptr<Multibody> model, std::vector<char> prescribed) : whole_(std::move(model)) {
  check_subhinges(this->model(), prescribed);
  for (int j = 0; j < this->model().nv(); ++j)
    if (!prescribed[j]) free_.push_back(j);
  terms_.prescribed = std::move(prescribed);
}

void BatchHybridDynamics::run(const Given& q, const Given& v, const Given& tau, const Given& vdot, const Solving& how, Precision precision, double* accelerations,
                              double* forces, int threads) {
  const ModelInUse use(model());
  check_given(model(), {q, v, tau, vdot});
  const int batch = common_batch({q, v, tau, vdot}), states = batch < 0 ? 1 : batch, nv = model().nv();
  const size_t numbers = size_t(states) * nv;
  // A call with arguments of one state alone is asked as often as there are states.
  std::vector<double> rows;
  const auto whole_batch = [&](const Given& all) {
    if (batch < 0 || all.batch >= 0) return all;
    rows.clear();
    for (int b = 0; b < states; ++b) rows.insert(rows.end(), all.data, all.data + all.width);
    return Given{all.name, rows.data(), all.width, states};
  };
  const auto copy = [&](const Given& from, double* to) {
    for (int b = 0; b < states; ++b) std::copy_n(from.at(b), nv, to + size_t(b) * nv);
  };
  if (free_.size() == size_t(nv)) {
    whole_.forward_dynamics(whole_batch(q), v, tau, how, precision, accelerations, nullptr, threads);
    return copy(tau, forces);
  }
  const bool digits = precision == Precision::digits50 || precision == Precision::digits100;  // which inverse dynamics has not
  if (free_.empty() && !digits) {
    const Given of_all = whole_batch(q);
    whole_.inverse_dynamics(of_all, v, &vdot, precision, forces, nullptr, threads);
    return copy(vdot, accelerations);
  }
  constexpr size_t few = 64;
  double of_few[2 * few];
  std::vector<double> of_many(numbers > few ? 2 * numbers : 0);
  double *const u = numbers > few ? of_many.data() : of_few, *const out = u + numbers;
  for (int b = 0; b < states; ++b)
    for (int j = 0; j < nv; ++j) u[size_t(b) * nv + j] = (terms_.is_prescribed(j) ? vdot : tau).at(b)[j];
  mixed(q, v, {"u", u, nv, batch}, states, how, precision, out);
  for (int b = 0; b < states; ++b)
    for (int j = 0; j < nv; ++j) {
      const size_t at = size_t(b) * nv + j;
      accelerations[at] = terms_.is_prescribed(j) ? u[at] : out[at];
      forces[at] = terms_.is_prescribed(j) ? out[at] : u[at];
    }
}

bool BatchHybridDynamics::by_links(const Given& q, const Given& v, const Given& u, int states, Precision precision, double* out, Runs& doubted) {
  bool done = false;
  const LinkCall asked{.call = kernels::Call::forward_dynamics, .q = q, .v = &v, .u = &u};
  const auto run = [&]<class S>(S) {
    std::get<WorkspacePool<LinkDynamics<S>>>(links_).with(
        model(),
        [&](LinkDynamics<S>& w) {
          done = w.there(asked.call);
          if (done) w.run(asked, states, model().nv(), out, [&](int from, int to) { doubted.emplace_back(from, to); });
        },
        [&] { return LinkDynamics<S>(model(), terms_); });
  };
  if (precision == Precision::double_) run(double());
  if (precision == Precision::single) run(Single());
  if (precision == Precision::extended) run(Extended());
  if (precision == Precision::quad) run(Quad());
  return done;
}

template <class S>
void BatchHybridDynamics::generally(const Given& q, const Given& v, const Given& u, int b, int states, const Solving& how, double* out) {
  const int nv = model().nv();
  std::get<DynamicsPool<S>>(general_).with(
      model(),
      [&](RigidDynamics<S>& w) {
        naming_state(b, states, [&] {
          std::vector<double> forces;
          std::vector<S> found(free_.size()), all(nv);
          for (int j : free_) forces.push_back(u.at(b)[j]);
          w.prescribe(u.at(b));
          w.forward_dynamics(q.at(b), v.at(b), forces.data(), found.data(), how);
          w.give_all(found.data(), all.data());
          for (int j = 0; j < nv; ++j) out[j] = to_double(all[j]);
          require_finite(out, nv, model());
        });
      },
      [&] { return RigidDynamics<S>(model(), terms_); });
}

void BatchHybridDynamics::mixed(const Given& q, const Given& v, const Given& u, int states, const Solving& how, Precision precision, double* out) {
  Runs left;  // of states, for the general recursions
  const bool plain = how.form == Form::fast && how.refinement.steps == 0;
  if (!plain || !by_links(q, v, u, states, precision, out, left)) left.assign(1, {0, states});
  at_precision(precision, [&]<class S>(S) {
    for (const auto& [from, to] : left)
      for (int b = from; b < to; ++b) {
        generally<S>(q, v, u, b, states, how, out + size_t(b) * model().nv());
        if (b % 16 == 15) check_interrupt();
      }
  });
}

}  // namespace pycraft
