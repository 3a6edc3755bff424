// Robots at the recorded scalar: by themselves, as no time is spent in them (CMakeLists.txt).
#include "numerics/recorded.h"
#include "operators/derived_values.h"
#include "operators/embedded_values.h"
#include "operators/grouped_values.h"
#include "operators/inverse_tangent_sweep.h"
#include "operators/loop_values.h"
#include "operators/rigid_letters.h"

namespace pycraft {

std::unique_ptr<SkoValues<Recorded>> MultibodyOperators::make_values(Recorded) const { return std::make_unique<RigidValues<Recorded>>(*this); }
std::unique_ptr<SkoValues<Recorded>> SomeCoordinates::make_values(Recorded) const { return std::make_unique<SubsetValues<Recorded>>(*this, base_->structure()); }
std::unique_ptr<SkoValues<Recorded>> CutTree::make_values(Recorded) const { return std::make_unique<CutValues<Recorded>>(*this); }
std::unique_ptr<SkoValues<Recorded>> WorldFrame::make_values(Recorded) const { return std::make_unique<WorldValues<Recorded>>(*this); }
std::unique_ptr<SkoValues<Recorded>> GroupedOperators::make_values(Recorded) const { return std::make_unique<GroupedValues<Recorded>>(*this); }
std::unique_ptr<SkoValues<Recorded>> EmbeddedOperators::make_values(Recorded) const { return std::make_unique<EmbeddedValues<Recorded>>(*this); }
std::unique_ptr<SkoValues<Recorded>> LoopOperators::make_values(Recorded) const { return std::make_unique<LoopValues<Recorded>>(*this); }

}  // namespace pycraft
