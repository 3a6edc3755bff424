// What is done at the hinges of a model beside what its own numbers say: a hinge-diagonal term added to J, and coordinates whose motion is
// prescribed. A prescribed coordinate has its acceleration given and its force found; the others the other way round.
#pragma once

#include <vector>

namespace pycraft {

struct HingeTerms {
  std::vector<double> inertia;   // per coordinate, added to the rotor inertia; empty: none
  std::vector<char> driven;      // per coordinate: a term may come later, with structure made for it; empty: where there is one now
  std::vector<char> prescribed;  // per coordinate, all of a subhinge or none; empty: none

  bool empty() const { return inertia.empty() && driven.empty() && prescribed.empty(); }
  double inertia_of(int j) const { return inertia.empty() ? 0.0 : inertia[j]; }
  bool is_driven(int j) const { return inertia_of(j) != 0 || (!driven.empty() && driven[j]); }
  bool is_prescribed(int j) const { return !prescribed.empty() && prescribed[j]; }
  bool prescribes() const {
    for (char p : prescribed)
      if (p) return true;
    return false;
  }
};

}  // namespace pycraft
