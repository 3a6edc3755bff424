#include "operators/derived_operators.h"

#include "operators/derived_values.h"

namespace pycraft {

namespace {

SkoStructure kept_structure(const SkoStructure& t, const std::vector<char>& kept) {
  SkoStructure s = t;
  s.coordinate_names.clear();
  s.offset.clear(), s.dof_offset.clear();
  for (int k = 0; k < t.bodies(); ++k) {
    s.dof[k] = 0;
    for (int j = t.dof_offset[k]; j < t.dof_offset[k + 1]; ++j)
      if (kept[j]) s.coordinate_names.push_back(t.coordinate_names[j]), ++s.dof[k];
  }
  s.finish();
  return s;
}

SkoStructure cut_structure(const SkoStructure& t, int body) {
  SkoStructure s = t;
  s.coordinate_names.clear();
  s.offset.clear(), s.dof_offset.clear();
  s.parent[body] = -1;
  s.finish();
  return s;
}

}  // namespace

DerivedOperators::DerivedOperators(SkoStructure structure, const std::string& name, std::shared_ptr<MultibodyOperators> base)
    : SkoSource(std::move(structure), name), base_(std::move(base)) {}

Traits DerivedOperators::traits() const {
  Traits t = base_->traits();
  t.single_dof = structure().single_dof();
  t.free_root = structure().free_root();
  t.equal_blocks = structure().equal_blocks();
  return t;
}

std::shared_ptr<MultibodyOperators> mechanics_of(const std::shared_ptr<SkoSource>& source) {
  if (auto own = std::dynamic_pointer_cast<MultibodyOperators>(source)) return own;
  if (auto derived = std::dynamic_pointer_cast<DerivedOperators>(source)) return derived->base();
  return nullptr;
}

SomeCoordinates::SomeCoordinates(std::shared_ptr<MultibodyOperators> base, std::vector<char> kept)
    : DerivedOperators(kept_structure(base->structure(), kept), base->name() + ", some coordinates", base), kept_(std::move(kept)) {
  share_bodies_with(*base_);
}
#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> SomeCoordinates::make_values(S) const { return std::make_unique<SubsetValues<S>>(*this, base_->structure()); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

CutTree::CutTree(std::shared_ptr<MultibodyOperators> base, int body)
    : DerivedOperators(cut_structure(base->structure(), body), base->name() + ", cut", base), body_(body) {
  share_bodies_with(*base_);
  share_coordinates_with(*base_);
}
#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> CutTree::make_values(S) const { return std::make_unique<CutValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

WorldFrame::WorldFrame(std::shared_ptr<MultibodyOperators> base) : DerivedOperators(base->structure(), base->name() + ", world frame", base) {
  share_bodies_with(*base_);
  share_coordinates_with(*base_);
}
#define PYCRAFT_MAKE_VALUES(S) \
  std::unique_ptr<SkoValues<S>> WorldFrame::make_values(S) const { return std::make_unique<WorldValues<S>>(*this); }
PYCRAFT_FOR_EACH_SCALAR(PYCRAFT_MAKE_VALUES)
#undef PYCRAFT_MAKE_VALUES

}  // namespace pycraft
