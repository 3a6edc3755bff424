#include "dynamics/sensitivities.h"

#include <algorithm>

#include "algebra/sweeps/articulated_inertia.h"
#include "algebra/sweeps/upsilon.h"
#include "recursions/kinematics.h"

namespace pycraft {

template <class S>
Sensitivities<S>::Sensitivities(const Multibody& model)
    : tree_(model.structure()), model_(model.compiled<S>()), blocks_(tree_), frame_(*model_) {}

template <class S>
void Sensitivities<S>::frame_at(const S* q, const S* v, const S* vdot) {
  kinematics(*model_, q, blocks_);
  frame_.fill(*model_, blocks_, v, vdot);
}

template <class S>
void Sensitivities<S>::inverse_dynamics(const S* q, const S* v, const S* vdot, S* dq, S* dv) {
  const CompiledModel<S>& m = *model_;
  const int N = m.nv;
  frame_at(q, v, vdot);
  std::fill_n(dq, size_t(N) * N, S(0));
  std::fill_n(dv, size_t(N) * N, S(0));
  for (int k = 0; k < N; ++k) {
    const int c = frame_.body_of[k];
    const RigidInertia<S>& R = frame_.R[c];
    const MomentumRate<S>& B = frame_.B[c];
    const Vector6<S>& s = frame_.twist[k];
    const Vector6<S> along_v = R * (frame_.twist_rate[k] + frame_.psi_dot[k]) + B * s;
    const Vector6<S> along_q = R * frame_.psi_ddot[k] + B * frame_.psi_dot[k] + cross_force(s, frame_.force[c]);
    const Vector6<S> Rs = R * s, Bs = transpose_times(B, s);  // row k of what is inboard of it
    on_path(m, c, [&](int i) {
      dv[size_t(i) * N + k] = dot(frame_.twist[i], along_v);
      dv[size_t(k) * N + i] = dot(Rs, frame_.twist_rate[i] + frame_.psi_dot[i]) + dot(Bs, frame_.twist[i]);
      const S outboard = dot(Rs, frame_.psi_ddot[i]) + dot(Bs, frame_.psi_dot[i]);  // row k, moved by i at or inboard of it
      if (frame_.inboard(i, k)) {
        dq[size_t(i) * N + k] = dot(frame_.twist[i], along_q);
        dq[size_t(k) * N + i] = outboard;
      } else if (frame_.subhinge_of[i] == frame_.subhinge_of[k]) {
        dq[size_t(k) * N + i] = outboard;
      }
    });
  }
}

template <class S>
void Sensitivities<S>::forward_dynamics(const S* q, const S* v, const S* vdot, S* dq, S* dv, S* dtau) {
  const int N = model_->nv;
  work_.resize(2 * size_t(N) * N);
  S *tq = work_.data(), *tv = tq + size_t(N) * N;
  inverse_dynamics(q, v, vdot, tq, tv);
  articulated_inertia_tip_to_base(tree_, blocks_);
  inverse_.assign(size_t(N) * N, S(0));
  for (int i = 0; i < N; ++i) inverse_[size_t(i) * N + i] = S(1);
  scratch_.resize(size_t(6) * model_->bodies * N);
  mass_matrix_inverse_apply(tree_, blocks_, inverse_.data(), dtau, N, scratch_.data());
  mass_matrix_inverse_apply(tree_, blocks_, tq, dq, N, scratch_.data());
  mass_matrix_inverse_apply(tree_, blocks_, tv, dv, N, scratch_.data());
  for (size_t i = 0; i < size_t(N) * N; ++i) dq[i] = -dq[i], dv[i] = -dv[i];
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
  // ℳ(i,j) = S_i* R S_j, R of the outboard one, j. What moves both along changes nothing.
  for (int j = 0; j < N; ++j) {
    const int b = frame_.body_of[j];
    const Vector6<S> momentum = frame_.R[b] * frame_.twist[j];
    // k between: R and S_j move, S_i stays
    on_path(m, b, [&](int k) {
      if (frame_.subhinge_of[k] > frame_.subhinge_of[j]) return;
      const Vector6<S> moved = cross_force(frame_.twist[k], momentum);
      on_path(m, b, [&](int i) {
        if (frame_.inboard(i, k)) put(i, j, k, dot(frame_.twist[i], moved));
      });
    });
  }
  // k outboard of both: R alone moves, by crf(S_k) R_k - R_k crm(S_k)
  for (int k = 0; k < N; ++k) {
    const int c = frame_.body_of[k];
    const RigidInertia<S>& R = frame_.R[c];
    const Vector6<S>& s = frame_.twist[k];
    on_path(m, c, [&](int j) {
      if (!frame_.inboard(j, k)) return;
      const Vector6<S> moved = cross_force(s, R * frame_.twist[j]) - R * cross_motion(s, frame_.twist[j]);
      on_path(m, frame_.body_of[j], [&](int i) {
        if (frame_.inboard(i, k) && frame_.subhinge_of[i] <= frame_.subhinge_of[j]) put(i, j, k, dot(frame_.twist[i], moved));
      });
    });
  }
}

template <class S>
void Sensitivities<S>::christoffel(const S* q, S* out) {
  const int N = model_->nv;
  const size_t n = N;
  work_.resize(n * n * n);
  S* d = work_.data();
  mass_matrix(q, d);
  const auto D = [&](int i, int j, int k) -> const S& { return d[(size_t(i) * n + j) * n + k]; };
  for (int i = 0; i < N; ++i)
    for (int j = 0; j < N; ++j)
      for (int k = 0; k < N; ++k) out[(size_t(i) * n + j) * n + k] = (D(i, j, k) + D(i, k, j) - D(j, k, i)) / S(2);
  // Brackets: [∂_a, ∂_b] is ∂ along S_a × S_b within one ball or free subhinge, whose twists span it; its momentum pairs with S_c.
  for (int a = 0; a < N; ++a)
    for (int b = 0; b < N; ++b) {
      if (a == b || frame_.subhinge_of[a] != frame_.subhinge_of[b]) continue;
      const Vector6<S> bracket = cross_motion(frame_.twist[a], frame_.twist[b]);
      for (int c = 0; c < N; ++c) {
        // g([∂_a, ∂_b], ∂_c): on one path only; R of the outboard of the two
        const int x = frame_.body_of[a], y = frame_.body_of[c];
        int deep = -1;
        for (int e = x; e >= 0 && deep < 0; e = model_->parent[e])
          if (e == y) deep = x;
        for (int e = y; e >= 0 && deep < 0; e = model_->parent[e])
          if (e == x) deep = y;
        if (deep < 0) continue;
        const S g = dot(frame_.twist[c], frame_.R[deep] * bracket) / S(2);
        out[(size_t(c) * n + b) * n + a] += g;  // [X, Y], Z with X = a, Y = b
        out[(size_t(b) * n + c) * n + a] -= g;  // [X, Z], Y with X = a, Z = b
        out[(size_t(b) * n + a) * n + c] -= g;  // [Y, Z], X with Y = a, Z = b
      }
    }
}

template <class S>
void Sensitivities<S>::kinetic_energy(const S* q, const S* v, S* dq, S* dv) {
  frame_at(q, v, nullptr);
  for (int k = 0; k < model_->nv; ++k) {
    const Vector6<S>& momentum = frame_.B[frame_.body_of[k]].momentum;
    dq[k] = dot(frame_.psi_dot[k], momentum);
    dv[k] = dot(frame_.twist[k], momentum) + model_->rotor_inertia[k] * v[k];
  }
}

template <class S>
void Sensitivities<S>::hamiltonian(const S* q, const S* p, const S* tau, S* v, S* p_rate) {
  kinematics(*model_, q, blocks_);
  articulated_inertia_tip_to_base(tree_, blocks_);
  scratch_.resize(std::max(scratch_.size(), size_t(6) * model_->bodies));
  mass_matrix_inverse_apply(tree_, blocks_, p, v, 1, scratch_.data());
  frame_.fill(*model_, blocks_, v, nullptr);
  // d(S_j·p)/dt = Ṡ_j·p + S_j·ṗ, and S_j·ṗ is what the hinge's force and gravity do: tau_j + S_j·(weight outboard).
  for (int k = 0; k < model_->bodies; ++k) {
    int root = k;
    while (model_->parent[root] >= 0) root = model_->parent[root];
    const Vector6<S> field = motion_to_child(blocks_.pose[root], Vector6<S>{Vector3<S>::zero(), model_->gravity});
    for (int j = model_->v_offset[k]; j < model_->v_offset[k] + model_->nv_of[k]; ++j)
      p_rate[j] = tau[j] + dot(frame_.twist_rate[j], frame_.B[k].momentum) + dot(frame_.twist[j], frame_.R[k] * field);
  }
}

template <class S>
void Sensitivities<S>::momentum(const S* q, const S* v, S* matrix, S* dq) {
  const int N = model_->nv;
  frame_at(q, v, nullptr);
  for (int k = 0; k < N; ++k) {
    const int c = frame_.body_of[k];
    int root = c;
    while (model_->parent[root] >= 0) root = model_->parent[root];
    const Vector6<S> column = force_to_parent(blocks_.pose[root], frame_.R[c] * frame_.twist[k]);
    const Vector6<S> change =
        force_to_parent(blocks_.pose[root], cross_force(frame_.twist[k], frame_.B[c].momentum) + frame_.R[c] * frame_.psi_dot[k]);
    for (int i = 0; i < 6; ++i) matrix[size_t(i) * N + k] = column[i], dq[size_t(i) * N + k] = change[i];
  }
}

template <class S>
void Sensitivities<S>::jacobian_rate(const Node& node, const S* q, const S* v, S* out) {
  const int N = model_->nv;
  frame_at(q, v, nullptr);
  std::fill_n(out, size_t(6) * N, S(0));
  if (node.body < 0) return;
  const Pose<S> X = frame_.pose[node.body] * cast<S>(node.pose);
  // column j in the node's axes moves with what is outboard of j: S_j × (V - V_s)
  on_path(*model_, node.body, [&](int j) {
    const Vector6<S> column = motion_to_child(X, frame_.twist_rate[j] - cross_motion(frame_.V[node.body], frame_.twist[j]));
    for (int i = 0; i < 6; ++i) out[size_t(i) * N + j] = column[i];
  });
}

template <class S>
void Sensitivities<S>::jacobian_derivative(const Node& node, const S* q, S* out) {
  const int N = model_->nv;
  frame_at(q, nullptr, nullptr);
  std::fill_n(out, size_t(6) * N * N, S(0));
  if (node.body < 0) return;
  const Pose<S> X = frame_.pose[node.body] * cast<S>(node.pose);
  on_path(*model_, node.body, [&](int j) {
    on_path(*model_, node.body, [&](int k) {
      if (!frame_.inboard(j, k)) return;
      const Vector6<S> column = motion_to_child(X, cross_motion(frame_.twist[j], frame_.twist[k]));
      for (int i = 0; i < 6; ++i) out[(size_t(i) * N + j) * N + k] = column[i];
    });
  });
}

template <class S>
void Sensitivities<S>::inertial_regressor(const S* q, const S* v, const S* vdot, S* out) {
  const CompiledModel<S>& m = *model_;
  const int columns = 10 * m.bodies;
  frame_at(q, v, vdot);
  std::fill_n(out, size_t(m.nv) * columns, S(0));
  for (int k = 0; k < m.bodies; ++k) {
    const Vector6<S> V = motion_to_child(frame_.pose[k], frame_.V[k]), alpha = motion_to_child(frame_.pose[k], frame_.alpha[k]);
    for (int p = 0; p < 10; ++p) {
      RigidInertia<S> unit = RigidInertia<S>::zero();
      if (p == 0)
        unit.mass = S(1);
      else if (p < 4)
        unit.moment[p - 1] = S(1);
      else
        unit.rotational.s[p - 4] = S(1);
      Vector6<S> f = unit * alpha + cross_force(V, unit * V);
      for (int a = k; a >= 0; a = m.parent[a]) {
        for (int i = m.v_offset[a]; i < m.v_offset[a] + m.nv_of[a]; ++i) out[size_t(i) * columns + 10 * k + p] = dot(blocks_.H[i], f);
        f = force_to_parent(blocks_.pose[a], f);
      }
    }
  }
}

template <class S>
void Sensitivities<S>::log_determinant(const S* q, S* coordinates, S* inertias, S* geometry, S* axes) {
  const CompiledModel<S>& m = *model_;
  kinematics(m, q, blocks_);
  articulated_inertia_tip_to_base(tree_, blocks_);
  upsilon_base_to_tip(tree_, blocks_);
  for (int k = 0; k < m.bodies; ++k) {
    const int p = m.parent[k], first = m.v_offset[k], last = first + m.nv_of[k];
    const ArticulatedInertia<S>& Y = blocks_.Y[k];
    if (inertias) {  // tr(Υ ∂M)
      S* g = inertias + 10 * k;
      g[0] = Y(3, 3) + Y(4, 4) + Y(5, 5);
      // ∂M = [[0, ẽ], [-ẽ, 0]], ẽ(b, a) = 1 = -ẽ(a, b)
      for (int c = 0; c < 3; ++c) {
        const int a = (c + 1) % 3, b = (c + 2) % 3;
        g[1 + c] = S(2) * (Y(b, 3 + a) - Y(a, 3 + b));
      }
      static const int row[] = {0, 0, 0, 1, 1, 2}, column[] = {0, 1, 2, 1, 2, 2};
      for (int e = 0; e < 6; ++e) g[4 + e] = (row[e] == column[e] ? S(1) : S(2)) * Y(row[e], column[e]);
    }
    if (!coordinates && !geometry && !axes) continue;
    const ArticulatedInertia<S> W = p < 0 ? ArticulatedInertia<S>::zero() : compliance_to_child(blocks_.pose[k], blocks_.Y[p]);  // E*ΥE
    const ArticulatedInertia<S>& plus = blocks_.Pplus[k];
    // g: 2 tr(P⁺ W crf(x)) = g·x; with A = P⁺W: tr(A crf(x)) = Σ A(i,j) crf(x)(j,i)
    S A[6][6];
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        A[i][j] = S(0);
        for (int a = 0; a < 6; ++a) A[i][j] += plus(i, a) * W(a, j);
      }
    Vector6<S> g = Vector6<S>::zero();
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;  // (x̃)(b, a) = x_c, (x̃)(a, b) = -x_c
      g.angular[c] = S(2) * (A[a][b] - A[b][a] + A[3 + a][3 + b] - A[3 + b][3 + a]);
      g.linear[c] = S(2) * (A[3 + a][b] - A[3 + b][a]);
    }
    // 2 (I - P⁺W) G, column j: what a change of row j of H is worth
    const auto by_row = [&](int j) {
      Vector6<S> r = blocks_.G[j];
      const Vector6<S> gain = blocks_.G[j];
      for (int i = 0; i < 6; ++i)
        for (int a = 0; a < 6; ++a) r[i] -= A[i][a] * gain[a];
      return S(2) * r;
    };
    if (coordinates)
      for (int i = first; i < last; ++i) {
        S sum = dot(g, blocks_.H[i]);
        for (int j = first; j < last; ++j)  // ∂H: rows of subhinges inboard of i's turn with it
          if (frame_.inboard(j, i)) sum += dot(by_row(j), S(-1) * cross_motion(blocks_.H[i], blocks_.H[j]));
        coordinates[i] = sum;
      }
    if (axes)
      for (int j = first; j < last; ++j) {
        const Vector6<S> r = by_row(j);
        for (int i = 0; i < 6; ++i) axes[6 * j + i] = r[i];
      }
    if (geometry) {  // a twist at the placement, seen in the body's axes: the hinge's own motion carries it
      const Vector6<S> placed = force_to_parent(inverse(m.placement[k]) * blocks_.pose[k], g);
      for (int i = 0; i < 6; ++i) geometry[6 * k + i] = placed[i];
    }
  }
}

#define PYCRAFT_INSTANTIATE(S) template class Sensitivities<S>;
PYCRAFT_FOR_EACH_SCALAR_TO_QUAD(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
