// Long calls are stopped from outside, and deep recursions have a stack that is deep enough.
#pragma once

#include <functional>

namespace pycraft {

// What is asked during long runs; it throws to stop one (the bindings ask Python for Ctrl-C here).
void set_interrupt_check(void (*check)());
// Asks it, unless it was asked in this thread within the last 50 ms: costs a look at the clock. Every loop that may last comes here.
void check_interrupt();
// In loops over bodies (or pivots) k, each of some 100 operations on so many columns: small models never look at the clock.
inline void check_interrupt_at(int k, int columns = 1) {
  if ((k & 255) == 255 || columns > 64) check_interrupt();
}

// Expressions may be nested deeper than a stack holds recursions; EvaluationError above this depth.
constexpr int deepest = 200000;
// Calls f, which recurses to about this depth: on a stack of its own, in another thread, where this thread's may be too small. The
// caller waits and stays open to interrupts.
void with_stack_for(int depth, const std::function<void()>& f);

// Calls f(thread, i) for i = from, ..., to - 1 in so many threads, numbers 0, 1, ..., each of which takes the next few. Of several errors
// that of the least i is thrown, as by one thread that takes one after the other. The caller waits and stays open to interrupts.
void share_out(int from, int to, int threads, const std::function<void(int thread, int i)>& f);

}  // namespace pycraft
