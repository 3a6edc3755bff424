// Edits of a structure that stands: bodies hung elsewhere, hinges changed, bodies copied, the root moved. The state is carried over by hinge name,
// operators and parts become stale. Each checks its numbers first and leaves the model as it was where they are none. O(N) at the next look at the
// model.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/multibody.h"

namespace pycraft {

struct StructureEdits {
  // A body, with all outboard of it, on another hinge (or the same) of another body, node, or the base (empty). `hinge` is complete with its
  // name and its placement on `parent`; q and v are its coordinates there. A hinge of no coordinates leaves a body that is welded. On another
  // body it hangs after what hangs there, as a body that is added does.
  static void rehang(Multibody& model, const std::string& body, const std::string& parent, Hinge hinge, const std::vector<double>& q,
                     const std::vector<double>& v);

  // The name of the body that a body or node belongs to, empty of the base; nothing where none is called so. O(1), between edits too: numbers, which
  // an edit makes invalid, are not asked for.
  static std::optional<std::string> body_of(const Multibody& model, const std::string& frame);

  struct LockedHinges;  // locked_hinges.h
  struct Coalescing;    // coalescing.h
  // Pose of a body on a body, node, or the base (empty), and its twist against it in the body's axes, at the present state. By the hinges between
  // the two alone, whatever the model's size.
  struct Motion {
    Pose<double> pose = Pose<double>::identity();
    Vector6<double> velocity = Vector6<double>::zero();
  };
  static Motion relative_motion(const Multibody& model, const std::string& body, const std::string& frame);

  // What copies are called, each in the order of the originals.
  struct Names {
    std::vector<std::string> bodies, hinges, nodes;
  };
  // What a body carries, with its own hinge: the bodies are a run, first to last; root -1: all bodies, and the nodes on the base.
  struct Branch {
    int first, last;
    std::vector<int> nodes;
  };
  static Branch branch(const Multibody& model, int root);
  // ModelError that lists all names of copies that are taken, in the model or among themselves: `frames` are those of copied loose frames, and
  // `loose` those of frames that there are.
  static void require_new(const Multibody& model, const Names& names, const std::vector<std::string>& frames, const std::vector<std::string>& loose);
  // Copies of a branch of `source`, which may be the model itself, with its coordinates as they are. Its root hangs on `parent`: what carries it
  // in the source is at X there, or where X is the placement of its hinge, that is at X.
  static void graft(Multibody& model, const Multibody& source, int root, const std::string& parent, const Pose<double>& X, bool places_hinge,
                    const Names& names);

  // The same motion with `body` on the free hinge that its root hangs by: hinges on the way from the root turned round, their coordinates and
  // velocities with them. `rates`, nv of them, are accelerations; returned are those of the hinges that were turned, by name.
  static std::vector<std::pair<std::string, std::vector<double>>> reroot(Multibody& model, const std::string& body, const std::vector<double>& rates);

 private:
  // The free hinge of the last body on a way to the root, over which the root can move to the first.
  static const Hinge& hinge_of_root(const Multibody& model, const std::vector<int>& way);
};

}  // namespace pycraft
