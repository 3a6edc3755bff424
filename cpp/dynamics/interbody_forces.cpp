#include "dynamics/interbody_forces.h"

#include <algorithm>
#include <cmath>

#include "model/configuration.h"
#include "model/unit_data.h"
#include "numerics/recorded.h"
#include "recursions/kinematics.h"
#include "recursions/newton_euler.h"
#include "runtime/of_state.h"

namespace pycraft {

namespace {

using Along = Tangent<double, 4>;
constexpr int width = 4;

template <class S>
Vector6<S> six(const S* w) {
  return {{w[0], w[1], w[2]}, {w[3], w[4], w[5]}};
}

// The largest part of a unit row that may be rounding once the rows before it are taken off: six products of rounded numbers.
template <class S>
S dependent() {
  return S(64) * epsilon<S>();
}

}  // namespace

template <class S>
InterbodyForces<S>::InterbodyForces(const SkoStructure& tree, std::shared_ptr<const CompiledModel<S>> model)
    : model_(std::move(model)), blocks_(tree), world_(model_->bodies), alpha_(model_->bodies), force_(model_->bodies), wrench_(model_->bodies), generalized_(model_->nv) {}

template <class S>
void InterbodyForces<S>::place(const S* q) {
  kinematics(*model_, q, blocks_);
  for (int k = 0; k < model_->bodies; ++k) world_[k] = model_->parent[k] < 0 ? blocks_.pose[k] : world_[model_->parent[k]] * blocks_.pose[k];
}

template <class S>
const Vector6<S>* InterbodyForces<S>::on_bodies(const PushedNodes& pushed, const S* wrenches) {
  std::fill(wrench_.begin(), wrench_.end(), Vector6<S>::zero());
  for (const Node& node : pushed.nodes) {
    Vector6<S> w = six(wrenches);
    wrenches += 6;
    Pose<S> at = renormalised<S>(node.pose);
    if (pushed.in_world) at.R = transpose(world_[node.body].R);  // from the world's axes to the body's, about the node
    wrench_[node.body] = wrench_[node.body] + force_to_parent(at, w);
  }
  return wrench_.data();
}

template <class S>
void InterbodyForces<S>::find(const S* v, const S* vdot, const Applied<S>& applied) {
  point_accelerations_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v, OwnTerms::kept, points_);
  newton_euler(*model_, blocks_, points_, applied, vdot, generalized_.data(), alpha_, force_);
}

// By Gram and Schmidt, each row twice: what is left of a row that depends on those before is rounding, and no direction.
template <class S>
Vector6<S> InterbodyForces<S>::reaction(int k) const {
  using std::sqrt;
  std::vector<Vector6<S>> unit;
  Vector6<S> left = force_[k];
  for (int j = model_->v_offset[k]; j < model_->v_offset[k] + model_->nv_of[k]; ++j) {
    Vector6<S> row = (S(1) / sqrt(dot(blocks_.H[j], blocks_.H[j]))) * blocks_.H[j];
    for (int time = 0; time < 2; ++time)
      for (const Vector6<S>& u : unit) row = row - dot(u, row) * u;
    const S length = sqrt(dot(row, row));
    if (length > dependent<S>()) unit.push_back((S(1) / length) * row);
  }
  for (int time = 0; time < 2; ++time)
    for (const Vector6<S>& u : unit) left = left - dot(u, left) * u;
  return left;
}

int BatchInterbodyForces::Asked::states() const {
  const int batch = common_batch({q, v, input, wrenches});
  return batch < 0 ? 1 : batch;
}

void check_wrenches(const PushedNodes* pushed, const Given& wrenches) {
  for (int b = 0; b < (wrenches.batch < 0 ? 1 : wrenches.batch); ++b)
    checking_state(b, wrenches.batch, [&] {
      for (int i = 0; i < wrenches.width; ++i)
        if (!std::isfinite(wrenches.at(b)[i])) throw ModelError("the wrench on '" + pushed->nodes[i / 6].name + "' has an entry that is not finite");
    });
}

void BatchInterbodyForces::check(const Asked& asked) const {
  check_given(model(), {asked.q, asked.v, asked.input});
  check_wrenches(asked.pushed, asked.wrenches);
}

void BatchInterbodyForces::run(const Asked& asked, const Results& out) {
  const ModelInUse use(model());
  check(asked);
  const int states = asked.states(), N = model().bodies(), nv = model().nv();
  at_precision(asked.precision, [&]<class S>(S) {
    if constexpr (!available_at<InterbodyWorkspace, S>)
      throw EvaluationError(to_quad);
    else
      each<S>(0, states, states, [&](InterbodyWorkspace<S>& w, int b) {
        const auto read = [b](const Given& given, std::vector<S>& to) { to.assign(given.at(b), given.at(b) + given.width); };
        read(asked.q, w.q), read(asked.v, w.v), read(asked.input, w.input), read(asked.wrenches, w.wrenches);
        w.forces.place(w.q.data());
        Applied<S> applied = own_gravity(w.forces.model());
        if (asked.wrenches.width > 0) applied.wrenches = w.forces.on_bodies(*asked.pushed, w.wrenches.data());
        w.vdot = w.input;
        if (!asked.moving) {
          if (!w.dynamics) w.dynamics = std::make_unique<RigidDynamics<S>>(model());
          std::vector<Vector6<double>> pushed;
          if constexpr (std::is_same_v<S, Single>) {  // its states are doubles
            const Applied<double> same = converted(applied, N, pushed);
            w.dynamics->forward_dynamics(asked.q.at(b), asked.v.at(b), asked.input.at(b), w.vdot.data(), asked.how, &same);
          } else {
            w.dynamics->forward_dynamics(w.q.data(), w.v.data(), w.input.data(), w.vdot.data(), asked.how, &applied);
          }
        }
        w.forces.find(w.v.data(), w.vdot.data(), applied);
        for (int k = 0; k < N; ++k) {
          write(asked.reaction ? w.forces.reaction(k) : w.forces.forces()[k], out.forces + (size_t(b) * N + k) * 6);
          write(w.forces.poses()[k], out.poses + (size_t(b) * N + k) * 16);
        }
        require_finite(out.forces + size_t(b) * N * 6, size_t(N) * 6, model());
        for (int j = 0; j < nv; ++j) {
          out.generalized[size_t(b) * nv + j] = to_double(w.forces.generalized()[j]);
          out.vdot[size_t(b) * nv + j] = to_double(w.vdot[j]);
        }
      });
  });
}

void BatchInterbodyForces::derivatives(const Asked& asked, const std::array<double*, 3>& forces, const std::array<double*, 3>& generalized) {
  const ModelInUse use(model());
  check(asked);
  const int states = asked.states(), N = model().bodies(), nv = model().nv(), nq = model().nq();
  const auto values = model().compiled<double>();
  InterbodyForces<Along> on(model().structure(), std::make_shared<const CompiledModel<Along>>(broadcast<Along>(*values)));
  std::vector<Along> q, v, vdot, wrenches;
  std::vector<double> direction(nv), rate(nq);
  const int kinds = forces[1] ? 3 : 1;
  const auto one = [&](int b) {
    for (int first = 0; first < kinds * nv; first += width) {
      const int count = std::min(width, kinds * nv - first);
      const auto read = [b](const Given& given, std::vector<Along>& to) { to.assign(given.at(b), given.at(b) + given.width); };
      read(asked.q, q), read(asked.v, v), read(asked.input, vdot), read(asked.wrenches, wrenches);
      for (int i = 0; i < count; ++i) {
        const int kind = (first + i) / nv, j = (first + i) % nv;
        if (kind > 0) {
          (kind == 1 ? v : vdot)[j].d[i] = 1;
          continue;
        }
        std::fill(direction.begin(), direction.end(), 0.0);
        direction[j] = 1;
        configuration_rate(*values, asked.q.at(b), direction.data(), rate.data());
        for (int m = 0; m < nq; ++m) q[m].d[i] = rate[m];
      }
      on.place(q.data());
      Applied<Along> applied = own_gravity(on.model());
      if (asked.wrenches.width > 0) applied.wrenches = on.on_bodies(*asked.pushed, wrenches.data());
      on.find(v.data(), vdot.data(), applied);
      for (int i = 0; i < count; ++i) {
        const int kind = (first + i) / nv, j = (first + i) % nv;
        for (int k = 0; k < N; ++k) {
          const Vector6<Along> f = on.forces()[k];
          for (int c = 0; c < 6; ++c) forces[kind][((size_t(b) * N + k) * 6 + c) * nv + j] = f[c].d[i];
        }
        for (int l = 0; l < nv; ++l) generalized[kind][(size_t(b) * nv + l) * nv + j] = on.generalized()[l].d[i];
      }
    }
    for (int kind = 0; kind < kinds; ++kind) require_finite(forces[kind] + size_t(b) * N * 6 * nv, size_t(N) * 6 * nv, model());
  };
  for (int b = 0; b < states; ++b) naming_state(b, states, [&] { one(b); });
}

template class InterbodyForces<Single>;
template class InterbodyForces<double>;
template class InterbodyForces<Extended>;
template class InterbodyForces<Quad>;
template class InterbodyForces<Recorded>;
template class InterbodyForces<Tangent<double, 4>>;

}  // namespace pycraft
