// Models that are evaluated.
#pragma once

#include <vector>

#include "algebra/language/expression.h"
#include "algebra/language/source.h"

namespace pycraft {

// No model of these contexts is edited while it lives.
class InUse {
 public:
  explicit InUse(const std::vector<Context>& contexts) : contexts_(contexts) {
    for (const Context& c : contexts_) entered_ = c.source->enter_use();
  }
  ~InUse() {
    for (const Context& c : contexts_) c.source->leave_use(entered_);
  }
  InUse(const InUse&) = delete;

 private:
  const std::vector<Context>& contexts_;
  unsigned entered_ = 0;
};

}  // namespace pycraft
