// What a scene is held against: forward dynamics by the bare kernel, and with one effect written out by hand around it.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "kernels/instruction_set.h"
#include "kernels/link_model.h"
#include "model/hinge_kinematics.h"
#include "runtime/errors.h"
#include "runtime/interrupt.h"

namespace pycraft {

class ByHand {
 public:
  // what: "nothing", "gravity", "damping", "spring", "friction", "motor" on all coordinates; "wrench" of the world on the last body.
  ByHand(const Multibody& model, const std::string& what)
      : what_(find(what)), links_(kernels::LinkModel<double>::of(model)), numbers_(model.compiled<double>()), tau_(model.nv()), rows_(6) {
    if (!links_) throw EvaluationError("there is no kernel for '" + model.name() + "'");
    kernel_ = kernels::instruction_set().one[kernels::Call::forward_dynamics];
    const size_t numbers = kernel_.work(links_->links(), 0) + 8;
    work_.resize(numbers + 8);
    aligned_ = work_.data() + (8 - reinterpret_cast<std::uintptr_t>(work_.data()) / sizeof(double) % 8) % 8;
    states_.states = 1, states_.gravity = gravity_, states_.interrupt = check_interrupt;
    if (what_ == Effect::gravity) gravity_[2] = -9.81;
    if (what_ == Effect::wrench) {
      for (int k = model.bodies() - 1; k >= 0; k = numbers_->parent[k]) way_.push_back(k);
      on_links_.assign(size_t(6) * links_->links().count, 0.0);
      states_.wrenches = on_links_.data();
    }
  }

  void run(const double* q, const double* v, double* out) {
    states_.q = q, states_.v = v, states_.u = nullptr;
    const int n = numbers_->nv;
    double* const u = tau_.data();
    switch (what_) {
      case Effect::nothing:
      case Effect::gravity: break;
      case Effect::damping:
        for (int j = 0; j < n; ++j) u[j] = -0.1 * v[j];
        states_.u = u;
        break;
      case Effect::spring:
        for (int j = 0; j < n; ++j) u[j] = -2.0 * (q[j] - 0.1);
        states_.u = u;
        break;
      case Effect::friction:
        for (int j = 0; j < n; ++j) u[j] = -0.3 * std::tanh(v[j] / 0.01);
        states_.u = u;
        break;
      case Effect::motor:
        for (int j = 0; j < n; ++j) u[j] = 5.0 * (0.5 - v[j] / 100.0);
        states_.u = u;
        break;
      case Effect::wrench: push(q); break;
    }
    kernel_.run(links_->links(), states_, out, n, aligned_);
  }

 private:
  enum class Effect { nothing, gravity, damping, spring, friction, motor, wrench };
  static Effect find(const std::string& what) {
    const char* const names[] = {"nothing", "gravity", "damping", "spring", "friction", "motor", "wrench"};
    for (int i = 0; i < 7; ++i)
      if (what == names[i]) return static_cast<Effect>(i);
    throw EvaluationError("nothing is written out by hand as '" + what + "'");
  }
  // The axes of the last body, from the base outward, and the wrench turned to them.
  void push(const double* q) {
    Matrix3<double> R = Matrix3<double>::identity();
    for (size_t i = way_.size(); i-- > 0;) R = R * hinge_kinematics(*numbers_, way_[i], q, rows_.data()).R;
    const int k = way_.front();
    const Vector6<double> w = links_->on_its_link(k, {transpose_times(R, Vector3<double>{1, 2, 3}), transpose_times(R, Vector3<double>{4, 5, 6})});
    for (int i = 0; i < 6; ++i) on_links_[size_t(6) * links_->link_carrying(k) + i] = w[i];
  }

  Effect what_;
  std::unique_ptr<kernels::LinkModel<double>> links_;
  std::shared_ptr<const CompiledModel<double>> numbers_;
  kernels::Kernel<double> kernel_;
  kernels::States<double> states_{};
  double gravity_[3] = {0, 0, 0};
  std::vector<double> tau_, work_, on_links_;
  std::vector<Vector6<double>> rows_;
  std::vector<int> way_;
  double* aligned_;
};

}  // namespace pycraft
