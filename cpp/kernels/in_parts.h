// Forward and inverse dynamics of one state, piece by piece.
#pragma once

#include "kernels/forward_dynamics.h"
#include "kernels/inverse_dynamics.h"

namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET {

template <class T>
struct InParts {
  using S = Lanes<T, 1>;
  static ForwardWork<S> forward(const Links<T>& links, T* work) { return {links, work + turns_size(links)}; }
  static InverseLink<S>* inverse(const Links<T>& links, T* work) { return reinterpret_cast<InverseLink<S>*>(work + turns_size(links)); }

  static States<T> begin(const Links<T>& links, const States<T>& states, T* work) {
    States<T> at = with_turns(links, states, work);
    at.gone = travel<S>(links, states).v;
    return at;
  }

  static void move(const Links<T>& links, const States<T>& at, int first, int last, T* work) { move_links(links, at, forward(links, work), first, last); }
  static void clear(const Links<T>& links, int first, int last, T* work) { clear_branches(links, forward(links, work), first, last); }
  [[gnu::flatten]] static unsigned eliminate(const Links<T>& links, const States<T>& at, int first, int last, bool apart, double*, T* work) {
    return S::mask(eliminate_links<true>(links, at, forward(links, work), S(at.gone), first, last, apart));
  }
  static unsigned errors(const Links<T>& links, const States<T>& at, int first, int last, bool apart, double*, T* work) {
    return links.several ? 0 : S::mask(pivots_stand_out(links, at, forward(links, work), S(at.gone), first, last, apart));
  }
  static void join(const Links<T>& links, int root, T* work) { join_parent(links, forward(links, work), root); }
  static void accelerate(const Links<T>& links, const States<T>& at, int first, int last, double* out, T* work) {
    accelerate_links(links, at, forward(links, work), first, last, out, links.nv);
  }
  static constexpr PartKernel<T> forward_dynamics{begin, move, clear, eliminate, errors, join, accelerate};

  static void push(const Links<T>& links, const States<T>& at, int first, int last, T* work) { push_links(links, at, inverse(links, work), first, last); }
  static unsigned gather(const Links<T>& links, const States<T>& at, int first, int last, bool apart, double* out, T* work) {
    gather_links(links, at, inverse(links, work), first, last, apart, out, links.nv);
    return 1;
  }
  static void add(const Links<T>& links, int root, T* work) { add_to_parent(links, inverse(links, work), root); }
  static constexpr PartKernel<T> inverse_dynamics{begin, push, nullptr, gather, nullptr, add, nullptr};
};

}  // namespace pycraft::kernels::PYCRAFT_INSTRUCTION_SET
