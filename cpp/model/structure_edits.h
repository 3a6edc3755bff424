// Edits of a structure that stands: bodies hung elsewhere, hinges changed. The state is carried over by hinge name, operators and parts become
// stale. Each checks its numbers first and leaves the model as it was where they are none. O(N) at the next look at the model.
#pragma once

#include <string>
#include <vector>

#include "model/multibody.h"

namespace pycraft {

struct StructureEdits {
  // A body, with all outboard of it, on another hinge (or the same) of another body, node, or the base (empty). `hinge` is complete with its
  // name and its placement on `parent`; q and v are its coordinates there. A hinge of no coordinates leaves a body that is welded.
  static void rehang(Multibody& model, const std::string& body, const std::string& parent, Hinge hinge, const std::vector<double>& q,
                     const std::vector<double>& v);

  struct LockedHinges;  // locked_hinges.h
  struct Coalescing;    // coalescing.h
};

}  // namespace pycraft
