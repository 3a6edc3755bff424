#include "simulation/effects/fixman.h"

#include <cmath>
#include <numeric>

#include "recursions/log_determinant.h"
#include "runtime/errors.h"
#include "simulation/effects/model_with_rotors.h"

namespace pycraft {

namespace {

template <class S>
S logarithm(const S& x) {
  using std::log;
  return log(x);
}
template <class T, int W>
Tangent<T, W> logarithm(const Tangent<T, W>& x) {
  Tangent<T, W> y(logarithm(x.x));
  for (int i = 0; i < W; ++i) y.d[i] = x.d[i] / x.x;
  return y;
}

template <class S>
class BoundFixman : public BoundEffect<S> {
 public:
  explicit BoundFixman(const Fixman& of) : of_(of), half_(S(of.kT) / S(2)), tree_(of.model.structure()), blocks_(tree_), gradient_(of.model.nv()) {}
  void begin(const HingeTerms& terms) override {
    if (terms.prescribes()) throw ModelError("fixman: its determinant is of coordinates that all move freely, and another effect prescribes some: disable that, or weld the hinge");
    numbers_ = model_with_rotors<S>(of_.model, terms);
    for (int i = 0; i < static_cast<int>(numbers_->subhinges.size()); ++i) subhinge_of_.insert(subhinge_of_.end(), record_of(numbers_->subhinges[i].kind).nv, i);
  }
  void forces(const At<S>& at, const Forces<S>& out) override {
    log_determinant_gradient(*numbers_, tree_, blocks_, subhinge_of_, at.q, LogDeterminant<S>{gradient_.data(), nullptr, nullptr, nullptr});
    for (size_t j = 0; j < gradient_.size(); ++j) out.generalized[j] -= half_ * gradient_[j];
  }
  S potential(const At<S>& at) override {
    kinematics(*numbers_, at.q, blocks_);
    articulated_inertia_tip_to_base(tree_, blocks_);
    S sum = S(0);
    for (int k = 0; k < tree_.bodies(); ++k)
      for (int j = 0; j < tree_.dof[k]; ++j) sum += logarithm(blocks_.pivots(k)[j]);
    return half_ * sum;
  }

 private:
  const Fixman& of_;
  S half_;  // ½ kT
  const SkoStructure tree_;
  RigidBlocks<S> blocks_;
  std::vector<S> gradient_;
  std::vector<int> subhinge_of_;
  std::shared_ptr<const CompiledModel<S>> numbers_;
};

}  // namespace

Declaration Fixman::declaration() const {
  Declaration d;
  d.potential = d.of_trees = true;
  d.coordinates.resize(model.nv());
  std::iota(d.coordinates.begin(), d.coordinates.end(), 0);
  return d;
}

PYCRAFT_BIND_EFFECT(Fixman, BoundFixman)

}  // namespace pycraft
