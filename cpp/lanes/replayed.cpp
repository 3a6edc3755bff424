#include "lanes/replayed.h"

#include <algorithm>
#include <cstdint>
#include <mutex>

#include "lanes/lane_sets.h"
#include "runtime/interrupt.h"

namespace pycraft::kernels {

namespace {

// Memory of a block that stays near the processor, in bytes.
constexpr size_t near = 2'500'000;
constexpr size_t alignment = 64 / sizeof(double);

// Large blocks have less to call; but what they work on must stay near, and lanes without a state are in vain.
const Replay& suited(const Program& program, const LaneFunctions& lanes, int states) {
  if (program.width != lanes.width) return lanes.of_few;
  const Replay* best = &lanes.replays[0];
  for (const Replay& r : lanes.replays)
    if (program.places * r.registers * lanes.width * sizeof(double) <= near && states > (r.registers - 1) * lanes.width) best = &r;
  return *best;
}

}  // namespace

std::vector<double> Rooms::take(size_t doubles) {
  std::vector<double> room;
  {
    const std::lock_guard<Mutex> lock(mutex_);
    if (mutex_.abandoned()) leave_behind(free_);
    if (!free_.empty()) {
      room = std::move(free_.back());
      free_.pop_back();
    }
  }
  if (room.size() < doubles) room.resize(doubles);
  return room;
}
void Rooms::give_back(std::vector<double> room) {
  const std::lock_guard<Mutex> lock(mutex_);
  free_.push_back(std::move(room));
}

std::vector<int> replayed(const Program& program, const std::vector<Entries>& inputs, const StatesOfBatch& states, Rooms& rooms) {
  const LaneFunctions& lanes = lane_set().functions;
  const int count = states.to - states.from;
  const Replay& replay = suited(program, lanes, count);
  const int block = replay.registers * program.width, blocks = (count + block - 1) / block, threads = std::clamp(states.threads, 1, std::max(blocks, 1));
  const ProgramText text = program.text();
  std::vector<unsigned char> sound(count, 1);
  struct Own {
    std::vector<double> room;
    double* memory = nullptr;
  };
  std::vector<Own> own(threads);
  const auto work = [&](int thread, int b) {
    Own& o = own[thread];
    if (!o.memory) {
      o.room = rooms.take(program.places * block + alignment);
      o.memory = o.room.data() + (-reinterpret_cast<std::uintptr_t>(o.room.data()) & 63) / sizeof(double);
      replay.prepare(text, o.memory);
    }
    const int first = b * block;
    replay.run(text, {inputs.data(), size_t(states.from + first), std::min(block, count - first), states.out, states.stride, sound.data() + first}, o.memory);
  };
  if (threads > 1) {
    share_out(0, blocks, threads, work);
  } else {
    for (int b = 0; b < blocks; ++b) {
      check_interrupt();
      work(0, b);
    }
  }
  for (Own& o : own)
    if (!o.room.empty()) rooms.give_back(std::move(o.room));
  std::vector<int> left;
  for (int b = 0; b < count; ++b)
    if (!sound[b]) left.push_back(states.from + b);
  return left;
}

}  // namespace pycraft::kernels
