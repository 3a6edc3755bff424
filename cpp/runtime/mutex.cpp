#include "runtime/mutex.h"

#include <thread>

#if __has_include(<pthread.h>) && !defined(_WIN32)
#include <pthread.h>
#define PYCRAFT_FORKS
#endif

namespace pycraft {

namespace {

std::atomic_flag adopting = ATOMIC_FLAG_INIT;

#if defined(PYCRAFT_FORKS)
void in_the_child() {
  ++fork_count;
  adopting.clear();
}
const int registered = pthread_atfork(nullptr, nullptr, &in_the_child);
#endif

}  // namespace

void Mutex::adopt() {
  while (adopting.test_and_set(std::memory_order_acquire)) std::this_thread::yield();
  if (generation_.load() != forks()) {
    abandoned_ = abandoned_.load() || held_.load();
    new (&mutex_) std::mutex;
    held_ = false;
    generation_.store(forks(), std::memory_order_release);
  }
  adopting.clear(std::memory_order_release);
}

void UseCount::after_fork() noexcept {
  unsigned before = generation_.load();
  if (before != forks() && generation_.compare_exchange_strong(before, forks())) users_ = 0;
}

// Counted already, beside an editor.
void UseCount::wait() {
  do {
    users_.fetch_sub(1, std::memory_order_relaxed);
    std::this_thread::yield();
  } while (users_.fetch_add(1, std::memory_order_acquire) < 0);
}

bool UseCount::try_edit() noexcept {
  after_fork();
  int none = 0;
  return users_.compare_exchange_strong(none, editing, std::memory_order_acq_rel);
}

void UseCount::end_edit() noexcept { users_.fetch_sub(editing, std::memory_order_acq_rel); }

int UseCount::users() const { return generation_.load() == forks() ? users_.load() : 0; }

}  // namespace pycraft
