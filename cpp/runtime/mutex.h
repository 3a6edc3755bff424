// Locks that survive a fork, and the count of who uses a model. A forked child has one thread: the others are left behind in the parent,
// and what they held would stay locked for ever.
#pragma once

#include <atomic>
#include <mutex>
#include <new>

namespace pycraft {

// How many forks lie between the first process and this one.
inline std::atomic<unsigned> fork_count{0};
inline unsigned forks() { return fork_count.load(std::memory_order_relaxed); }

// A mutex that a forked child finds unlocked.
class Mutex {
 public:
  void lock() {
    if (generation_.load(std::memory_order_acquire) != forks()) adopt();
    mutex_.lock();
    held_.store(true, std::memory_order_relaxed);
    std::atomic_signal_fence(std::memory_order_seq_cst);
  }
  void unlock() {
    std::atomic_signal_fence(std::memory_order_seq_cst);
    held_.store(false, std::memory_order_relaxed);
    mutex_.unlock();
  }
  // Whether a thread that was left behind holds it.
  bool left_behind() const { return held_.load() && generation_.load() != forks(); }
  // Under the lock, once after a fork: what it guards may be half written, by a thread that was left behind.
  bool abandoned() { return abandoned_.exchange(false); }

 private:
  void adopt();
  std::mutex mutex_;
  std::atomic<unsigned> generation_{forks()};
  std::atomic<bool> held_{false}, abandoned_{false};
};

// Starts afresh what is half written. What it held stays behind, too: it cannot be freed.
template <class... T>
void leave_behind(T&... abandoned) {
  (new (&abandoned) T, ...);
}

// Either users, any number of them, or one editor.
class UseCount {
 public:
  unsigned enter();             // waits where an edit is in progress, which is short; tells leave() on which side of a fork it was
  void leave(unsigned entered) noexcept;
  bool try_edit() noexcept;     // false where somebody uses it
  void end_edit() noexcept;
  int users() const;

 private:
  void after_fork() noexcept;
  void wait();
  static constexpr int editing = -(1 << 30);
  std::atomic<int> users_{0};
  std::atomic<unsigned> generation_{forks()};
};

inline unsigned UseCount::enter() {
  if (generation_.load() != forks()) after_fork();
  if (users_.fetch_add(1, std::memory_order_acquire) < 0) wait();
  return forks();
}

inline void UseCount::leave(unsigned entered) noexcept {
  if (entered == forks()) users_.fetch_sub(1, std::memory_order_release);
}

}  // namespace pycraft
