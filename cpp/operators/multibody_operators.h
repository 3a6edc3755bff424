// The operators of a multibody model: the SKO view that the algebra consumes, and the symbols that mechanics adds to the alphabet.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "algebra/language/expression.h"
#include "algebra/language/source.h"
#include "algebra/theorems/theorems.h"
#include "algebra/trees/tree_values.h"
#include "model/multibody.h"
#include "operators/link_inverse.h"
#include "rigid/rigid_blocks.h"

namespace pycraft {

// Records of the letters of mechanics.
const std::vector<SymbolDefinition>& mechanics_symbols();

class MultibodyOperators final : public SkoSource {
 public:
  explicit MultibodyOperators(std::shared_ptr<Multibody> model);

  const std::shared_ptr<Multibody>& model() const { return model_; }
  Traits traits() const override;
  BlockCosts costs(int k) const override { return rigid_costs(structure(), k); }
  int nq() const override { return model_->nq(); }
  int nv() const override { return model_->nv(); }
  void check_state(const double* q, size_t nq, const double* v, size_t nv) const override {
    model_->check_q(q, nq);
    model_->check_v(v, nv, "v");
  }
  std::shared_ptr<const StateData> state() const override { return model_->state(); }
  StateData generic_state() const override;
  std::uint64_t parameters() const override { return model_->parameters(); }
  unsigned enter_use() const override { return model_->enter_use(); }
  void leave_use(unsigned entered) const noexcept override { model_->leave_use(entered); }
  Space space(SpaceKind kind, const SymbolArguments& arguments) const override;
  bool tangent_of_inverse(const Expression& X, const Expression& tangent, Expression& letter, Expression& of_D) override;
  bool inverse_by_itself() const override { return true; }
  // As links, with the numbers that the model has now.
  std::shared_ptr<const KnownLinks> links() const;
  PYCRAFT_FOR_EACH_SCALAR_AND_RECORDED(PYCRAFT_OVERRIDE_MAKE_VALUES)

 private:
  std::shared_ptr<Multibody> model_;
  mutable Mutex mutex_;
  mutable std::shared_ptr<const KnownLinks> links_;
};

// The model's operators, made at the first call and again after its structure changed.
std::shared_ptr<MultibodyOperators> operators_of(const std::shared_ptr<Multibody>& model);

// Letters of a robot, or of its bodies in groups. Node operators by name (ModelError for an unknown one).
Expression node_operator(SymbolId id, const std::shared_ptr<SkoSource>& source, const std::vector<std::string>& names);
Expression mechanics_operator(SymbolId id, const std::shared_ptr<SkoSource>& source);
Expression delta_operator(const std::shared_ptr<SkoSource>& source, int coordinate);

// Theorems that need mechanics: velocities, dynamics, Coriolis matrices, gravity, other frames, hybrid dynamics.
std::vector<Theorem> mechanics_theorems(const std::shared_ptr<MultibodyOperators>& source);

}  // namespace pycraft
