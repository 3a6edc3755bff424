// A model at a state under forces and wrenches, and what kernels of forward dynamics make of it beside the general recursions in quad precision.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <new>

#include "dynamics/rigid_dynamics.h"
#include "kernels/instruction_set.h"
#include "kernels/link_model.h"
#include "tests/robot.h"

namespace pycraft::testing {

// A model with rotors of `rotor` on these bodies, a state of it, and wrenches on all bodies.
struct Case {
  std::shared_ptr<Multibody> model;
  std::vector<double> q, v, tau;
  std::vector<Vector6<double>> wrenches;
  Case(std::shared_ptr<Multibody> of, int seed, const std::vector<int>& turned = {}, double rotor = 0)
      : model(std::move(of)), v(random_numbers(model->nv(), seed)), tau(random_numbers(model->nv(), seed + 1)) {
    for (const int body : turned) model->set_rotor_inertia(body, {rotor});
    q = model->zero_q();
    const std::vector<double> more = random_numbers(model->nq(), seed + 2);
    for (size_t i = 0; i < q.size(); ++i) q[i] += more[i];
    for (int k = 0; k < model->bodies(); ++k) {
      const std::vector<double> x = random_numbers(6, 40 + k);
      wrenches.push_back({{x[0], x[1], x[2]}, {x[3], x[4], x[5]}});
    }
  }
};

// Forward dynamics of a case by a kernel, refined by so many corrections at most where it refines.
template <class T>
std::vector<double> by_kernel(const kernels::Kernel<T>& kernel, const Case& of, unsigned& sound, int steps = 3) {
  struct Free {
    void operator()(T* x) const { ::operator delete(x, std::align_val_t(64)); }
  };
  const auto model = kernels::LinkModel<T>::of(*of.model);
  model->find_factors();
  std::vector<Vector6<T>> wrenches;
  for (const auto& w : of.wrenches) wrenches.push_back(cast<T>(w));
  std::vector<T> on_links;
  std::vector<double> out(of.model->nv());
  model->wrenches_on_links(wrenches.data(), on_links);
  const Vector3<T> g = cast<T>(of.model->gravity());
  kernels::States<T> at{of.q.data(), of.v.data(), of.tau.data(), 0, 0, 0, 1, g.v, on_links.data(), [] {}};
  at.steps = steps;
  const std::unique_ptr<T, Free> work(static_cast<T*>(::operator new(kernel.work(model->links(), 0) * sizeof(T), std::align_val_t(64))));
  sound = kernel.run(model->links(), at, out.data(), out.size(), work.get());
  return out;
}

// By the general recursions, rounded to double in the end; in single precision and above.
template <class S>
std::vector<double> by_recursion(const Case& of, Form form = Form::fast, const Refinement& refinement = {}) {
  RigidDynamics<S> general(*of.model);
  std::vector<S> vdot(of.v.size());
  const Applied<double> applied{of.model->gravity(), of.wrenches.data()};
  Solving how;
  how.form = form, how.refinement = refinement;
  general.forward_dynamics(of.q.data(), of.v.data(), of.tau.data(), vdot.data(), how, &applied);
  std::vector<double> rounded;
  for (const S& x : vdot) rounded.push_back(to_double(x));
  return rounded;
}
inline std::vector<double> exact_accelerations(const Case& of) { return by_recursion<Quad>(of); }

// The relative error of the largest acceleration.
inline double off(const std::vector<double>& found, const std::vector<double>& exact) {
  double most = 0, size = 0;
  for (size_t i = 0; i < exact.size(); ++i) {
    if (!std::isfinite(found[i])) return std::numeric_limits<double>::infinity();
    most = std::max(most, std::abs(found[i] - exact[i])), size = std::max(size, std::abs(exact[i]));
  }
  return most / size;
}

// A chain of these hinges in turn with a side branch, its tip so many times as heavy as the others.
inline std::shared_ptr<Multibody> heavy_tips(const std::vector<HingeKind>& kinds, double ratio = 3e4) {
  auto model = std::make_shared<Multibody>("heavy tips");
  constexpr int n = 12;
  for (int k = 0; k < n; ++k) {
    const HingeKind kind = kinds[k % kinds.size()];
    const bool tip = k == n - 1, turned = kind == HingeKind::pin || kind == HingeKind::slider || kind == HingeKind::screw;
    const double heavy = tip ? ratio : 1;
    Body b;
    b.name = "body" + std::to_string(k), b.hinge.name = "hinge" + std::to_string(k);
    b.mass = heavy, b.com = {0.1, 0.2, 0.05}, b.inertia = {heavy, 0.1 * heavy, 0, 1.2 * heavy, 0, 0.9 * heavy};
    b.hinge.kind = kind, b.hinge.placement.p = {0.3, 0.1, 0.2};
    std::vector<Vector3<double>> axes;
    if (turned) axes = {k % 3 == 0 ? Vector3<double>{0.6, 0, 0.8} : k % 3 == 1 ? Vector3<double>{0, 0.6, -0.8} : Vector3<double>{0.48, 0.6, 0.64}};
    if (kind == HingeKind::universal) axes = {{1, 0, 0}, {0, 1, 0}};
    const bool free = kind == HingeKind::free;
    b.hinge.subhinges = subhinges_of(kind, axes, free ? Vector3<double>{0, 0, 0} : Vector3<double>{0.1, 0, 0.2}, kind == HingeKind::screw ? 0.3 : 0, b.hinge.name);
    model->add_body(b, k == 0 ? "" : k == 3 ? "body1" : "body" + std::to_string(k - 1));
  }
  model->set_gravity({0, 0, -9.81});
  return model;
}

}  // namespace pycraft::testing
