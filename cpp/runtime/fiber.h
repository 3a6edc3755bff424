// Calls that are left in the middle and gone on with later, in one thread, each on a stack of its own: code that asks for something, deep within
// loops of its own, waits there until what several of them ask for is done at once.
//
// Switching costs some nanoseconds, no call of the system. For x86-64 (System V); elsewhere there are none.
#pragma once

#include <cstddef>
#include <exception>
#include <functional>

namespace pycraft {

class Fiber {
 public:
#if defined(__x86_64__) && !defined(_WIN32)
  static constexpr bool there = true;
#else
  static constexpr bool there = false;
#endif
  Fiber();   // std::bad_alloc where there is no memory for a stack
  ~Fiber();  // a call that waits is unwound, by what pause() throws
  Fiber(const Fiber&) = delete;

  // f will be called; no call is under way.
  void begin(std::function<void()> f);
  // The call goes on until it pauses, true, or is over, false. What it throws comes through.
  bool resume();
  // In such a call, in no handler of an exception: back to who resumed it.
  static void pause();

 private:
  struct Unwound {};  // no std::exception: handlers of those let it pass
  static void run(Fiber* self) noexcept;
  void switch_in();
  void switch_out();

  std::byte *memory_ = nullptr, *top_ = nullptr;
  void *own_ = nullptr, *other_ = nullptr;  // where the stacks were left: the call's, and that of who resumed it
  std::function<void()> f_;
  std::exception_ptr error_;
  bool waits_ = false, unwinding_ = false;
  // Of sanitizers, which follow stacks.
  void *fake_ = nullptr, *thread_ = nullptr, *followed_ = nullptr;
  const void* below_ = nullptr;
  std::size_t size_below_ = 0;
};

// Calls run(0), ..., run(count - 1), `lanes` at a time in fibers of this thread: where one is over, the next begins in its place. answer() is called
// whenever all of them wait. What run or answer throws ends all; an interrupt does. Runs handle the errors that are theirs.
void side_by_side(int count, int lanes, const std::function<void(int)>& run, const std::function<void()>& answer);

}  // namespace pycraft
