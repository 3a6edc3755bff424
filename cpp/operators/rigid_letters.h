// rigid_values.h: blocks and vectors of the letters of mechanics.
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "model/unit_data.h"
#include "operators/directions.h"
#include "operators/inverse_tangent.h"
#include "operators/rigid_values.h"

namespace pycraft {

namespace letters {

template <class S>
void put(const Matrix3<S>& A, S* out, int columns, int row, int column) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[(row + i) * columns + column + j] = A(i, j);
}

// [[ω̃, ṽ], [0, ω̃]]
template <class S>
void cross_force_block(const Vector6<S>& V, S* out) {
  std::fill_n(out, 36, S(0));
  put(skew(V.angular), out, 6, 0, 0);
  put(skew(V.linear), out, 6, 0, 3);
  put(skew(V.angular), out, 6, 3, 3);
}
// [[ω̃, 0], [ṽ, ω̃]]
template <class S>
void cross_motion_block(const Vector6<S>& V, S* out) {
  std::fill_n(out, 36, S(0));
  put(skew(V.angular), out, 6, 0, 0);
  put(skew(V.linear), out, 6, 3, 0);
  put(skew(V.angular), out, 6, 3, 3);
}
// -[[ñ, f̃], [f̃, 0]]
template <class S>
void momentum_cross_block(const Vector6<S>& h, S* out) {
  std::fill_n(out, 36, S(0));
  put(S(-1) * skew(h.angular), out, 6, 0, 0);
  put(S(-1) * skew(h.linear), out, 6, 0, 3);
  put(S(-1) * skew(h.linear), out, 6, 3, 0);
}
// φ = [[R, l~R], [0, R]]
template <class S>
void force_transform_block(const Pose<S>& X, S* out, int columns, int column) {
  for (int i = 0; i < 6; ++i) std::fill_n(out + i * columns + column, 6, S(0));
  put(X.R, out, columns, 0, column);
  put(skew(X.p) * X.R, out, columns, 0, column + 3);
  put(X.R, out, columns, 3, column + 3);
}

}  // namespace letters

template <class S>
void RigidValues<S>::block(const Symbol& symbol, int k, S* out) const {
  using namespace letters;
  const RigidBlocks<S>& b = this->blocks_;
  const SkoStructure& tree = this->tree_;
  switch (symbol.definition->id) {
    case SymbolId::B: {
      // Columns: the forces of the nodes on body k, in the order they were named.
      std::vector<int> here;
      for (int node : std::get<OfNodes>(symbol.arguments).nodes)
        if ((node >= 0 ? model_.node(node).body : -1 - node) == k) here.push_back(node);
      const int columns = 6 * static_cast<int>(here.size());
      for (size_t j = 0; j < here.size(); ++j)
        force_transform_block(here[j] >= 0 ? renormalised<S>(model_.node(here[j]).pose) : Pose<S>::identity(), out, columns, 6 * static_cast<int>(j));
      return;
    }
    case SymbolId::Delta: {
      int body;
      const Vector6<S> h = twist(place_in(symbol.arguments), body);
      if (body == k)
        cross_force_block(h, out);
      else
        std::fill_n(out, 36, S(0));
      return;
    }
    case SymbolId::inertia_derivative: {
      const OfInertia& of = std::get<OfInertia>(symbol.arguments);
      std::fill_n(out, 36, S(0));
      if (of.body == k) inertia_derivative_block(of, out);
      return;
    }
    case SymbolId::coordinate_selection: selection_block(symbol.arguments, k, out); return;
    case SymbolId::Delta_theta_dot: cross_force_block(velocities_.relative[k], out); return;
    case SymbolId::V_tilde: cross_motion_block(velocities_.V[k], out); return;
    case SymbolId::V_bar: cross_force_block(velocities_.V[k], out); return;
    case SymbolId::momentum_cross: {
      momentum_cross_block(b.inertia[k] * velocities_.V[k], out);
      return;
    }
    case SymbolId::X_world: force_transform_block(world_[k], out, 6, 0); return;
    case SymbolId::H_dot:
      for (int j = tree.dof_offset[k]; j < tree.dof_offset[k + 1]; ++j)
        for (int i = 0; i < 6; ++i) out[(j - tree.dof_offset[k]) * 6 + i] = velocities_.H_dot[j][i];
      return;
    default: b.block(symbol.definition->id, k, out);
  }
}

// Ones on the diagonal at the coordinates that are selected.
template <class S>
void RigidValues<S>::selection_block(const SymbolArguments& which, int k, S* out) const {
  const SkoStructure& tree = this->tree_;
  const int n = tree.dof[k];
  std::fill_n(out, n * n, S(0));
  if (const auto* one = std::get_if<OfCoordinate>(&which)) {
    const int i = one->coordinate - tree.dof_offset[k];
    if (i >= 0 && i < n) out[i * n + i] = S(1);
    return;
  }
  const OfSubhinges& of = std::get<OfSubhinges>(which);
  if (of.body >= 0 && of.body != k) return;
  int j = 0, s = 0;
  for (const Subhinge& h : model_.body(k).hinge.subhinges) {
    for (int c = 0; c < h.nv(); ++c, ++j)
      if (s >= of.from && s < of.to) out[j * n + j] = S(1);
    ++s;
  }
}

template <class S>
Vector6<S> RigidValues<S>::twist(const TwistPlace& place, int& body) const {
  const SkoStructure& tree = this->tree_;
  if (const auto* of = std::get_if<OfCoordinate>(&place)) {
    body = 0;
    while (tree.dof_offset[body + 1] <= of->coordinate) ++body;
    return this->blocks_.H[of->coordinate];
  }
  // a twist fixed before a subhinge, carried past the steps that follow
  const OfTwist& of = std::get<OfTwist>(place);
  body = of.body;
  Vector6<S> h = Vector6<S>::zero();
  h[of.component] = S(1);
  const CompiledModel<S>& model = *compiled_;
  const S* q = q_.data() + model.q_offset[body];
  for (int i = model.first_subhinge[body]; i < model.first_subhinge[body + 1]; ++i) {
    if (i - model.first_subhinge[body] >= of.position) h = motion_to_child(subhinge_step(model.subhinges[i], q), h);
    q += record_of(model.subhinges[i].kind).nq;
  }
  return h;
}

// M is linear in the mass and in the inertia about the centre of mass, quadratic in the centre of mass c:
// M = [[I + m(c·c 1 - cc*), m c~], [-m c~, m 1]]
template <class S>
void RigidValues<S>::inertia_derivative_block(const OfInertia& of, S* out) const {
  const Body& body = model_.body(of.body);
  const Vector3<S> c = cast<S>(body.com);
  S mass = S(body.mass), linear = S(0);
  std::vector<int> along;
  for (const InertiaParameter p : of.parameters) {
    if (p == InertiaParameter::mass) {
      mass = linear = S(1);
    } else if (p <= InertiaParameter::com_z) {
      along.push_back(static_cast<int>(p) - static_cast<int>(InertiaParameter::com_x));
    } else {
      static const int row[] = {0, 0, 0, 1, 1, 2}, column[] = {0, 1, 2, 1, 2, 2};
      const int entry = static_cast<int>(p) - static_cast<int>(InertiaParameter::inertia_xx), a = row[entry], b = column[entry];
      out[a * 6 + b] = out[b * 6 + a] = S(1);
      return;
    }
  }
  const auto unit = [](int a) {
    Vector3<S> e = Vector3<S>::zero();
    e[a] = S(1);
    return e;
  };
  // moment and rotational part, differentiated along the components asked for
  Vector3<S> moment = along.empty() ? c : along.size() == 1 ? unit(along[0]) : Vector3<S>::zero();
  const Vector3<S> u = along.size() == 2 ? unit(along[1]) : c, w = along.empty() ? c : unit(along[0]);
  const S half = along.empty() ? S(1) / S(2) : S(1);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) out[i * 6 + j] = mass * half * ((i == j ? S(2) * dot(u, w) : S(0)) - (u[i] * w[j] + w[i] * u[j]));
  letters::put(mass * skew(moment), out, 6, 0, 3);
  letters::put(S(-1) * mass * skew(moment), out, 6, 3, 0);
  if (along.empty())
    for (int i = 3; i < 6; ++i) out[i * 6 + i] = linear;
}

template <class S>
void RigidValues<S>::function_block(const Symbol& function, int, const S* x, S* out) const {
  const Vector6<S> v{{x[0], x[1], x[2]}, {x[3], x[4], x[5]}};
  using namespace letters;
  switch (function.definition->id) {
    case SymbolId::motion_cross: cross_motion_block(v, out); return;
    case SymbolId::force_cross: cross_force_block(v, out); return;
    default: momentum_cross_block(v, out);
  }
}

template <class S>
void RigidValues<S>::vector(const Symbol& symbol, S* out) const {
  const SkoStructure& tree = this->tree_;
  const auto copy = [&](const std::vector<Vector6<S>>& from) {
    for (int k = 0; k < tree.bodies(); ++k)
      for (int i = 0; i < 6; ++i) out[6 * k + i] = from[k][i];
  };
  switch (symbol.definition->id) {
    case SymbolId::theta_dot: std::copy(v_.begin(), v_.end(), out); return;
    case SymbolId::velocity: copy(velocities_.V); return;
    case SymbolId::coriolis_acceleration: copy(velocities_.a); return;
    case SymbolId::gyroscopic_force: copy(velocities_.b); return;
    case SymbolId::direction_twist: {
      std::fill_n(out, 6 * tree.bodies(), S(0));
      int body;
      const Vector6<S> h = twist(place_in(symbol.arguments), body);
      for (int i = 0; i < 6; ++i) out[6 * body + i] = h[i];
      return;
    }
    default: {
      const bool base = symbol.definition->id == SymbolId::gravity_base;
      const Vector6<S> g{Vector3<S>::zero(), compiled_->gravity};
      std::vector<Vector6<S>> field(tree.bodies(), Vector6<S>::zero());
      for (int k = 0; k < tree.bodies(); ++k) {
        const int p = tree.parent[k];
        if (p < 0)
          field[k] = motion_to_child(this->blocks_.pose[k], base ? S(-1) * g : g);
        else if (!base)
          field[k] = motion_to_child(this->blocks_.pose[k], field[p]);
      }
      copy(field);
    }
  }
}

template <class S>
std::unique_ptr<InverseTangent<S>> RigidValues<S>::inverse_tangent() const {
  if constexpr (std::numeric_limits<S>::digits <= std::numeric_limits<Quad>::digits)
    return std::make_unique<RigidInverseTangent<S>>(this->tree_);
  else
    return nullptr;
}

}  // namespace pycraft
