// Direct calls by the kernels of this machine's instruction set (cpp/kernels): the plain case of forward dynamics, inverse dynamics, the mass
// matrix, its inverse, the derivatives of both dynamics, Coriolis matrices and operational-space inertias, one state or packs of states. What kernels leave in doubt is the general recursions' to decide (rigid_dynamics.h).
#pragma once

#include <algorithm>
#include <memory>
#include <new>
#include <vector>

#include "dynamics/batches.h"
#include "dynamics/subtrees.h"
#include "kernels/instruction_set.h"
#include "kernels/link_model.h"
#include "numerics/arithmetic.h"
#include "recursions/applied.h"
#include "runtime/interrupt.h"

namespace pycraft {

// Forward dynamics in a form, as it comes from the sweep or refined.
inline kernels::Call forward_dynamics_call(Form form, const Refinement& how = {}) {
  using kernels::Call;
  constexpr Call calls[3][3] = {{Call::forward_dynamics, Call::refined_dynamics, Call::gathered_dynamics},
                                {Call::forward_dynamics_ud, Call::refined_dynamics_ud, Call::gathered_dynamics_ud},
                                {Call::forward_dynamics_square_root, Call::refined_dynamics_square_root, Call::gathered_dynamics_square_root}};
  return calls[static_cast<int>(form)][how.steps == 0 ? 0 : how.gathers_wider() ? 2 : 1];
}

// A call of kernels: at what, under what, of what.
struct LinkCall {
  kernels::Call call;
  const Given& q;
  const Given *v = nullptr, *u = nullptr;
  const Applied<double>* applied = nullptr;  // null: the model's gravity alone
  const Node* node = nullptr;                // of what is asked of nodes: so many of them
  int nodes = 1;
  double* const* others = nullptr;           // where the second and third result go
  int threads = 1;                           // that share the subtrees of one state
  int steps = 0;                             // of refined calls: corrections at most
};

// Of one model, for T from single to quad. Memory is kept from call to call.
template <class T>
class LinkDynamics {
 public:
  // What is prescribed is for forward dynamics alone, in the form fast: u and results are forces and accelerations, there the other way round.
  explicit LinkDynamics(const Multibody& model, const HingeTerms& terms = {})
      : set_(kernels::instruction_set()), model_(kernels::LinkModel<T>::of(model, terms)), nv_(model.nv()) {
    for (int i = 0; i < 3; ++i) gravity_[i] = static_cast<T>(model.gravity()[i]);
  }

  // Whether kernels know the model and the call.
  bool there(kernels::Call call) const {
    return model_ && chosen(call, 1, false)[call].run;
  }

  // At `count` states, `size` numbers a state to out + b size, and as many to each of the two others of a call that has three results;
  // again(from, to) is called for runs of states in doubt.
  template <class Again>
  void run(const LinkCall& asked, int count, int size, double* out, Again again) {
    using kernels::Call;
    const auto& [call, q, v, u, applied, node, nodes, others, threads, steps] = asked;
    T gravity[3];
    const T* wrenches = nullptr;
    std::copy_n(gravity_, 3, gravity);
    if (applied) {
      for (int i = 0; i < 3; ++i) gravity[i] = static_cast<T>(applied->gravity[i]);
      if (applied->wrenches) wrenches = carried(*applied);
    }
    if (call >= Call::forward_dynamics_ud) model_->find_factors();
    const bool matrix = is_matrix(call);
    const auto stride = [](const Given& g) { return g.batch < 0 ? size_t(0) : size_t(g.width); };
    place(node, node ? nodes : 0);
    int doubted = 0;  // how many states before b are in doubt
    for (int b = 0; b < count;) {
      const kernels::Kernels<T>& kernel = chosen(call, count - b, matrix);
      const kernels::Kernel<T>& how = kernel[call];
      const int lanes = std::min(kernel.lanes, count - b);
      double* of_these[2] = {};
      for (int i = 0; others && i < 2; ++i) of_these[i] = others[i] + size_t(b) * size;
      const kernels::States<T> states{q.at(b), v ? v->at(b) : nullptr, u ? u->at(b) : nullptr, stride(q), v ? stride(*v) : 0, u ? stride(*u) : 0, lanes, gravity, wrenches, check_interrupt, on_nodes_.data(), static_cast<int>(on_nodes_.size()), of_these, nullptr, nullptr, T(0), steps};
      T* const memory = work(how.work(model_->links(), states.nodes));
      double* const to = out + size_t(b) * size;
      const bool pieces = count == 1 && threads > 1 && in_parts(call, kernel);
      const unsigned sound = pieces ? InParts<T>(kernel.in_parts[static_cast<int>(call)], model_->links(), model_->parts(), threads, to, memory).run(states)
                                    : how.run(model_->links(), states, to, size, memory);
      for (const int end = b + lanes, first = b; b < end; ++b) {
        const bool sure = (sound >> (b - first) & 1) && (matrix || all_finite(out + size_t(b) * size, size));
        if (sure && doubted > 0) again(b - doubted, b);
        doubted = sure ? 0 : doubted + 1;
      }
      if (b % 1024 < lanes) check_interrupt();
    }
    if (doubted > 0) again(count - doubted, count);
  }

 private:
  // Of all coordinates: kernels look through those for what is not finite themselves.
  static bool is_matrix(kernels::Call call) {
    using kernels::Call;
    return (call >= Call::mass_matrix && call <= Call::forward_dynamics_derivatives) || call == Call::coriolis_matrix || call == Call::skew_coriolis_matrix;
  }
  // Nodes where links carry them, in the links' order.
  void place(const Node* node, int nodes) {
    on_nodes_.resize(nodes);
    for (int i = 0; i < nodes; ++i) on_nodes_[i] = model_->on_link(node[i]), on_nodes_[i].place = i;
    std::sort(on_nodes_.begin(), on_nodes_.end(), [](const auto& a, const auto& b) { return a.link != b.link ? a.link < b.link : a.place < b.place; });
  }
  // Matrices of many coordinates have rows enough to fill registers with, and packs of them would not fit near memory.
  const kernels::Kernels<T>& chosen(kernels::Call call, int states, bool matrix) const {
    if constexpr (std::is_same_v<T, double>)
      return states == 1 || (matrix && nv_ > 48) || !set_.pack[call].run ? set_.one : set_.pack;
    else if constexpr (std::is_same_v<T, Single>)
      return states <= set_.few_singles.lanes ? set_.few_singles : set_.singles;
    else if constexpr (std::is_same_v<T, Extended>)
      return kernels::extended_one;
    else
      return kernels::quad_one;
  }
  bool in_parts(kernels::Call call, const kernels::Kernels<T>& kernel) const {
    return call <= kernels::Call::inverse_dynamics && kernel.in_parts[0].begin && !model_->parts().empty();
  }
  T* work(size_t numbers) {
    if (numbers > size_) {
      work_.reset(static_cast<T*>(::operator new(numbers * sizeof(T), std::align_val_t(64))));
      size_ = numbers;
    }
    return work_.get();
  }
  const T* carried(const Applied<double>& applied) {
    on_bodies_.resize(model_->bodies());
    for (size_t k = 0; k < on_bodies_.size(); ++k) on_bodies_[k] = cast<T>(applied.wrenches[k]);
    model_->wrenches_on_links(on_bodies_.data(), on_links_);
    return on_links_.data();
  }

  struct Free {
    void operator()(T* x) const { ::operator delete(x, std::align_val_t(64)); }
  };
  const kernels::InstructionSet& set_;
  std::unique_ptr<kernels::LinkModel<T>> model_;
  int nv_;
  T gravity_[3];
  std::unique_ptr<T, Free> work_;
  size_t size_ = 0;
  std::vector<Vector6<T>> on_bodies_;
  std::vector<T> on_links_;
  std::vector<kernels::OnLink<T>> on_nodes_;
};

}  // namespace pycraft
