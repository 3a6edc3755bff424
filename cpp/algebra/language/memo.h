// A place by a node of an expression where the layers above keep what they made of it: the expression itself knows nothing of them.
#pragma once

#include <atomic>
#include <memory>
#include <utility>

#include "runtime/mutex.h"

namespace pycraft {

class Memo {
 public:
  Memo() = default;
  // Of an expression that is another one bound to a state, whole: that of the other one.
  explicit Memo(std::shared_ptr<Memo> origin) : origin_(std::move(origin)) {}
  const std::shared_ptr<Memo>& origin() const { return origin_; }

  // What is kept here, made where there is none; it lasts as long as the memo. Everybody who asks means the same Kept.
  template <class Kept>
  Kept& get() {
    if (void* made = made_.load(std::memory_order_acquire)) return *static_cast<Kept*>(made);
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(kept_, of_inverse_);
    if (!kept_) kept_ = std::make_shared<Kept>();
    made_.store(kept_.get(), std::memory_order_release);
    return *static_cast<Kept*>(kept_.get());
  }
  // That of every inverse of the node: `MM.inv() @ x` in a loop is planned once.
  std::shared_ptr<Memo> of_inverse() {
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(kept_, of_inverse_);
    if (!of_inverse_) of_inverse_ = std::make_shared<Memo>(origin_ ? origin_->of_inverse() : nullptr);
    return of_inverse_;
  }

 private:
  Mutex mutex_;
  std::atomic<void*> made_{nullptr};  // once there is one, without the lock
  std::shared_ptr<void> kept_;
  std::shared_ptr<Memo> of_inverse_;
  const std::shared_ptr<Memo> origin_;
};

}  // namespace pycraft
