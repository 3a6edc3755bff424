// Bodies that hang on a weld made one with what carries them, and split off again.
//
// With X the weld's placement, a body c and what is coalesced with it have the inertia M_c + X M X* (lumping.h); what hung on the body hangs on c
// at X times its placement there, nodes likewise, and the body's own frame is a node at X. On the base it leaves nothing but these.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "model/structure_edits.h"

namespace pycraft {

struct StructureEdits::Coalescing {
  // What became of a body. `next`: the body that came after it among those on the same carrier, empty for none.
  struct Coalesced {
    std::string carrier, next;         // carrier: empty for the base
    Pose<double> placement;            // of its weld there
    MassProperties before{}, after{};  // of the carrier
    struct Child {
      std::string name;
      Pose<double> before, after;      // its placement on the body, and on the carrier
    };
    std::vector<Child> children;
    std::vector<std::pair<std::string, Pose<double>>> nodes;  // each with its pose on the body
  };
  // In this order, parents before their children: what hangs on a weld of a weld hangs on what carries both by then. ModelError, and the model as
  // it was, for a body that hangs on no weld.
  static std::vector<Coalesced> coalesce(Multibody& model, const std::vector<int>& bodies);

  // A body that comes back: on its weld, whose placement is the node's of its name.
  struct Split {
    Body body;
    std::string carrier;
    std::vector<std::string> places;  // it goes before the first of these that hangs on the carrier, else after what hangs there
    MassProperties carrier_mass{};    // of the carrier without it
    std::vector<std::pair<std::string, Pose<double>>> children, nodes;  // that are its own again, as far as they are on the carrier
  };
  static void split(Multibody& model, std::vector<Split> bodies);
};

}  // namespace pycraft
