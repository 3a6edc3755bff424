#include "lanes/schedule.h"

#include <algorithm>
#include <bit>
#include <cstdint>

namespace pycraft::kernels {

namespace {

// Instructions that may come next are looked for among so many, from the first that is left on.
constexpr int window = 64;

class Scheduling {
 public:
  explicit Scheduling(const Instructions& given) : given_(given), count_(static_cast<int>(given.all.size())), waits_(count_, 0), ready_(count_, 0) {
    std::vector<int> maker(given.numbers, -1);
    for (int k = 0; k < count_; ++k)
      for (int number : given.all[k].makes)
        if (number >= 0) maker[number] = k;
    const auto each = [&](auto f) {  // f(instruction, one that makes what it reads)
      for (int k = 0; k < count_; ++k)
        for (int r = given.all[k].first_read; r < given.all[k].first_read + given.all[k].reads; ++r)
          if (const int read = given.reads[r]; read >= 0 && maker[read] >= 0) f(k, maker[read]);
    };
    first_user_.assign(count_ + 1, 0);
    each([&](int k, int from) { ++waits_[k], ++first_user_[from + 1]; });
    for (int k = 0; k < count_; ++k) first_user_[k + 1] += first_user_[k];
    users_.resize(first_user_[count_]);
    std::vector<int> next(first_user_.begin(), first_user_.end() - 1);
    each([&](int k, int from) { users_[next[from]++] = k; });
    for (int k = 0; k < count_; ++k) ready_[k] = waits_[k] == 0;
    for (int k = 0; k < std::min(window, count_); ++k) at_hand_ |= std::uint64_t(ready_[k]) << k;
  }

  std::vector<Instruction> run() {
    std::vector<Instruction> order;
    order.reserve(count_);
    for (int code = -1; first_ < count_;) {
      const int k = next(code);
      code = given_.all[k].code;
      order.push_back(given_.all[k]);
      take(k);
    }
    return order;
  }

 private:
  // The first that is like the last one; else the first.
  int next(int code) const {
    for (std::uint64_t left = at_hand_; left; left &= left - 1)
      if (const int k = first_ + std::countr_zero(left); given_.all[k].code == code) return k;
    return first_ + std::countr_zero(at_hand_);
  }
  void take(int k) {
    done_ |= std::uint64_t(1) << (k - first_), at_hand_ &= ~done_;
    for (int u = first_user_[k]; u < first_user_[k + 1]; ++u)
      if (const int user = users_[u]; --waits_[user] == 0) {
        ready_[user] = 1;
        if (user < first_ + window) at_hand_ |= std::uint64_t(1) << (user - first_);
      }
    const int past = std::countr_one(done_);
    if (past == 0) return;
    for (int next = first_ + window; next < std::min(first_ + window + past, count_); ++next)
      if (ready_[next]) entering_ |= std::uint64_t(1) << (next - first_ - window);
    at_hand_ = shifted(at_hand_, past) | (past == window ? entering_ : entering_ << (window - past));
    done_ = shifted(done_, past);
    entering_ = 0, first_ += past;
  }
  static std::uint64_t shifted(std::uint64_t bits, int by) { return by == window ? 0 : bits >> by; }

  const Instructions& given_;
  int count_, first_ = 0;                             // the first that is left
  std::uint64_t at_hand_ = 0, done_ = 0, entering_ = 0;  // from there on
  std::vector<int> waits_, first_user_, users_;       // for how many others each waits; who waits for it
  std::vector<char> ready_;
};

}  // namespace

void schedule(Instructions& instructions) { instructions.all = Scheduling(instructions).run(); }

}  // namespace pycraft::kernels
