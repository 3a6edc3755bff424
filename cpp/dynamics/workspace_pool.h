#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "model/multibody.h"

namespace pycraft {

// Workspaces of one model, taken and given back: threads do not share them.
template <class Workspace>
class WorkspacePool {
 public:
  template <class F>
  void with(const Multibody& model, F f) {
    const ModelInUse use(model);
    std::unique_ptr<Workspace> workspace;
    {
      std::lock_guard<Mutex> lock(mutex_);
      if (mutex_.abandoned()) leave_behind(free_);
      if (version_ != model.parameters()) {
        free_.clear();
        version_ = model.parameters();
      }
      if (!free_.empty()) {
        workspace = std::move(free_.back());
        free_.pop_back();
      }
    }
    if (!workspace) workspace = std::make_unique<Workspace>(model);
    const auto version = model.parameters();
    f(*workspace);
    std::lock_guard<Mutex> lock(mutex_);
    if (version == version_) free_.push_back(std::move(workspace));
  }

 private:
  Mutex mutex_;
  std::uint64_t version_ = 0;
  std::vector<std::unique_ptr<Workspace>> free_;
};

}  // namespace pycraft
