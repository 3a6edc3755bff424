// Hinges locked where they are, and unlocked.
//
// A locked hinge is a weld of the same name: with P the placement and S(q) the steps of its subhinges it stands at P S(q), which is kept to the
// last bit. Unlocked it is what it was, at the q it was locked at: its placement is P while the weld stands where the lock put it, and where
// that was moved, to X, it is X S(q)⁻¹. Products are rounded once, from long double. O(N), of integers and coordinates alone.
#pragma once

#include <string>
#include <vector>

#include "model/structure_edits.h"

namespace pycraft {

struct StructureEdits::LockedHinges {
  // The hinges of these bodies become welds. v: of all coordinates as they are numbered before, those of the locked ones unread.
  static void lock(Multibody& model, const std::vector<int>& bodies, const std::vector<double>& v);

  struct Unlocked {
    Hinge hinge;             // as it was
    std::vector<double> q;   // where it was locked
    Pose<double> welded;     // its placement as a weld
  };
  // At rest in their own coordinates: nothing moves otherwise than before. ModelError, and the model as it was, where names clash.
  static void unlock(Multibody& model, std::vector<Unlocked> hinges);

 private:
  // Hinges that were exchanged, each with the hinge that the body had, and its coordinates now. Neither bodies nor names have changed: coordinates
  // are numbered anew, and the others stay what they are.
  struct Exchanged {
    int body;
    Hinge before;
    std::vector<double> q;
  };
  static void exchanged(Multibody& model, const std::vector<Exchanged>& hinges, const double* v, const char* what);
};

}  // namespace pycraft
