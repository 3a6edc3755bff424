// Dynamics of one state after another with terms at the hinges (model/hinge_terms.h): accelerations where forces are given, forces where
// accelerations are (hybrid dynamics), J with what is added to it. Nothing prescribed is forward dynamics and all is inverse dynamics, bit for bit.
//
// Everything but the numbers of a state is decided when it is made. In double precision by kernels of this machine's instruction set where they
// are sure (kernels/, prescribed_links.h; what is prescribed in a factored form, or refined, is not for them); else by the general recursions
// (recursions/prescribed_hinges.h). No allocation after the first call of each.
#pragma once

#include <memory>
#include <new>
#include <string>
#include <vector>

#include "dynamics/rigid_dynamics.h"
#include "kernels/instruction_set.h"
#include "kernels/link_model.h"

namespace pycraft {

class StatesTogether;

// Where kernels are asked for one state: their memory, and all that is the same for every state.
class PreparedLinks {
 public:
  // wrenched: the bodies that may carry wrenches.
  PreparedLinks(const Multibody& model, const HingeTerms& terms, const Solving& how, const Vector3<double>& gravity, const std::vector<int>& wrenched);

  // Whether there is a kernel for it.
  bool there() const { return kernel_.run; }
  // False where the state is in doubt, or a number left its range.
  bool run(const double* q, const double* v, const double* u, const Vector6<double>* wrenches, double* out) {
    ask(q, v, u, wrenches, out);
    return answer();
  }
  void add_to_hinges(const double* inertia);

  // The same in two steps: what is asked is kept until it is answered.
  void ask(const double* q, const double* v, const double* u, const Vector6<double>* wrenches, double* out);
  bool answer();

  // Whether two states, as they were asked, can be in one pack: of one call, of links that have the same numbers.
  bool fits(const PreparedLinks& other) const;
  // Why a state cannot be in a pack with any other, empty: it can.
  std::string alone() const;
  long in_packs() const { return in_packs_; }  // how many states of it were

 private:
  void carry(const Vector6<double>* wrenches);
  struct Free {
    void operator()(double* x) const { ::operator delete(x, std::align_val_t(64)); }
  };
  const Multibody& of_;
  HingeTerms terms_;
  kernels::Call call_ = kernels::Call::forward_dynamics;
  std::unique_ptr<kernels::LinkModel<double>> model_;
  kernels::Kernel<double> kernel_{};
  kernels::States<double> states_{};
  double gravity_[3];
  int nv_;
  std::vector<int> wrenched_;
  std::vector<double> on_links_, no_forces_, added_;  // added_: to J, where steps are implicit
  double* out_ = nullptr;
  long in_packs_ = 0;
  friend class StatesTogether;
  std::unique_ptr<double, Free> work_;
};

template <class S>
class HybridDynamics {
 public:
  HybridDynamics(const Multibody& model, const HingeTerms& terms, const Solving& how, const Vector3<double>& gravity, const std::vector<int>& wrenched = {});

  // v null: at rest. u: generalized forces, at prescribed coordinates accelerations; null: no forces. wrenches: (n; f) on every body in its
  // axes about its origin, read at the bodies that were named; null: none. out: accelerations, at prescribed coordinates forces.
  // Returns whether all of them are finite. SingularHingeError names the coordinate.
  bool run(const S* q, const S* v, const S* u, const Vector6<S>* wrenches, S* out);
  // What J has in addition at coordinates that are driven, until it is set again; of all coordinates.
  void add_to_hinges(const S* inertia);
  // Whether kernels are asked first.
  bool by_kernels() const { return links_ != nullptr; }
  // From now on states wait in a fiber for those of others (states_together.h); null: no more. By kernels alone.
  void wait_for(StatesTogether* others) { others_ = others; }
  StatesTogether* others() const { return others_; }
  const PreparedLinks* links() const { return links_.get(); }
  // run(), by kernels alone, in two halves: between them the kernels answer what was asked.
  PreparedLinks* ask(const S* q, const S* v, const S* u, const Vector6<S>* wrenches, S* out) {
    if constexpr (std::is_same_v<S, double>) links_->ask(q, v, u, wrenches, out);
    return links_.get();
  }
  bool answer(bool sound, const S* q, const S* v, const S* u, const Vector6<S>* wrenches, S* out) { return sound || generally(q, v, u, wrenches, out); }

 private:
  enum class Given { forces, accelerations, both };
  bool generally(const S* q, const S* v, const S* u, const Vector6<S>* wrenches, S* out);

  const Multibody& model_;
  HingeTerms terms_;
  Solving how_;
  Given given_;
  Applied<S> applied_;
  std::vector<int> wrenched_;
  std::unique_ptr<PreparedLinks> links_;
  StatesTogether* others_ = nullptr;
  std::unique_ptr<RigidDynamics<S>> general_;  // made where it is first needed
  std::vector<int> free_;
  std::vector<S> none_, forces_, results_, added_;
  std::vector<Vector6<S>> all_wrenches_;
};

extern template class HybridDynamics<double>;
extern template class HybridDynamics<Extended>;
extern template class HybridDynamics<Quad>;

}  // namespace pycraft
