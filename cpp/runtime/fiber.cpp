#include "runtime/fiber.h"

#include <algorithm>
#include <atomic>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "runtime/errors.h"
#include "runtime/interrupt.h"
#include "runtime/without_interrupts.h"

#if defined(__x86_64__) && !defined(_WIN32)
#include <sys/mman.h>
#endif
#if defined(__has_feature)  // Clang's names
#if __has_feature(address_sanitizer)
#define __SANITIZE_ADDRESS__
#endif
#if __has_feature(thread_sanitizer)
#define __SANITIZE_THREAD__
#endif
#endif
#if defined(__SANITIZE_ADDRESS__)
#include <sanitizer/common_interface_defs.h>
#endif
#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace pycraft {

#if defined(__x86_64__) && !defined(_WIN32)

namespace {

thread_local Fiber* running = nullptr;

// What runs hold, with room for what the general recursions and Eigen put on a stack. Pages that are never touched cost nothing.
constexpr std::size_t stack_size = 1 << 20, guard_size = 1 << 16;
// Tops of stacks lie at different places in their pages: what calls touch most would share few lines of the near cache otherwise.
constexpr std::size_t line = 64, stagger = 17 * line;
std::atomic<unsigned> made{0};

// Registers that calls keep go to this stack; where it is left, to *left. The other stack goes on where it was left, with its own.
[[gnu::naked, gnu::noinline]] void switch_stacks([[maybe_unused]] void** left, [[maybe_unused]] void* to) {
  asm("pushq %rbp\n\t"
      "pushq %rbx\n\t"
      "pushq %r12\n\t"
      "pushq %r13\n\t"
      "pushq %r14\n\t"
      "pushq %r15\n\t"
      "movq %rsp, (%rdi)\n\t"
      "movq %rsi, %rsp\n\t"
      "popq %r15\n\t"
      "popq %r14\n\t"
      "popq %r13\n\t"
      "popq %r12\n\t"
      "popq %rbx\n\t"
      "popq %rbp\n\t"
      "ret");
}
// Where a fresh stack begins: the call in r12 with rbx. Below it is nothing, which unwinders are told.
[[gnu::naked, gnu::noinline]] void first_call() {
  asm(".cfi_undefined rip\n\t"
      "movq %rbx, %rdi\n\t"
      "callq *%r12\n\t"
      "ud2");
}

}  // namespace

Fiber::Fiber() {
  void* const memory = mmap(nullptr, guard_size + stack_size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) throw std::bad_alloc();
  memory_ = static_cast<std::byte*>(memory);
  top_ = memory_ + guard_size + stack_size - made++ % 32 * stagger;
  mprotect(memory_, guard_size, PROT_NONE);  // a stack that grows too far ends there
}

Fiber::~Fiber() {
  if (waits_) {
    unwinding_ = true;
    switch_in();
  }
  munmap(memory_, guard_size + stack_size);
}

void Fiber::begin(std::function<void()> f) {
  f_ = std::move(f), error_ = nullptr;
  void** top = reinterpret_cast<void**>(top_);
  *--top = nullptr, *--top = nullptr;                      // keeps what follows aligned
  *--top = reinterpret_cast<void*>(first_call);
  *--top = nullptr;                                        // rbp
  *--top = this;                                           // rbx
  *--top = reinterpret_cast<void*>(&Fiber::run);           // r12
  for (int i = 0; i < 3; ++i) *--top = nullptr;            // r13, r14, r15
  own_ = top, fake_ = nullptr, waits_ = true;
#if defined(__SANITIZE_THREAD__)
  followed_ = __tsan_create_fiber(0);
#endif
}

bool Fiber::resume() {
  switch_in();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  return waits_;
}

void Fiber::pause() {
  Fiber& self = *running;
  self.switch_out();
  if (self.unwinding_) throw Unwound{};
}

void Fiber::run(Fiber* self) noexcept {
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_finish_switch_fiber(nullptr, &self->below_, &self->size_below_);
#endif
  try {
    if (!self->unwinding_) self->f_();
  } catch (const Unwound&) {
  } catch (...) {
    self->error_ = std::current_exception();
  }
  self->f_ = nullptr, self->waits_ = false;
  self->switch_out();
}

void Fiber::switch_in() {
  Fiber* const outer = std::exchange(running, this);
#if defined(__SANITIZE_ADDRESS__)
  void* fake = nullptr;
  __sanitizer_start_switch_fiber(&fake, memory_ + guard_size, stack_size);
#endif
#if defined(__SANITIZE_THREAD__)
  thread_ = __tsan_get_current_fiber();
  __tsan_switch_to_fiber(followed_, 0);
#endif
  switch_stacks(&other_, own_);
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_finish_switch_fiber(fake, nullptr, nullptr);
#endif
#if defined(__SANITIZE_THREAD__)
  if (!waits_) __tsan_destroy_fiber(followed_);
#endif
  running = outer;
}

void Fiber::switch_out() {
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_start_switch_fiber(waits_ ? &fake_ : nullptr, below_, size_below_);
#endif
#if defined(__SANITIZE_THREAD__)
  __tsan_switch_to_fiber(thread_, 0);
#endif
  switch_stacks(&own_, other_);
#if defined(__SANITIZE_ADDRESS__)
  __sanitizer_finish_switch_fiber(fake_, &below_, &size_below_);
#endif
}

#else

Fiber::Fiber() { throw EvaluationError("there are no fibers on this machine"); }
Fiber::~Fiber() = default;
void Fiber::begin(std::function<void()>) {}
bool Fiber::resume() { return false; }
void Fiber::pause() {}

#endif

void side_by_side(int count, int lanes, const std::function<void(int)>& run, const std::function<void()>& answer) {
  std::vector<std::unique_ptr<Fiber>> fibers;
  for (int i = 0; i < std::min(lanes, count); ++i) fibers.push_back(std::make_unique<Fiber>());
  int next = 0;
  const auto begin = [&](Fiber& fiber) {
    fiber.begin([&run, i = next] { run(i); });
    ++next;
  };
  for (auto& fiber : fibers) begin(*fiber);
  for (int rounds = 0; !fibers.empty(); ++rounds) {
    {
      const WithoutInterrupts until_all_wait;  // handlers have this thread's own stack
      std::erase_if(fibers, [&](const auto& fiber) {
        while (!fiber->resume()) {
          if (next == count) return true;
          begin(*fiber);
        }
        return false;
      });
    }
    if (!fibers.empty()) answer();
    if (rounds % 16 == 15) check_interrupt();
  }
}

}  // namespace pycraft
