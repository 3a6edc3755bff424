#include "runtime/interrupt.h"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>

#include "runtime/errors.h"
#include "runtime/without_interrupts.h"

#if __has_include(<pthread.h>) && !defined(_WIN32)
#include <pthread.h>
#define PYCRAFT_PTHREADS
#else
#include <thread>
#endif

namespace pycraft {

namespace {

std::atomic<void (*)()> asked{nullptr};
constexpr auto pause = std::chrono::milliseconds(50);

// Of a thread that works for another one, which asks in its stead.
thread_local const std::atomic<bool>* stopped = nullptr;
struct Stopped {};
thread_local int undisturbed = 0;

}  // namespace

void set_interrupt_check(void (*check)()) { asked = check; }

WithoutInterrupts::WithoutInterrupts() { ++undisturbed; }
WithoutInterrupts::~WithoutInterrupts() { --undisturbed; }

void check_interrupt() {
  if (undisturbed) return;
  if (stopped) {
    if (stopped->load(std::memory_order_relaxed)) throw Stopped{};
    return;
  }
  thread_local std::chrono::steady_clock::time_point last{};
  const auto now = std::chrono::steady_clock::now();
  if (now - last < pause) return;
  last = now;
  if (auto check = asked.load()) check();
}

namespace {

// Levels that any stack holds, and what a level takes at most (planning: some 10 kB, sanitized builds several times that).
constexpr int shallow = 50;
constexpr size_t bytes_a_level = 48 << 10, least_bytes = 16 << 20;
thread_local int room = shallow;

struct Work {
  const std::function<void()>& f;
  int depth;
  std::atomic<bool> stop{false};
  std::exception_ptr error;
  std::mutex mutex;
  std::condition_variable changed;
  bool done = false;

  void run() {
    stopped = &stop;
    room = depth;
    try {
      f();
    } catch (const Stopped&) {
    } catch (...) {
      error = std::current_exception();
    }
    std::lock_guard<std::mutex> lock(mutex);
    done = true;
    changed.notify_all();
  }
  // Until it is over, or an interrupt ends it.
  void wait() {
    std::exception_ptr interrupted;
    std::unique_lock<std::mutex> lock(mutex);
    while (!changed.wait_for(lock, pause, [&] { return done; })) {
      if (interrupted) continue;
      lock.unlock();
      try {
        check_interrupt();
      } catch (...) {
        interrupted = std::current_exception();
        stop = true;
      }
      lock.lock();
    }
    if (interrupted) error = interrupted;
  }
};

[[noreturn]] void throw_too_deep(int depth) {
  throw EvaluationError("an expression is nested " + std::to_string(depth) + " levels deep: there is no stack for that; evaluate a part of it, and go on with it as a constant");
}

}  // namespace

void with_stack_for(int depth, const std::function<void()>& f) {
  if (depth <= room) return f();
  if (depth > deepest) throw_too_deep(depth);
  Work work{f, depth};
#if defined(PYCRAFT_PTHREADS)
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_t thread;
  const bool made = pthread_attr_setstacksize(&attributes, least_bytes + size_t(depth) * bytes_a_level) == 0 &&
                    pthread_create(&thread, &attributes, [](void* w) -> void* { return static_cast<Work*>(w)->run(), nullptr; }, &work) == 0;
  pthread_attr_destroy(&attributes);
  if (!made) throw_too_deep(depth);
  work.wait();
  pthread_join(thread, nullptr);
#else
  std::thread thread([&] { work.run(); });
  work.wait();
  thread.join();
#endif
  if (work.error) std::rethrow_exception(work.error);
}

}  // namespace pycraft
