#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "model/multibody.h"

namespace pycraft {

// Workspaces of one model, taken and given back: threads do not share them. The one given back last is at hand without a lock.
template <class Workspace>
class WorkspacePool {
 public:
  ~WorkspacePool() { delete last_.load(); }

  // While the caller holds a ModelInUse. make(): a new one.
  template <class F, class Make>
  void with(const Multibody& model, F f, Make make) {
    std::unique_ptr<Kept> own(last_.exchange(nullptr, std::memory_order_acquire));
    if (!own) own = taken();
    if (!own || own->version != model.parameters()) own = std::make_unique<Kept>(model.parameters(), make);
    f(own->workspace);
    keep(std::unique_ptr<Kept>(last_.exchange(own.release(), std::memory_order_acq_rel)));
  }
  template <class F>
  void with(const Multibody& model, F f) {
    with(model, f, [&model] { return Workspace(model); });
  }

 private:
  struct Kept {
    std::uint64_t version;
    Workspace workspace;
    template <class Make>
    Kept(std::uint64_t of, Make& make) : version(of), workspace(make()) {}
  };
  std::unique_ptr<Kept> taken() {
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(others_);
    if (others_.empty()) return nullptr;
    std::unique_ptr<Kept> own = std::move(others_.back());
    others_.pop_back();
    return own;
  }
  void keep(std::unique_ptr<Kept> other) {
    if (!other) return;
    std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(others_);
    others_.push_back(std::move(other));
  }

  std::atomic<Kept*> last_{nullptr};
  Mutex mutex_;
  std::vector<std::unique_ptr<Kept>> others_;
};

}  // namespace pycraft
