#include "dynamics/divided_dynamics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "model/hinge_kinematics.h"
#include "model/multibody.h"
#include "recursions/kinematics.h"
#include "recursions/newton_euler.h"
#include "recursions/newton_euler_sizes.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

using Kind = AssemblyNode::Kind;

// Ratios of pivots down to this are those of long chains, and do not add up to a loss.
constexpr double common_ratio = 1.0 / 1024;

// Growth from which on a pivot may be noise: accelerations may be off by more than faint_error().
template <class S>
double largest_growth() {
  return common_ratio * to_double(faint_error<S>()) / to_double(epsilon<S>());
}

// Of what may be squared beyond the range of numbers.
template <class S>
S length(int n, const S* x) {
  using std::abs, std::sqrt;
  S most = S(0), square = S(0);
  for (int i = 0; i < n; ++i)
    if (!(most >= abs(x[i]))) most = S(abs(x[i]));
  if (most == S(0) || !std::isfinite(to_double(most))) return most;
  for (int i = 0; i < n; ++i) square += (x[i] / most) * (x[i] / most);
  return most * S(sqrt(square));
}

}  // namespace

template <class S>
DividedDynamics<S>::DividedDynamics(const Multibody& model)
    : source_(model), tree_(model.structure()), model_(model.compiled<S>()), assembly_(model_->parent), blocks_(tree_) {
  const size_t bodies = model_->bodies, coordinates = model_->nv, nodes = assembly_.nodes().size();
  set_constants(*model_, blocks_);
  points_.resize(*model_);
  lent_.resize(bodies), alpha_.resize(bodies), interbody_.resize(bodies), gathered_.resize(bodies);
  size_t numbers = 0;
  for (const int n : model_->nv_of) l_.push_back(numbers), numbers += size_t(n) * n;
  for (auto* rows : {&b_, &p_}) rows->resize(coordinates);
  for (auto* values : {&x_, &eta_, &residual_, &delta_, &direction_}) values->resize(coordinates);
  L_.resize(numbers), work_.resize(2 * coordinates);
  turns_.resize(nodes), omega_.resize(nodes), segments_.resize(nodes), motion_.resize(nodes), force_.resize(nodes), growth_.resize(nodes);
  lend_inertias();
}

// A body's own inertia about its frame's origin, turned into a sphere's, or where it has none that of what it carries; lent to the body that it
// hangs on.
template <class S>
void DividedDynamics<S>::lend_inertias() {
  std::vector<LentInertia<S>> own(model_->bodies), carried(model_->bodies);
  for (int k = model_->bodies - 1; k >= 0; --k) {
    const RigidInertia<S>& M = model_->inertia[k];
    const S trace = M.rotational(0, 0) + M.rotational(1, 1) + M.rotational(2, 2);
    own[k] = {M.mass > S(0) ? M.mass : carried[k].mass, trace > S(0) ? S(trace / S(2)) : carried[k].rotational};
    const Vector3<S>& l = model_->placement[k].p;
    const LentInertia<S> seen{own[k].mass, own[k].rotational + own[k].mass * dot(l, l)};
    const int p = model_->parent[k];
    if (p < 0) continue;
    carried[p].mass += seen.mass, carried[p].rotational += seen.rotational;
    if (assembly_.next()[p] == k) lent_[p] = seen;
  }
}

template <class S>
template <class F>
void DividedDynamics<S>::inwards(int threads, F f) {
  const auto piece = [&](const AssemblyTree::Piece& part) {
    for (int i = part.first; i < part.last; ++i) check_interrupt_at(i), f(i);
  };
  if (threads > 1 && pieces_.size() > 1)
    share_out(0, static_cast<int>(pieces_.size()), threads, [&](int, int i) { piece(pieces_[i]); });
  else
    for (const auto& part : pieces_) piece(part);
  for (const int i : rest_) f(i);
}

template <class S>
template <class F>
void DividedDynamics<S>::outwards(int threads, F f) {
  const auto piece = [&](const AssemblyTree::Piece& part) {
    for (int i = part.last - 1; i >= part.first; --i) check_interrupt_at(i), f(i);
  };
  for (auto i = rest_.rbegin(); i != rest_.rend(); ++i) f(*i);
  if (threads > 1 && pieces_.size() > 1)
    share_out(0, static_cast<int>(pieces_.size()), threads, [&](int, int i) { piece(pieces_[i]); });
  else
    for (const auto& part : pieces_) piece(part);
}

template <class S>
void DividedDynamics<S>::forward_dynamics(const S* q, const S* v, const S* tau, S* vdot, const Applied<S>& applied, int threads) {
  if (cut_for_ != threads) {
    const int nodes = static_cast<int>(assembly_.nodes().size()), pieces_a_thread = 8;
    assembly_.cut(threads > 1 ? std::max(nodes / (pieces_a_thread * threads), 64) : nodes, pieces_, rest_);
    cut_for_ = threads;
  }
  const Call call{q, v, tau, vdot, applied, threads};
  points_.resize(*model_);
  for (const int root : assembly_.roots()) omega_[root] = Vector3<S>::zero();
  start_at(applied.base());
  inwards(threads, [&](int i) { turn(call, i); });
  outwards(threads, [&](int i) { move(call, i); });
  inwards(threads, [&](int i) { put_together(call, i); });
  double growth = 1;
  for (const int root : assembly_.roots()) growth = std::max(growth, growth_[root]);
  if (growth > largest_growth<S>()) name_singular_hinge(call);
  if (!std::isfinite(growth)) refuse(growth, 0);
  outwards(threads, [&](int i) { take_apart(call, i); });
  certify(call);
  for (int i = 0; i < model_->nv; ++i) vdot[i] -= points_.absorbed[i];
}

template <class S>
void DividedDynamics<S>::start_at(const Vector6<S>& base) {
  for (const int root : assembly_.roots()) motion_[root] = base, force_[root] = Vector6<S>::zero();
}

// Of a segment that two are joined to: R = R₁R₂, w = R₂*w₁ + w₂.
template <class S>
void DividedDynamics<S>::turn(const Call& call, int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  if (node.kind == Kind::join) {
    const Turn &one = turns_[node.first], &two = turns_[node.second];
    turns_[i] = {one.R * two.R, two.of(one.w)};
  } else if (node.kind == Kind::body) {
    const int k = node.body, first = model_->v_offset[k];
    blocks_.pose[k] = hinge_kinematics(*model_, k, call.q, blocks_.H.data() + first);
    Vector3<S> w = Vector3<S>::zero();
    for (int j = first; j < first + model_->nv_of[k]; ++j) w = w + call.v[j] * blocks_.H[j].angular;
    turns_[i] = {blocks_.pose[k].R, w};
  }
}

template <class S>
void DividedDynamics<S>::move(const Call& call, int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  Vector3<S> inner = omega_[i], outer = omega_[i];
  if (node.kind == Kind::join) outer = turns_[node.first].of(inner);
  if (node.kind == Kind::body) {
    point_acceleration(*model_, node.body, &omega_[i], blocks_.pose.data(), blocks_.H.data(), call.v, OwnTerms::absorbed, points_);
    inner = points_.angular_velocity[node.body];
  }
  if (node.first >= 0) omega_[node.first] = inner;
  if (node.second >= 0) omega_[node.second] = outer;
}

template <class S>
Rows<S> DividedDynamics<S>::rows(int k) {
  const int first = model_->v_offset[k];
  return {model_->nv_of[k], b_.data() + first, p_.data() + first, x_.data() + first, L_.data() + l_[k]};
}

template <class S>
void DividedDynamics<S>::put_together(const Call& call, int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  double growth = 1;
  for (const int inside : {node.first, node.second})
    if (inside >= 0) growth = std::max(growth, growth_[inside]);
  if (node.kind == Kind::branches) {
    Segment<S>& both = segments_[i];
    both.P = segments_[node.first].P, both.z = segments_[node.first].z, both.sizes = segments_[node.first].sizes;
    add_branch(segments_[node.second], both.P, both.z, both.sizes);
  } else if (std::isfinite(growth)) {
    const double least = to_double(node.kind == Kind::body ? body(call, i) : joined(i));
    growth = least > 0 ? growth * std::max(1.0, common_ratio / least) : HUGE_VAL;
  }
  growth_[i] = growth;
}

// The biases alone, of a correction.
template <class S>
void DividedDynamics<S>::put_together_again(const Call& call, int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  if (node.kind == Kind::branches) {
    segments_[i].z = segments_[node.first].z + segments_[node.second].z;
  } else if (node.kind == Kind::body) {
    const int k = node.body, first = model_->v_offset[k];
    std::copy_n(call.tau + first, model_->nv_of[k], eta_.data() + first);
    const Vector6<S> zero = Vector6<S>::zero();
    bias_of_body(blocks_.pose[k], node.first >= 0 ? segments_[node.first].z : zero, zero, rows(k), eta_.data() + first, segments_[i]);
  } else {
    End<S> end;
    find_end(node.first, end);
    join_again(segments_[node.first], segments_[node.second], lent_[node.body], end, segments_[i]);
  }
}

template <class S>
S DividedDynamics<S>::body(const Call& call, int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  const int k = node.body, first = model_->v_offset[k], n = model_->nv_of[k];
  Symmetric6<S> P = symmetric6(model_->inertia[k]);
  Vector6<S> z = points_.b[k];
  call.applied.subtract_from(z, k);
  if (assembly_.next()[k] >= 0) add(P, lent_[k], S(1));
  Vector6<S> sizes = diagonal(P);
  if (node.first >= 0) add_branch(segments_[node.first], P, z, sizes);
  const Rows<S> hinge = rows(k);
  bool plain = true;
  for (int j = 0; j < n; ++j) {
    hinge.b[j] = blocks_.H[first + j];
    hinge.x[j] = model_->rotor_inertia[first + j];
    plain &= hinge.x[j] == S(0);
    eta_[first + j] = points_.without_rotors(first + j, call.tau[first + j]);
  }
  const auto annihilates = [&](int row) {
    const auto aligned = model_->aligned.begin() + first;
    return plain && std::find(aligned, aligned + n, row) != aligned + n;
  };
  const S least = segment_of_body(blocks_.pose[k], P, sizes, hinge, work_.data() + 2 * first, annihilates, segments_[i]);
  if (least > S(0)) bias_of_body(blocks_.pose[k], z + P * points_.a[k], points_.a[k], hinge, eta_.data() + first, segments_[i]);
  return least;
}

template <class S>
bool DividedDynamics<S>::one_hinge(int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  return node.kind == Kind::body && model_->nv_of[node.body] <= 6;
}

// Of a body Υ = Σ b*b/x.
template <class S>
void DividedDynamics<S>::find_end(int i, End<S>& end) {
  if (!one_hinge(i)) return rows_of_compliance(segments_[i].Y, end);
  const Rows<S> hinge = rows(assembly_.nodes()[i].body);
  end.n = hinge.n;
  std::copy_n(hinge.b, hinge.n, end.h), std::copy_n(hinge.x, hinge.n, end.J);
}

template <class S>
S DividedDynamics<S>::joined(int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  End<S> end;
  find_end(node.first, end);
  return join(segments_[node.first], segments_[node.second], lent_[node.body], end, segments_[i]);
}

template <class S>
void DividedDynamics<S>::take_apart(const Call& call, int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  const int k = node.body, first = model_->v_offset[k];
  const Vector6<S>& motion = motion_[i];
  if (node.kind == Kind::join) {
    End<S> end;
    find_end(node.first, end);
    S felt[6];
    motion_[node.first] = motion;
    motion_[node.second] = part(segments_[node.first], segments_[node.second], lent_[k], end, motion, force_[i], felt);
    force_[node.second] = force_[i];
    force_[node.first] = one_hinge(node.first) ? Vector6<S>::zero() : felt_force(end, felt);
    for (int r = 0; r < end.n && one_hinge(node.first); ++r) eta_[first + r] -= felt[r];  // b of that one body is h
    return;
  }
  Vector6<S> carries = motion;
  const Vector6<S> own = call.correcting ? Vector6<S>::zero() : points_.a[k];
  if (node.kind == Kind::body) carries = accelerate(blocks_.pose[k], own, rows(k), eta_.data() + first, motion, force_[i], call.vdot + first);
  for (const int branch : {node.first, node.second})
    if (branch >= 0) motion_[branch] = carries, force_[branch] = Vector6<S>::zero();
}

// x = (ℳ + J)⁻¹ r with the segments that are there, whose biases are overwritten.
template <class S>
void DividedDynamics<S>::solve(const Call& call, const S* r, S* x) {
  const Call again{call.q, call.v, r, x, call.applied, call.threads, true};
  start_at(Vector6<S>::zero());
  inwards(call.threads, [&](int i) { put_together_again(again, i); });
  outwards(call.threads, [&](int i) { take_apart(again, i); });
}

template <class S>
void DividedDynamics<S>::certify(const Call& call) {
  using std::abs, std::sqrt;
  const int n = model_->nv;
  const S rounding = S(100) * epsilon<S>() * S(sqrt(S(n)));
  S last = S(0), left = S(0), solution = S(0);
  for (corrections_ = 0;; ++corrections_) {
    newton_euler_residual_gathered(*model_, blocks_, points_, call.applied, call.vdot, call.tau, residual_.data(), alpha_, interbody_, gathered_);
    solve(call, residual_.data(), delta_.data());
    solution = length(n, call.vdot), left = length(n, delta_.data());
    if (!std::isfinite(to_double(left)))
      throw EvaluationError("method 'divide-and-conquer' overflows on '" + source_.name() + "': take other units, or a wider precision");
    if (corrections_ == 0 && !(left > rounding * solution)) return;
    newton_euler_sizes(tree_, *model_, blocks_, points_, call.applied, call.v, call.vdot, call.tau, alpha_, interbody_,
                       RoundingUnits<S>{epsilon<S>() / S(2), static_cast<S>(epsilon<Wider<S>>()) / S(2)}, sizes_);
    const bool shrinks = corrections_ == 0 || last > S(2) * left;
    if (!shrinks || corrections_ == most_corrections || !(left > rounding_of_correction(call, left))) break;
    for (int i = 0; i < n; ++i) call.vdot[i] += delta_[i];
    last = left;
  }
  const auto largest = std::max_element(delta_.begin(), delta_.end(), [](const S& x, const S& y) { return abs(x) < abs(y); });
  const int worst = static_cast<int>(largest - delta_.begin());
  left = maximum(left, most_rounding_of_corrections(call));
  if (faint_limit<S>() * solution >= left || rounding * (solution + natural_acceleration(call, worst)) >= left) return;
  refuse(to_double(S(left / solution)), worst);
}

// Of δ, of this length, along itself.
template <class S>
S DividedDynamics<S>::rounding_of_correction(const Call& call, const S& length) {
  for (size_t i = 0; i < delta_.size(); ++i) direction_[i] = delta_[i] / length;
  S bound;
  rounding_along(tree_, blocks_, [&](const S* w, S* y) { solve(call, w, y); }, direction_.data(), sizes_, &bound);
  return bound;
}

template <class S>
S DividedDynamics<S>::most_rounding_of_corrections(const Call& call) {
  const auto inverse = [&](const S* w, S* y) { solve(call, w, y); };
  const auto along = [&](const S* w) {
    S bound;
    rounding_along(tree_, blocks_, inverse, w, sizes_, &bound);
    return bound;
  };
  direction_ = delta_;
  return most_rounding(direction_, along, [&](S* w) {
    worst_residual(tree_, blocks_, sizes_, w);
    solve(call, sizes_.y.data(), w);
  });
}

// What accelerations are compared with where they are zero but for rounding: gravity and ω², for what turns over the length of the body, and the
// forces at hinges over what these move by themselves.
template <class S>
S DividedDynamics<S>::natural_acceleration(const Call& call, int coordinate) const {
  using std::abs;
  const RigidInertia<S>& own = model_->inertia[body_of(coordinate)];
  const S gravity = norm(call.applied.gravity);
  S most = maximum(gravity, ratio_or_zero(own.mass * gravity, norm(own.moment)));
  for (const Vector3<S>& omega : points_.angular_velocity) most = maximum(most, dot(omega, omega));
  for (int j = 0; j < model_->nv; ++j) most = maximum(most, S(abs(call.tau[j]) / x_[j]));
  return most;
}

template <class S>
int DividedDynamics<S>::body_of(int coordinate) const {
  return static_cast<int>(std::upper_bound(model_->v_offset.begin(), model_->v_offset.end(), coordinate) - model_->v_offset.begin()) - 1;
}

// Nothing where every hinge feels an inertia.
template <class S>
void DividedDynamics<S>::name_singular_hinge(const Call& call) {
  if (!articulated_) articulated_ = std::make_unique<RigidDynamics<S>>(source_);
  articulated_->forward_dynamics(call.q, call.v, call.tau, delta_.data(), {.form = Form::ud}, &call.applied);
}

// At the first node where growth is too large, which those that contain it inherit; where none is, at the coordinate that is off most.
template <class S>
void DividedDynamics<S>::refuse(double off, int worst) const {
  const auto at = std::find_if(growth_.begin(), growth_.end(), [](double growth) { return growth > largest_growth<S>(); });
  int k = body_of(worst);
  if (at != growth_.end()) {
    const AssemblyNode& node = assembly_.nodes()[at - growth_.begin()];
    k = node.kind == Kind::join ? assembly_.next()[node.body] : node.body;
  }
  char numbers[160];
  if (std::isfinite(off))
    std::snprintf(numbers, sizeof numbers, "by their residual accelerations may be off by %.2g after %d corrections, %.2g at most is let through", off, corrections_,
                  to_double(faint_limit<S>()));
  else
    std::snprintf(numbers, sizeof numbers, "a pivot is not positive to rounding");
  throw SingularOperatorError("method 'divide-and-conquer' loses its digits at hinge '" + tree_.hinge_names[k] + "' of body '" + tree_.body_names[k] + "' (" +
                              numbers + "): what it moves is far lighter than what is joined to it; method=\"articulated\" with form=\"ud\", or a wider " +
                              "precision, is more accurate");
}

template <class S>
size_t DividedDynamics<S>::memory() const {
  const auto held = [](const auto&... of) { return ((of.capacity() * sizeof(*of.data())) + ...); };
  size_t bytes = bytes_of_blocks(*model_) + held(assembly_.nodes(), assembly_.next(), assembly_.roots(), pieces_, rest_);
  bytes += held(lent_, points_.angular_velocity, points_.a, points_.b, points_.absorbed, alpha_, interbody_, gathered_, l_, b_, p_);
  bytes += held(x_, eta_, L_, work_, residual_, delta_, direction_, turns_, omega_, segments_, motion_, force_, growth_);
  bytes += held(sizes_.motion, sizes_.force, sizes_.coordinate, sizes_.y, sizes_.g, sizes_.f);
  return bytes + (articulated_ ? articulated_->bytes(Form::ud) : 0);
}

#define PYCRAFT_INSTANTIATE(S) template class DividedDynamics<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
