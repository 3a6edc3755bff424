// The timing loop that `pycraft bench` drives: warm-up, then batches long enough for the clock; minimum and median over batches.
#pragma once

#include <algorithm>
#include <chrono>
#include <vector>

namespace pycraft {

struct Timing {
  double minimum = 0, median = 0;  // seconds per call
  long calls = 0;
};

template <class F>
Timing time_calls(F f, double seconds) {
  using Clock = std::chrono::steady_clock;
  const auto elapsed = [](Clock::time_point from) { return std::chrono::duration<double>(Clock::now() - from).count(); };
  f();  // the first call allocates and plans
  Clock::time_point start = Clock::now();
  f();
  const double one = std::max(elapsed(start), 1e-8);
  const long per_batch = std::max(1L, static_cast<long>(5e-4 / one));
  std::vector<double> batches;
  Timing t;
  const Clock::time_point begin = Clock::now();
  while (batches.size() < 7 || (elapsed(begin) < seconds && batches.size() < 5000)) {
    start = Clock::now();
    for (long i = 0; i < per_batch; ++i) f();
    batches.push_back(elapsed(start) / per_batch);
    t.calls += per_batch;
  }
  std::sort(batches.begin(), batches.end());
  t.minimum = batches.front();
  t.median = batches[batches.size() / 2];
  return t;
}

}  // namespace pycraft
