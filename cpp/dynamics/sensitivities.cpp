#include "dynamics/sensitivities.h"

#include <algorithm>

#include "algebra/trees/sweeps/articulated_inertia.h"
#include "dynamics/parameter_sensitivities.h"
#include "model/unit_data.h"
#include "recursions/kinematics.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

template <class S>
Vector6<S> uniform(const Vector3<S>& linear) {
  return {Vector3<S>::zero(), linear};
}

}  // namespace

template <class S>
Sensitivities<S>::Sensitivities(const Multibody& model)
    : source_(model), tree_(model.structure()), model_(model.compiled<S>()), blocks_(tree_), frame_(*model_), outboard_(model_->nv), alpha_(model_->bodies),
      force_(model_->bodies) {}

template <class S>
void Sensitivities<S>::frame_at(const S* q, const S* v, const S* vdot, const Vector3<S>* gravity) {
  kinematics(*model_, q, blocks_);
  frame_.fill(*model_, blocks_, gravity ? *gravity : model_->gravity, v, vdot);
}

template <class S>
void Sensitivities<S>::twists_about(int body) {
  Vector3<S> l = Vector3<S>::zero();
  for (int a = body; a >= 0; a = model_->parent[a]) {
    for (int i = model_->v_offset[a]; i < model_->v_offset[a] + model_->nv_of[a]; ++i) outboard_[i] = motion_outboard(l, frame_.twist[i]);
    l = l + frame_.arm[a];
  }
}

template <class S>
void Sensitivities<S>::inverse_dynamics(const S* q, const S* v, const S* vdot, S* dq, S* dv, const Vector3<S>* gravity) {
  frame_at(q, v, vdot, gravity);
  differentiate_forces(dq, dv, model_->nv);
  differentiate_rotors(v, dv, model_->nv);
}

template <class S>
void Sensitivities<S>::differentiate_forces(S* dq, S* dv, int stride) {
  const CompiledModel<S>& m = *model_;
  const int N = m.nv;
  for (int k = 0; k < N; ++k) std::fill_n(dq + size_t(k) * stride, N, S(0)), std::fill_n(dv + size_t(k) * stride, N, S(0));
  for (int k = 0; k < N; ++k) {
    const int c = frame_.body_of[k];
    check_interrupt_at(k, c);
    const RigidInertia<S>& R = frame_.R[c];
    const MomentumRate<S>& B = frame_.B[c];
    const Vector6<S>& s = frame_.twist[k];
    Vector6<S> along_v = R * (frame_.twist_rate[k] + frame_.psi_dot[k]) + B * s;
    Vector6<S> along_q = R * frame_.psi_ddot[k] + B * frame_.psi_dot[k] + cross_force(s, frame_.force[c]);
    Vector6<S> Rs = R * s;  // with Bs, row k of what is inboard of it
    const Vector3<S> Bs = couple(B, s);
    for (int a = c; a >= 0; a = m.parent[a]) {
      for (int i = m.v_offset[a]; i < m.v_offset[a] + m.nv_of[a]; ++i) {
        dv[size_t(i) * stride + k] = dot(frame_.twist[i], along_v);
        dv[size_t(k) * stride + i] = dot(Rs, frame_.twist_rate[i] + frame_.psi_dot[i]) + dot(Bs, frame_.twist[i].angular);
        const S outboard = dot(Rs, frame_.psi_ddot[i]) + dot(Bs, frame_.psi_dot[i].angular);  // row k, moved by i at or inboard of it
        if (frame_.inboard(i, k)) {
          dq[size_t(i) * stride + k] = dot(frame_.twist[i], along_q);
          dq[size_t(k) * stride + i] = outboard;
        } else if (frame_.subhinge_of[i] == frame_.subhinge_of[k]) {
          dq[size_t(k) * stride + i] = outboard;
        }
      }
      for (Vector6<S>* f : {&along_v, &along_q, &Rs}) *f = force_inboard(frame_.arm[a], *f);
    }
  }
}

template <class S>
void Sensitivities<S>::differentiate_rotors(const S* v, S* dv, int stride) const {
  const CompiledModel<S>& m = *model_;
  for (int k = 0; k < m.bodies && m.has_rotor_inertia && v; ++k)
    each_rotor_force_rate(m, k, m.rotor_inertia.data(), v, [&](int i, int j, const S& rate) { dv[size_t(i) * stride + j] += rate; });
}

template <class S>
void Sensitivities<S>::forward_dynamics(const double* q, const double* v, const double* tau, const Solving& how, S* dq, S* dv, S* dtau,
                                         const Vector3<double>* gravity) {
  const int N = model_->nv;
  const size_t square = size_t(N) * N;
  const Applied<double> weight{gravity ? *gravity : source_.gravity()};
  if (how.form != Form::fast && differentiate_sweep(q, v, tau, how, dq, dv, dtau, &weight)) return;
  if (!dynamics_) dynamics_ = std::make_unique<RigidDynamics<S>>(source_);
  convert(q, model_->nq, q_), convert(v, N, v_);
  rates_.resize(N), work_.resize(3 * square), solution_.resize(3 * square);
  dynamics_->forward_dynamics_of_points(q, v, tau, rates_.data(), how, &weight);
  kinematics(*model_, q_.data(), blocks_);
  point_accelerations_base_to_tip(*model_, blocks_.pose.data(), blocks_.H.data(), v_.data(), OwnTerms::absorbed, points_);
  for (int k = 0; k < model_->bodies; ++k)  // of what hinges absorb, the frame knows that of free roots
    for (int j = model_->v_offset[k]; j < model_->v_offset[k] + model_->nv_of[k] && !frame_.floats(*model_, k); ++j) rates_[j] -= points_.absorbed[j];
  frame_.fill(*model_, blocks_, cast<S>(weight.gravity), v_.data(), rates_.data(), OwnTerms::absorbed);
  // Columns: ∂T/∂q, ∂T/∂v, 1.
  differentiate_forces(work_.data(), work_.data() + N, 3 * N);
  differentiate_rotors(v_.data(), work_.data() + N, 3 * N);
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) work_[size_t(i) * 3 * N + 2 * N + j] = S(i == j ? 1 : 0);
  dynamics_->mass_matrix_solve(q, work_.data(), 3 * N, solution_.data(), how);
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) {
      const S *row = solution_.data() + size_t(i) * 3 * N, *column = solution_.data() + size_t(j) * 3 * N;
      dq[size_t(i) * N + j] = -row[j];
      dv[size_t(i) * N + j] = -row[N + j];
      dtau[size_t(i) * N + j] = S(0.5) * (row[2 * N + j] + column[2 * N + i]);
    }
  differentiate_absorbed(dv);
}

// What free roots absorb: x = ω × v of the linear coordinates.
template <class S>
void Sensitivities<S>::differentiate_absorbed(S* dv) {
  const int N = model_->nv;
  for (int k = 0; k < model_->bodies; ++k) {
    if (!frame_.floats(*model_, k)) continue;
    const int first = model_->v_offset[k];
    const S* v = v_.data() + first;
    const Matrix3<S> turning = skew(Vector3<S>{v[0], v[1], v[2]}), moving = skew(Vector3<S>{v[3], v[4], v[5]});
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        dv[size_t(first + 3 + i) * N + first + j] += moving(i, j);
        dv[size_t(first + 3 + i) * N + first + 3 + j] -= turning(i, j);
      }
  }
}

// By the derivative of the sweep itself, which keeps the digits of a factored form: of forces that are differentiated first, those of a heavy
// body would hide a light one's. It is the sweep of `ud` for both: reflections would pass over a row that is zero here and not beside it.
// Its own result is not refined; (ℳ + J)⁻¹ is, as asked.
template <class S>
bool Sensitivities<S>::differentiate_sweep(const double* q, const double* v, const double* tau, const Solving& how, S* dq, S* dv, S* dtau,
                                           const Applied<double>* applied) {
  if (!tangents_) tangents_ = std::make_unique<TangentDynamics<S>>(source_);
  if (!tangents_->forward_dynamics(q, v, tau, Form::ud, dq, dv, applied)) return false;
  if (!dynamics_) dynamics_ = std::make_unique<RigidDynamics<S>>(source_);
  dynamics_->mass_matrix_inverse(q, dtau, how);
  return true;
}

template <class S>
void Sensitivities<S>::mass_matrix(const S* q, S* out) {
  const CompiledModel<S>& m = *model_;
  const int N = m.nv;
  frame_at(q, nullptr, nullptr);
  std::fill_n(out, size_t(N) * N * N, S(0));
  const auto put = [&](int i, int j, int k, const S& value) {
    out[(size_t(i) * N + j) * N + k] = value;
    out[(size_t(j) * N + i) * N + k] = value;
  };
  // ℳ(i,j) = S_i* R S_j, R of the outboard one, about whose origin all is taken. What moves both along changes nothing.
  for (int b = 0; b < m.bodies; ++b) {
    const RigidInertia<S>& R = frame_.R[b];
    const int first = m.v_offset[b], last = first + m.nv_of[b];
    if (first < last) twists_about(b);
    for (int j = first; j < last; ++j) {
      check_interrupt_at(j, b);
      const Vector6<S> momentum = R * frame_.twist[j];
      // k between: R and S_j move, S_i stays
      on_path(m, b, [&](int k) {
        if (frame_.subhinge_of[k] > frame_.subhinge_of[j]) return;
        const Vector6<S> moved = cross_force(outboard_[k], momentum);
        on_path(m, frame_.body_of[k], [&](int i) {
          if (frame_.inboard(i, k)) put(i, j, k, dot(outboard_[i], moved));
        });
      });
    }
    // k outboard of both: R alone moves, by crf(S_k) R_k - R_k crm(S_k)
    for (int k = first; k < last; ++k) {
      check_interrupt_at(k, b);
      const Vector6<S>& s = frame_.twist[k];
      on_path(m, b, [&](int j) {
        if (!frame_.inboard(j, k)) return;
        const Vector6<S> moved = cross_force(s, R * outboard_[j]) - R * cross_motion(s, outboard_[j]);
        on_path(m, frame_.body_of[j], [&](int i) {
          if (frame_.inboard(i, k) && frame_.subhinge_of[i] <= frame_.subhinge_of[j]) put(i, j, k, dot(outboard_[i], moved));
        });
      });
    }
  }
}

// Of [X, Y] paired with Z, along coordinates a, b and c of one ball or free subhinge, in Koszul's formula.
template <class S>
void add_bracket(S* out, size_t n, int a, int b, int c, const S& pairing) {
  const S g = pairing / S(2);
  out[(size_t(c) * n + b) * n + a] += g;  // [X, Y], Z with X = a, Y = b
  out[(size_t(b) * n + c) * n + a] -= g;  // [X, Z], Y with X = a, Z = b
  out[(size_t(b) * n + a) * n + c] -= g;  // [Y, Z], X with Y = a, Z = b
}

// Rotors bring the same brackets, paired by J, which is of the subhinge's own coordinates alone.
template <class S>
void Sensitivities<S>::add_brackets_of_rotors(S* out) const {
  const CompiledModel<S>& m = *model_;
  for (int a = 0; a < m.nv; ++a)
    with_subhinge(m.subhinges[frame_.subhinge_of[a]].kind, [&](auto row) {
      if constexpr (row.nv > 1) {
        int first = a;
        while (first > 0 && frame_.subhinge_of[first - 1] == frame_.subhinge_of[a]) --first;
        S one[row.nv], other[row.nv], bracket[row.nv];
        std::fill_n(one, row.nv, S(0)), std::fill_n(other, row.nv, S(0));
        one[a - first] = S(1);
        for (int b = 0; b < row.nv; ++b) {
          other[b] = S(1);
          row.bracket(static_cast<const S*>(one), static_cast<const S*>(other), bracket);
          other[b] = S(0);
          for (int c = 0; c < row.nv; ++c) add_bracket(out, m.nv, a, first + b, first + c, S(m.rotor_inertia[first + c] * bracket[c]));
        }
      }
    });
}

template <class S>
void Sensitivities<S>::christoffel(const S* q, S* out) {
  const CompiledModel<S>& m = *model_;
  const int N = m.nv;
  const size_t n = N;
  work_.resize(n * n * n);
  S* d = work_.data();
  mass_matrix(q, d);
  const auto D = [&](int i, int j, int k) -> const S& { return d[(size_t(i) * n + j) * n + k]; };
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j) {
      check_interrupt_at(j, N);
      for (int k = 0; k < N; ++k) out[(size_t(i) * n + j) * n + k] = (D(i, j, k) + D(i, k, j) - D(j, k, i)) / S(2);
    }
  // Brackets: [∂_a, ∂_b] is ∂ along S_a × S_b within one ball or free subhinge, whose twists span it; its momentum pairs with S_c.
  const auto add = [&](int a, int b, int c, const S& pairing) { add_bracket(out, n, a, b, c, pairing); };  // of c on one path with a
  std::vector<Vector6<S>>& carried = alpha_;  // the bracket about the origins of the bodies outboard
  for (int a = 0; a < N; ++a)
    for (int b = 0; b < N; ++b) {
      if (a == b || frame_.subhinge_of[a] != frame_.subhinge_of[b]) continue;
      check_interrupt_at(a, m.bodies);
      const int body = frame_.body_of[a];
      carried[body] = cross_motion(frame_.twist[a], frame_.twist[b]);
      Vector6<S> momentum = frame_.R[body] * carried[body];
      for (int e = body; e >= 0; e = m.parent[e]) {
        for (int c = m.v_offset[e]; c < m.v_offset[e] + m.nv_of[e]; ++c) add(a, b, c, dot(frame_.twist[c], momentum));
        momentum = force_inboard(frame_.arm[e], momentum);
      }
      for (int e = body + 1; e < m.bodies && m.parent[e] >= body; ++e) {  // depth first: its subtree follows it
        carried[e] = motion_outboard(frame_.arm[e], carried[m.parent[e]]);
        const Vector6<S> outer = frame_.R[e] * carried[e];
        for (int c = m.v_offset[e]; c < m.v_offset[e] + m.nv_of[e]; ++c) add(a, b, c, dot(frame_.twist[c], outer));
      }
    }
  // What shifts all that it carries, with nothing inboard that turns, changes no other coordinate's twist: Γ(·,·,k) = 0 exactly, so that the
  // speed of a base is not in C.
  straight_.resize(m.bodies);
  for (int e = 0; e < m.bodies; ++e) {
    straight_[e] = m.parent[e] < 0 || straight_[m.parent[e]];
    for (int k = m.v_offset[e]; straight_[e] && k < m.v_offset[e] + m.nv_of[e];) {
      const int subhinge = frame_.subhinge_of[k];
      for (; k < m.v_offset[e] + m.nv_of[e] && frame_.subhinge_of[k] == subhinge; ++k)
        if (const Vector3<S>& w = frame_.twist[k].angular; !(w[0] == S(0) && w[1] == S(0) && w[2] == S(0)))
          straight_[e] = false;
        else
          for (size_t row = 0; row < n * n; ++row) out[row * n + k] = S(0);
    }
  }
  if (m.has_rotor_inertia) add_brackets_of_rotors(out);
}

template <class S>
void Sensitivities<S>::coriolis_matrix(const S* q, const S* v, bool skew, S* out) {
  kinematics(*model_, q, blocks_);
  if (!coriolis_) coriolis_ = std::make_unique<CoriolisBodies<S>>(*model_);
  coriolis_->fill(*model_, blocks_, v);
  pycraft::coriolis_matrix(*model_, *coriolis_, skew, out);
  const CompiledModel<S>& m = *model_;
  for (int k = 0; k < m.bodies && m.has_rotor_inertia; ++k)
    each_rotor_coriolis(m, k, m.rotor_inertia.data(), v, !skew, [&](int i, int j, const S& x) { out[size_t(i) * m.nv + j] += x; });
}

// With the momentum of the bodies as it is seen from the frame, (n; f), and R(0; u) = (h × u; m u) of what it does not see:
// KE = KE' + u·f + m|u|²/2.
template <class S>
void Sensitivities<S>::kinetic_energy(const S* q, const S* v, S* dq, S* dv) {
  frame_at(q, v, nullptr);
  for (int k = 0; k < model_->nv; ++k) {
    const int c = frame_.body_of[k];
    check_interrupt_at(k);
    const Vector6<S>&momentum = frame_.B[c].momentum, &s = frame_.twist[k];
    const Vector3<S> change = cross_force(s, momentum).linear + (frame_.R[c] * frame_.psi_dot[k]).linear;
    dq[k] = dot(frame_.psi_dot[k], momentum) + dot(frame_.travel[c], change);
    dv[k] = dot(s, momentum) + dot(s, frame_.R[c] * uniform(frame_.travel[c])) + model_->rotor_inertia[k] * v[k];
  }
}

template <class S>
void Sensitivities<S>::hamiltonian(const S* q, const S* p, const S* tau, S* v, S* p_rate, const Vector3<S>* gravity) {
  const Vector3<S>& g = gravity ? *gravity : model_->gravity;
  kinematics(*model_, q, blocks_);
  articulated_inertia_tip_to_base(tree_, blocks_);
  scratch_.resize(std::max(scratch_.size(), size_t(6) * model_->bodies));
  mass_matrix_inverse_apply(tree_, blocks_, p, v, 1, scratch_.data());
  frame_.fill(*model_, blocks_, g, v, nullptr);
  // d(S_j·p)/dt = Ṡ_j·p + S_j·ṗ, and S_j·ṗ is what the hinge's force and gravity do: tau_j + S_j·(weight outboard). Of Ṡ_j·p, with u in
  // both, what multiplies u twice is (u × s)·mu = 0. Rotors keep their own momentum: -c(v).
  rates_.assign(model_->nv, S(0));
  for (int k = 0; k < model_->bodies; ++k) {
    check_interrupt_at(k);
    int root = k;
    while (model_->parent[root] >= 0) root = model_->parent[root];
    const Vector6<S> travel = uniform(frame_.travel[k]), field = uniform(transpose_times(blocks_.pose[root].R, g));  // in the frame's axes
    const Vector6<S>& momentum = frame_.B[k].momentum;
    for (int j = model_->v_offset[k]; j < model_->v_offset[k] + model_->nv_of[k]; ++j)
      p_rate[j] = tau[j] + dot(frame_.twist_rate[j], momentum) + dot(frame_.twist_rate[j], frame_.R[k] * travel) +
                  dot(cross_motion(travel, frame_.twist[j]), momentum) + dot(frame_.twist[j], frame_.R[k] * field);
    if (!model_->has_rotor_inertia) continue;
    rotor_forces(*model_, k, model_->rotor_inertia.data(), v, rates_.data());
    for (int j = model_->v_offset[k]; j < model_->v_offset[k] + model_->nv_of[k]; ++j) p_rate[j] -= rates_[j];
  }
}

// The change of what the frame sees, and of (h × u; m u): ∂h × u.
template <class S>
void Sensitivities<S>::momentum(const S* q, const S* v, S* matrix, S* dq) {
  const int N = model_->nv;
  frame_at(q, v, nullptr);
  for (int k = 0; k < N; ++k) {
    const int c = frame_.body_of[k];
    check_interrupt_at(k, c);
    int root = c;
    while (model_->parent[root] >= 0) root = model_->parent[root];
    const RigidInertia<S>& R = frame_.R[c];
    const Vector6<S>& s = frame_.twist[k];
    Vector6<S> changed = cross_force(s, frame_.B[c].momentum) + R * frame_.psi_dot[k];
    changed.angular = changed.angular + cross(cross(s.angular, R.moment) + R.mass * s.linear, frame_.travel[c]);
    const auto in_world = [&](const Vector6<S>& f) { return force_to_parent(blocks_.pose[root], force_inboard(frame_.origin[c], f)); };
    const Vector6<S> column = in_world(R * s), change = in_world(changed);
    for (int i = 0; i < 6; ++i) matrix[size_t(i) * N + k] = column[i], dq[size_t(i) * N + k] = change[i];
  }
}

template <class S>
void Sensitivities<S>::jacobian_rate(const Node& node, const S* q, const S* v, S* out) {
  const int N = model_->nv;
  frame_at(q, v, nullptr);
  std::fill_n(out, size_t(6) * N, S(0));
  if (node.body < 0) return;
  const Pose<S> X = node_in_axes(node);
  // column j in the node's axes moves with what is outboard of j: S_j × (V - V_s)
  Vector3<S> l = Vector3<S>::zero();
  for (int a = node.body; a >= 0; a = model_->parent[a]) {
    for (int j = model_->v_offset[a]; j < model_->v_offset[a] + model_->nv_of[a]; ++j) {
      const Vector6<S> rate = motion_outboard(l, frame_.twist_rate[j]), twist = motion_outboard(l, frame_.twist[j]);
      const Vector6<S> column = motion_to_child(X, rate - cross_motion(frame_.V[node.body], twist));
      for (int i = 0; i < 6; ++i) out[size_t(i) * N + j] = column[i];
    }
    l = l + frame_.arm[a];
  }
}

template <class S>
void Sensitivities<S>::jacobian_derivative(const Node& node, const S* q, S* out) {
  const int N = model_->nv;
  frame_at(q, nullptr, nullptr);
  std::fill_n(out, size_t(6) * N * N, S(0));
  if (node.body < 0) return;
  const Pose<S> X = node_in_axes(node);
  twists_about(node.body);
  on_path(*model_, node.body, [&](int j) {
    check_interrupt_at(j, j);
    on_path(*model_, node.body, [&](int k) {
      if (!frame_.inboard(j, k)) return;
      const Vector6<S> column = motion_to_child(X, cross_motion(outboard_[j], outboard_[k]));
      for (int i = 0; i < 6; ++i) out[(size_t(i) * N + j) * N + k] = column[i];
    });
  });
}

// From its body's origin, in the frame's axes.
template <class S>
Pose<S> Sensitivities<S>::node_in_axes(const Node& node) const {
  return Pose<S>{frame_.axes[node.body], Vector3<S>::zero()} * renormalised<S>(node.pose);
}

#define PYCRAFT_INSTANTIATE(S) template class Sensitivities<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
