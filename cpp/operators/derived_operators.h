// Models derived from a multibody model that are SKO trees again, with operators of their own that combine with the model's:
//
//   some coordinates:    H_s keeps their rows of H, the others are locked (hybrid dynamics: free and prescribed coordinates)
//   the world frame:     X = blockdiag φ(0,k):  E' = parent matrix ⊗ 1,  H' = HX⁻¹,  M' = XMX*
//   a cut at a hinge:    E_c = E without the block of that body: all outboard of it and the rest, each a part with a fixed base of its own
#pragma once

#include <memory>
#include <vector>

#include "operators/multibody_operators.h"

namespace pycraft {

class DerivedOperators : public SkoSource {
 public:
  Traits traits() const override;
  BlockCosts costs(int k) const override { return rigid_costs(structure(), k); }
  int nq() const override { return base_->nq(); }
  int nv() const override { return base_->nv(); }
  void check_state(const double* q, size_t nq, const double* v, size_t nv) const override { base_->check_state(q, nq, v, nv); }
  std::shared_ptr<const StateData> state() const override { return base_->state(); }
  StateData generic_state() const override { return base_->generic_state(); }
  void check_current() const override { base_->check_current(); }
  std::uint64_t parameters() const override { return base_->parameters(); }
  unsigned enter_use() const override { return base_->enter_use(); }
  void leave_use(unsigned entered) const noexcept override { base_->leave_use(entered); }
  const Multibody& model() const { return *base_->model(); }
  const std::shared_ptr<MultibodyOperators>& base() const { return base_; }

 protected:
  DerivedOperators(SkoStructure structure, const std::string& name, std::shared_ptr<MultibodyOperators> base);
  std::shared_ptr<MultibodyOperators> base_;
};

// The operators of the robot that these are derived from, or those themselves; null for a bare tree.
std::shared_ptr<MultibodyOperators> mechanics_of(const std::shared_ptr<SkoSource>& source);

// The coordinates marked in `kept` move; the others are locked.
class SomeCoordinates final : public DerivedOperators {
 public:
  SomeCoordinates(std::shared_ptr<MultibodyOperators> base, std::vector<char> kept);
  const std::vector<char>& kept() const { return kept_; }
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  std::vector<char> kept_;
};

// Two parts: a body with all outboard of it, and the rest. The body must be inboard of the last one, or that: then its part is a run at the end.
class CutTree final : public DerivedOperators {
 public:
  CutTree(std::shared_ptr<MultibodyOperators> base, int body);
  int body() const { return body_; }
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  int body_;
};

// Everything in world axes about the world's origin.
class WorldFrame final : public DerivedOperators {
 public:
  explicit WorldFrame(std::shared_ptr<MultibodyOperators> base);
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)
};

}  // namespace pycraft
