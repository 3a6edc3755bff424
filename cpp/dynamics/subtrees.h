// One state of a large tree in threads: its subtrees in several, the trunk between them in the caller's. Numbers are added in the order of one
// thread, so that the result has its bits.
#pragma once

#include <vector>

#include "kernels/links.h"
#include "kernels/tree_parts.h"
#include "runtime/interrupt.h"

namespace pycraft {

template <class T>
class InParts {
 public:
  InParts(const kernels::PartKernel<T>& kernel, const kernels::Links<T>& links, const std::vector<kernels::TreePart>& parts, int threads, double* out, T* memory)
      : kernel_(kernel), links_(links), parts_(parts), threads_(threads), out_(out), memory_(memory) {
    for (const Part& part : parts) (part.apart ? apart_ : trunk_).push_back(part);
  }

  // Whether the state is sound.
  bool run(const kernels::States<T>& states) {
    at_ = kernel_.begin(links_, states, memory_);
    const auto move = [&](const Part& part) { kernel_.outward(links_, at_, part.first, part.last, memory_); };
    for (const Part& part : trunk_) move(part);
    bool sound = inward(kernel_.inward, move);
    if (!sound && kernel_.errors) sound = inward(kernel_.errors, [](const Part&) {});
    if (kernel_.finish) {
      const auto finish = [&](const Part& part) { kernel_.finish(links_, at_, part.first, part.last, out_, memory_); };
      for (const Part& part : trunk_) finish(part);
      share_out(0, static_cast<int>(apart_.size()), threads_, [&](int, int i) { finish(apart_[i]); });
    }
    return sound;
  }

 private:
  using Part = kernels::TreePart;

  // A pass to the base; before(part) in the thread of a subtree.
  template <class Before>
  bool inward(decltype(kernels::PartKernel<T>::inward) pass, Before before) {
    const auto clear = [&](const Part& part) {
      if (kernel_.clear) kernel_.clear(links_, part.first, part.last, memory_);
    };
    const auto sweep = [&](const Part& part) { return (pass(links_, at_, part.first, part.last, part.apart, out_, memory_) & 1) != 0; };
    for (const Part& part : trunk_) clear(part);
    std::vector<char> sound(apart_.size());
    share_out(0, static_cast<int>(apart_.size()), threads_, [&](int, int i) { before(apart_[i]), clear(apart_[i]), sound[i] = sweep(apart_[i]); });
    bool all = true;
    for (const char one : sound) all &= one != 0;
    for (auto part = parts_.rbegin(); part != parts_.rend(); ++part) {
      if (part->apart)
        kernel_.join(links_, part->first, memory_);
      else
        all &= sweep(*part);
    }
    return all;
  }

  const kernels::PartKernel<T>& kernel_;
  const kernels::Links<T>& links_;
  const std::vector<Part>& parts_;
  std::vector<Part> apart_, trunk_;
  const int threads_;
  double* const out_;
  T* const memory_;
  kernels::States<T> at_{};
};

}  // namespace pycraft
