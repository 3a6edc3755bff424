#include "kernels/link_model.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "algebra/trees/sweeps/singular_pivot.h"
#include "model/compiled_model.h"
#include "model/unit_data.h"
#include "runtime/interrupt.h"

namespace pycraft::kernels {

namespace {

// What poses and inertias are carried to links in.
template <class T>
using Carrying = std::conditional_t<std::is_same_v<T, float> || std::is_same_v<T, double>, Extended, Quad>;

template <class E>
struct RestLink {
  Link<double> shape{};
  Pose<E> pose;                 // at rest, in the parent link
  RigidInertia<E> inertia = RigidInertia<E>::zero();
  int children = 0, last_child = -1;
};

// The coordinate axis that a is to 8 `rounding`, 0, 1 or 2, or -1.
template <class E>
int coordinate_axis(const Vector3<E>& a, const E& rounding) {
  const E small = E(8) * rounding;
  for (int i = 0; i < 3; ++i) {
    using std::abs;
    if (small >= abs(a[(i + 1) % 3]) && small >= abs(a[(i + 2) % 3])) return i;
  }
  return -1;
}
// The least rotation that takes z to a, or to -a where that is less.
template <class E>
Matrix3<E> rotation_to(const Vector3<E>& a, double& sign) {
  sign = a[2] < E(0) ? -1 : 1;
  const Vector3<E> z = E(sign) * a;
  const E k = E(1) / (E(1) + z[2]), xy = -k * z[0] * z[1];
  return {E(1) - k * z[0] * z[0], xy, z[0], xy, E(1) - k * z[1] * z[1], z[1], -z[0], -z[1], z[2]};
}

// A subhinge's link: its step and how it lies, `before` the frame of the subhinge in the parent link. What is left of `before` is the frame after
// the subhinge in the new link.
template <class E>
std::optional<RestLink<E>> link_of(const CompiledSubhinge<E>& h, Pose<E>& before, const E& rounding) {
  RestLink<E> link;
  link.shape.sign = 1, link.shape.turn = 1, link.shape.travel = 0;
  link.pose = Pose<E>::identity();
  const auto along_axis = [&](bool level) {  // the origin on the axis, as near to the frame's as it can be
    Vector3<E> axis = before.R * h.axis;
    axis = (E(1) / norm(axis)) * axis;
    const int coordinate = coordinate_axis(axis, rounding), found = level ? coordinate : -1;
    link.shape.oblique = coordinate < 0;
    for (int i = 0; coordinate >= 0 && i < 3; ++i) axis[i] = i != coordinate ? E(0) : axis[i] < E(0) ? E(-1) : E(1);  // else rounding would leak from row to row
    if (found >= 0)
      link.shape.step = static_cast<Step>(found), link.shape.sign = axis[found] < E(0) ? -1 : 1;
    else
      link.pose.R = rotation_to(axis, link.shape.sign);
    link.pose.p = before.p + before.R * (h.point - dot(h.axis, h.point) * h.axis);
    return found >= 0;
  };
  switch (h.kind) {
    case SubhingeKind::pin:
      if (!along_axis(true)) link.shape.step = Step::turned_pin;
      break;
    case SubhingeKind::slider:
      link.shape.turn = 0, link.shape.travel = 1;
      along_axis(false), link.shape.step = Step::helix;
      break;
    case SubhingeKind::screw:
      link.shape.travel = static_cast<double>(h.pitch);
      along_axis(false), link.shape.step = Step::helix;
      break;
    case SubhingeKind::ball:
      link.shape.step = Step::ball;
      link.pose = {before.R, before.p + before.R * h.point};
      break;
    case SubhingeKind::free:
      link.shape.step = Step::free;
      link.pose = before;
      break;
    default: return std::nullopt;  // a kind that kernels do not know
  }
  before = inverse(link.pose) * before;
  before.R = quaternion_rotation(rotation_quaternion(before.R));  // else what rounding takes from orthogonality would grow from link to link
  return link;
}

template <class E>
bool absorbs_elsewhere(const CompiledModel<E>& model, int k) {
  const int first = model.first_subhinge[k], count = model.first_subhinge[k + 1] - first;
  if (model.translations[k][0] < 0 || (count == 1 && model.subhinges[first].kind == SubhingeKind::free)) return false;
  if (model.parent[k] >= 0 || count < 3) return true;
  return !std::all_of(&model.subhinges[first], &model.subhinges[first] + 3, [](const auto& h) { return h.kind == SubhingeKind::slider; });
}

template <class T, int n, class From>
void put(const From& from, T (&to)[n]) {
  for (int i = 0; i < n; ++i) to[i] = static_cast<T>(from[i]);
}

// Sums over subtrees, the ways outward, and which columns are kept at once.
template <class E>
int finish(std::vector<RestLink<E>>& rest) {
  for (RestLink<E>& link : rest) {
    Link<double>& own = link.shape;
    const RigidInertia<E>& M = link.inertia;
    own.carried_mass = static_cast<double>(M.mass);
    own.carried_rotational = static_cast<double>(M.rotational.s[0] + M.rotational.s[3] + M.rotational.s[5]);
    own.furthest = 0;
    for (int i = 0; i < 3; ++i) own.furthest = std::max(own.furthest, std::abs(static_cast<double>(ratio_or_zero(M.moment[i], M.mass))));
    own.longest = own.furthest;
    own.end = own.v + record_of(own.step == Step::free ? SubhingeKind::free : own.step == Step::ball ? SubhingeKind::ball : SubhingeKind::pin).nv;
  }
  for (int k = static_cast<int>(rest.size()) - 1; k >= 0; --k) {
    const Link<double>& own = rest[k].shape;
    if (own.parent < 0) continue;
    Link<double>& above = rest[own.parent].shape;
    double length = 0;
    for (int i = 0; i < 3; ++i) length += std::abs(static_cast<double>(rest[k].pose.p[i]));
    above.carried_mass += own.carried_mass, above.carried_rotational += own.carried_rotational;
    above.furthest = std::max(above.furthest, own.furthest + length);
    above.longest = std::max({above.longest, own.longest, length});
    above.end = std::max(above.end, own.end);
    above.branches |= own.parent != k - 1;
    rest[own.parent].last_child = std::max(rest[own.parent].last_child, k);
  }
  std::vector<int> free;
  int slots = 0;
  for (int k = 0; k < static_cast<int>(rest.size()); ++k) {
    const int p = rest[k].shape.parent;
    if (p >= 0 && rest[p].last_child == k) {
      rest[k].shape.slot = rest[p].shape.slot;
    } else if (free.empty()) {
      rest[k].shape.slot = slots++;
    } else {
      rest[k].shape.slot = free.back(), free.pop_back();
    }
    if (rest[k].last_child < 0) free.push_back(rest[k].shape.slot);
  }
  return slots;
}

}  // namespace

template <class T>
std::unique_ptr<LinkModel<T>> LinkModel<T>::of(const Multibody& model, const HingeTerms& terms) {
  using E = Carrying<T>;
  const auto source = terms.empty() ? model.compiled<E>() : compile_model<E>(model, terms);
  const E of_poses(std::min(to_double(epsilon<T>()), epsilon<double>()));
  std::vector<RestLink<E>> rest;
  std::vector<std::pair<int, Pose<E>>> bodies;
  auto made = std::make_unique<LinkModel>();
  int multiple = 0;
  for (int k = 0; k < source->bodies; ++k) {
    check_interrupt_at(k);
    if (absorbs_elsewhere(*source, k)) return nullptr;
    const int p = source->parent[k];
    auto [at, before] = p < 0 ? std::pair(-1, Pose<E>::identity()) : bodies[p];
    before = before * source->placement[k];
    int q = source->q_offset[k], v = source->v_offset[k];
    for (int i = source->first_subhinge[k]; i < source->first_subhinge[k + 1]; ++i) {
      const SubhingeRecord& record = record_of(source->subhinges[i].kind);
      auto link = link_of(source->subhinges[i], before, of_poses);
      if (!link) return nullptr;
      const bool several = record.nv > 1;
      for (int j = v; j < v + record.nv; ++j) {
        link->shape.prescribed |= terms.is_prescribed(j);
        if (source->rotor_inertia[j] == E(0) && !terms.is_driven(j)) continue;
        if (several) return nullptr;
        link->shape.rotor = true, link->shape.J = static_cast<double>(source->rotor_inertia[j]);
      }
      link->shape.parent = at, link->shape.q = q, link->shape.v = v, link->shape.multi = several ? multiple++ : -1;
      at = static_cast<int>(rest.size());
      rest.push_back(*link);
      q += record.nq, v += record.nv;
    }
    bodies.emplace_back(at, before);
    made->bodies_.push_back({at, cast<T>(before)});
    made->links_.several |= source->first_subhinge[k + 1] - source->first_subhinge[k] > 1;
    if (at < 0) continue;
    const MassProperties& mass = source->mass_properties[k];
    if constexpr (has_factors) made->masses_.push_back({at, before, mass});
    rest[at].inertia = rest[at].inertia + to_parent(before, rigid_inertia(E(mass.mass), cast<E>(mass.com), cast<E>(mass.about_com)));
  }
  Links<T>& links = made->links_;
  links.nq = source->nq, links.nv = source->nv, links.multiple = multiple, links.slots = finish(rest);
  links.prescribed = terms.prescribes();
  made->take(rest);
  return made;
}

// Every number rounded once.
template <class T>
template <class Rest>
void LinkModel<T>::take(const std::vector<Rest>& rest) {
  using E = Carrying<T>;
  std::vector<int> parents;
  for (const Rest& link : rest) {
    const Link<double>& d = link.shape;
    Link<T> own{d.step, d.parent, d.q, d.v, d.end, d.branches, d.rotor, d.oblique, d.prescribed, d.multi, d.slot, T(d.sign)};
    put(link.pose.R.m, own.R), put(link.pose.p.v, own.p);
    if constexpr (std::is_same_v<T, float>)  // squares of what rounding left of zeros are denormal numbers, which cost a hundred times as much
      for (T& x : own.R) x = std::abs(x) < T(1e-16) ? T(0) : x;
    own.mass = static_cast<T>(link.inertia.mass);
    put(link.inertia.moment.v, own.moment), put(link.inertia.rotational.s, own.rotational);
    own.J = T(d.J), own.turn = T(d.turn), own.travel = T(d.travel);
    own.carried_rotational = T(d.carried_rotational), own.carried_mass = T(d.carried_mass), own.furthest = T(d.furthest), own.longest = T(d.longest);
    all_.push_back(own);
    inertia_.push_back(own.J);
    parents.push_back(own.parent);
    const auto& [m, h, I] = link.inertia;
    const E numbers[] = {m, h[0], h[1], h[2], I.s[0], I.s[1], I.s[2], I.s[3], I.s[4], I.s[5]};
    for (const E& x : numbers) wide_masses_.push_back(static_cast<double>(x));
    for (const E& x : numbers) wide_masses_.push_back(static_cast<double>(E(x - E(static_cast<double>(x)))));
  }
  constexpr int least = 512;  // links: some hundred thousand operations, many times what a thread costs
  parts_ = tree_parts(parents, std::max(least, static_cast<int>(parents.size()) / 64));
  links_.count = static_cast<int>(all_.size()), links_.link = all_.data(), links_.wide_masses = wide_masses_.data();
  const auto bounds = [](Form form) {
    const T rounding = rounding_bound<T>(form);
    return Bounds<T>{rounding, faint_ratio<T>(form), static_cast<T>(std::pow(to_double(rounding), -0.2)), gain_bound<T>(form)};  // as rigid_elimination.h has it
  };
  links_.plain = bounds(Form::fast), links_.factored = bounds(Form::ud);
}

template <class T>
void LinkModel<T>::find_factors() {
  if constexpr (has_factors) {
    if (links_.factors[0]) return;
    factored_ = factored_links(all_, masses_);
    for (int form = 0; form < 2; ++form) links_.factors[form] = factored_.forms[form].data();
    links_.fours = factored_.fours;
  }
}

template <class T>
void LinkModel<T>::wrenches_on_links(const Vector6<T>* on_bodies, std::vector<T>& out) const {
  out.assign(size_t(6) * links_.count, T(0));
  for (size_t k = 0; k < bodies_.size(); ++k) {
    if (bodies_[k].link < 0) continue;
    const Vector6<T> moved = force_to_parent(bodies_[k].pose, on_bodies[k]);
    for (int i = 0; i < 6; ++i) out[size_t(6) * bodies_[k].link + i] += moved[i];
  }
}

template <class T>
void LinkModel<T>::add_to_hinges(const double* inertia) {
  for (size_t k = 0; k < all_.size(); ++k)
    if (all_[k].rotor && !all_[k].prescribed) all_[k].J = inertia_[k] + static_cast<T>(inertia[all_[k].v]);
}

template <class T>
OnLink<T> LinkModel<T>::on_link(const Node& node) const {
  if (node.body < 0) {
    OnLink<T> fixed{-1};
    put(node.pose.R.m, fixed.R), put(node.pose.p.v, fixed.p);
    return fixed;
  }
  const Carried& body = bodies_[node.body];
  const Pose<T> pose = body.pose * renormalised<T>(node.pose);
  OnLink<T> carried{body.link};
  put(pose.R.m, carried.R), put(pose.p.v, carried.p);
  return carried;
}

template class LinkModel<float>;
template class LinkModel<double>;
template class LinkModel<Extended>;
template class LinkModel<Quad>;

}  // namespace pycraft::kernels
