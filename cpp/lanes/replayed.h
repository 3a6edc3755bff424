// A program done at the states of a batch, a block at a time, in one thread or several.
#pragma once

#include <vector>

#include "lanes/program.h"
#include "runtime/mutex.h"

namespace pycraft::kernels {

// The memory of blocks: kept, so that batches one after the other need not ask for it.
class Rooms {
 public:
  std::vector<double> take(size_t doubles);
  void give_back(std::vector<double> room);

 private:
  Mutex mutex_;
  std::vector<std::vector<double>> free_;
};

struct StatesOfBatch {
  int from, to;  // of the batch
  int threads;
  double* out;   // of its first state
  size_t stride; // results a state
};

// Programs are for the vectors of this machine's lanes, or for its narrow ones. The states whose results mean nothing: those of others are at their places. A state has the same bits wherever it stands.
std::vector<int> replayed(const Program& program, const std::vector<Entries>& inputs, const StatesOfBatch& states, Rooms& rooms);

}  // namespace pycraft::kernels
