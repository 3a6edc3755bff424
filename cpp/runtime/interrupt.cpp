#include "runtime/interrupt.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "runtime/errors.h"
#include "runtime/without_interrupts.h"

#if __has_include(<pthread.h>) && !defined(_WIN32)
#include <pthread.h>
#define PYCRAFT_PTHREADS
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

// What threads that work for this one share with it.
class Crew {
 public:
  explicit Crew(int threads) : working_(threads) {}

  // f() in one of them: to its end, its first error or an interrupt. What it throws goes to `error`.
  template <class F>
  void work(F f, std::exception_ptr& error) {
    stopped = &stop_;
    try {
      f();
    } catch (const Stopped&) {
    } catch (...) {
      error = std::current_exception();
    }
    leave();
  }
  // One of them is done, or never began.
  void leave() {
    std::lock_guard<std::mutex> lock(mutex_);
    --working_;
    changed_.notify_all();
  }
  // Until all are; the interrupt that ended them.
  std::exception_ptr wait() {
    std::exception_ptr interrupted;
    std::unique_lock<std::mutex> lock(mutex_);
    while (!changed_.wait_for(lock, pause, [&] { return working_ == 0; })) {
      if (interrupted) continue;
      lock.unlock();
      try {
        check_interrupt();
      } catch (...) {
        interrupted = std::current_exception();
        stop_ = true;
      }
      lock.lock();
    }
    return interrupted;
  }

 private:
  std::atomic<bool> stop_{false};
  std::mutex mutex_;
  std::condition_variable changed_;
  int working_;
};

// One on a stack of its own.
struct Work {
  const std::function<void()>& f;
  int depth;
  std::exception_ptr error;
  Crew crew{1};

  void run() {
    room = depth;
    crew.work(f, error);
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
  const std::exception_ptr interrupted = work.crew.wait();
  pthread_join(thread, nullptr);
#else
  std::thread thread([&] { work.run(); });
  const std::exception_ptr interrupted = work.crew.wait();
  thread.join();
#endif
  if (interrupted) std::rethrow_exception(interrupted);
  if (work.error) std::rethrow_exception(work.error);
}

void share_out(int from, int to, int threads, const std::function<void(int, int)>& f) {
  constexpr long most_at_once = 16;  // few enough for an even end, enough for threads that seldom write to one line of memory
  const long at_once = std::clamp((long(to) - from) / (4L * threads), 1L, most_at_once);
  std::atomic<long> next{from}, end{to};  // all before `end` are done, also where one of them fails
  std::mutex first;
  std::exception_ptr error;
  const auto work = [&](int thread) {
    for (long start; (start = next.fetch_add(at_once)) < end;)
      for (long i = start; i < std::min(start + at_once, end.load()); ++i) try {
          f(thread, static_cast<int>(i));
        } catch (const Stopped&) {
          throw;
        } catch (...) {
          const std::lock_guard<std::mutex> lock(first);
          if (i < end) end = i, error = std::current_exception();
        }
  };
  Crew crew(threads);
  std::vector<std::thread> all;
  std::exception_ptr none;  // errors of work are kept above
  try {
    for (int t = 0; t < threads; ++t) all.emplace_back([&, t] { crew.work([&] { work(t); }, none); });
  } catch (const std::system_error&) {  // no more threads: those that there are do it
    for (int t = static_cast<int>(all.size()); t < threads; ++t) crew.leave();
  }
  if (all.empty()) work(0);
  const std::exception_ptr interrupted = crew.wait();
  for (std::thread& t : all) t.join();
  if (interrupted) std::rethrow_exception(interrupted);
  if (error) std::rethrow_exception(error);
}

}  // namespace pycraft
