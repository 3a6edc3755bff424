#include "dynamics/divided_dynamics.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "model/hinge_kinematics.h"
#include "model/multibody.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

using Kind = AssemblyNode::Kind;

// Ratios of pivots down to this are those of long chains, and do not add up to a loss.
constexpr double common_ratio = 1.0 / 1024;

// Growth from which on accelerations may be off by more than faint_error().
template <class S>
double largest_growth() {
  return common_ratio * to_double(faint_error<S>()) / to_double(epsilon<S>());
}

// Ratio of the inertias of a model from which on they may be: a light segment that is joined to a heavy one is rounded at what that weighs, and
// where no pivot cancels growth says nothing of it.
template <class S>
double largest_spread() {
  return to_double(faint_error<S>()) / to_double(epsilon<S>());
}

// Of numbers in one unit, those that are none left out, the largest over the smallest.
struct Spread {
  double least = HUGE_VAL, most = 0;
  void add(double x) {
    if (x > 0) least = std::min(least, x), most = std::max(most, x);
  }
  double ratio() const { return most > 0 ? most / least : 1; }
};

}  // namespace

template <class S>
DividedDynamics<S>::DividedDynamics(const Multibody& model)
    : source_(model), tree_(model.structure()), model_(model.compiled<S>()), assembly_(model_->parent) {
  const size_t bodies = model_->bodies, coordinates = model_->nv, nodes = assembly_.nodes().size();
  pose_.resize(bodies), lent_.resize(bodies);
  size_t numbers = 0;
  for (const int n : model_->nv_of) l_.push_back(numbers), numbers += size_t(n) * n;
  for (auto* rows : {&H_, &b_, &p_}) rows->resize(coordinates);
  x_.resize(coordinates), eta_.resize(coordinates), L_.resize(numbers), work_.resize(2 * coordinates);
  turns_.resize(nodes), omega_.resize(nodes), segments_.resize(nodes), motion_.resize(nodes), force_.resize(nodes), growth_.resize(nodes);
  lend_inertias();
}

// A body's own inertia about its frame's origin, turned into a sphere's, or where it has none that of what it carries; lent to the body that it
// hangs on.
template <class S>
void DividedDynamics<S>::lend_inertias() {
  std::vector<LentInertia<S>> own(model_->bodies), carried(model_->bodies);
  Spread masses, rotational;
  for (int k = model_->bodies - 1; k >= 0; --k) {
    const RigidInertia<S>& M = model_->inertia[k];
    const S trace = M.rotational(0, 0) + M.rotational(1, 1) + M.rotational(2, 2);
    masses.add(to_double(M.mass)), rotational.add(to_double(trace));
    own[k] = {M.mass > S(0) ? M.mass : carried[k].mass, trace > S(0) ? S(trace / S(2)) : carried[k].rotational};
    const Vector3<S>& l = model_->placement[k].p;
    const LentInertia<S> seen{own[k].mass, own[k].rotational + own[k].mass * dot(l, l)};
    const int p = model_->parent[k];
    if (p < 0) continue;
    carried[p].mass += seen.mass, carried[p].rotational += seen.rotational;
    if (assembly_.next()[p] == k) lent_[p] = seen;
  }
  spread_ = std::max(masses.ratio(), rotational.ratio());
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
  const Call call{q, v, tau, vdot, applied};
  points_.resize(model_->bodies, model_->nv);
  for (const int root : assembly_.roots()) {
    omega_[root] = Vector3<S>::zero();
    motion_[root] = applied.base();
    force_[root] = Vector6<S>::zero();
  }
  inwards(threads, [&](int i) { turn(call, i); });
  outwards(threads, [&](int i) { move(call, i); });
  inwards(threads, [&](int i) { put_together(call, i); });
  double growth = 1;
  for (const int root : assembly_.roots()) growth = std::max(growth, growth_[root]);
  if (std::isfinite(growth)) outwards(threads, [&](int i) { take_apart(call, i); });
  if (growth > largest_growth<S>() || spread_ > largest_spread<S>()) judge(call, growth);
  for (int i = 0; i < model_->nv; ++i) vdot[i] -= points_.absorbed[i];
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
    pose_[k] = hinge_kinematics(*model_, k, call.q, H_.data() + first);
    Vector3<S> w = Vector3<S>::zero();
    for (int j = first; j < first + model_->nv_of[k]; ++j) w = w + call.v[j] * H_[j].angular;
    turns_[i] = {pose_[k].R, w};
  }
}

template <class S>
void DividedDynamics<S>::move(const Call& call, int i) {
  const AssemblyNode& node = assembly_.nodes()[i];
  Vector3<S> inner = omega_[i], outer = omega_[i];
  if (node.kind == Kind::join) outer = turns_[node.first].of(inner);
  if (node.kind == Kind::body) {
    point_acceleration(*model_, node.body, &omega_[i], pose_.data(), H_.data(), call.v, OwnTerms::absorbed, points_);
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
    hinge.b[j] = H_[first + j];
    hinge.x[j] = model_->rotor_inertia[first + j];
    plain &= hinge.x[j] == S(0);
    eta_[first + j] = call.tau[first + j];
  }
  const auto annihilates = [&](int row) {
    const auto aligned = model_->aligned.begin() + first;
    return plain && std::find(aligned, aligned + n, row) != aligned + n;
  };
  const Vector6<S>& a = points_.a[k];
  return segment_of_body(pose_[k], P, sizes, z + P * a, a, hinge, eta_.data() + first, work_.data() + 2 * first, annihilates, segments_[i]);
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
  if (node.kind == Kind::body) carries = accelerate(pose_[k], points_.a[k], rows(k), eta_.data() + first, motion, force_[i], call.vdot + first);
  for (const int branch : {node.first, node.second})
    if (branch >= 0) motion_[branch] = carries, force_[branch] = Vector6<S>::zero();
}

template <class S>
void DividedDynamics<S>::judge(const Call& call, double growth) {
  using std::sqrt;
  if (!articulated_) articulated_ = std::make_unique<RigidDynamics<S>>(source_);
  expected_.resize(model_->nv);
  articulated_->forward_dynamics(call.q, call.v, call.tau, expected_.data(), {.form = Form::ud}, &call.applied);
  double off = 1;
  int worst = 0;
  if (std::isfinite(growth)) {
    S squares = S(0), all = S(0), most = S(0);
    for (int i = 0; i < model_->nv; ++i) {
      expected_[i] += points_.absorbed[i];
      const S difference = call.vdot[i] - expected_[i], square = difference * difference;
      squares += square, all += expected_[i] * expected_[i];
      if (square > most) most = square, worst = i;
    }
    off = to_double(S(sqrt(ratio_or_zero(squares, all))));
  }
  if (!(off <= to_double(faint_limit<S>()))) refuse(off, worst);
}

// At the first node where growth is too large, which those that contain it inherit; where none is, at the coordinate that is off most.
template <class S>
void DividedDynamics<S>::refuse(double off, int worst) const {
  const auto at = std::find_if(growth_.begin(), growth_.end(), [](double growth) { return growth > largest_growth<S>(); });
  int k = static_cast<int>(std::upper_bound(model_->v_offset.begin(), model_->v_offset.end(), worst) - model_->v_offset.begin()) - 1;
  if (at != growth_.end()) {
    const AssemblyNode& node = assembly_.nodes()[at - growth_.begin()];
    k = node.kind == Kind::join ? assembly_.next()[node.body] : node.body;
  }
  char numbers[120];
  std::snprintf(numbers, sizeof numbers, "accelerations are off by %.2g of those of the articulated method, %.2g at most is let through", off,
                to_double(faint_limit<S>()));
  throw SingularOperatorError("method 'divide-and-conquer' loses its digits at hinge '" + tree_.hinge_names[k] + "' of body '" + tree_.body_names[k] + "' (" +
                              numbers + "): what it moves is far lighter than what is joined to it; method=\"articulated\" with form=\"ud\", or a wider " +
                              "precision, is more accurate");
}

template <class S>
size_t DividedDynamics<S>::memory() const {
  const size_t bodies = model_->bodies, nodes = assembly_.nodes().size(), six = sizeof(Vector6<S>), three = sizeof(Vector3<S>);
  const size_t body = sizeof(LentInertia<S>) + sizeof(Pose<S>) + sizeof(RigidInertia<S>) + three + 2 * six;
  const size_t node = sizeof(AssemblyNode) + sizeof(Turn) + three + sizeof(Segment<S>) + 2 * six;
  return bodies * body + nodes * node + model_->nv * (3 * six + 6 * sizeof(S)) + L_.size() * sizeof(S);
}

#define PYCRAFT_INSTANTIATE(S) template class DividedDynamics<S>;
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_INSTANTIATE)
#undef PYCRAFT_INSTANTIATE

}  // namespace pycraft
