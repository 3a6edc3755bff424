// The instructions of a tape, before they have places: sums of products taken together, what nobody asks for left out.
#pragma once

#include <vector>

#include "lanes/program.h"

namespace pycraft::kernels {

struct Instruction {
  int code;
  int makes[2] = {-1, -1};  // numbers
  int entry = 0, array = 0; // of inputs and results
  int first_read = 0, reads = 0;
};

struct Instructions {
  std::vector<Instruction> all;
  std::vector<int> reads;  // numbers, those of each instruction side by side; ~number of a constant in a sum
  int numbers = 0;         // operations of the tape, and after them what long sums are in between
  int one = 0;             // the number 1
};

Instructions instructions_of(const Tape& tape);

}  // namespace pycraft::kernels
