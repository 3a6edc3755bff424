// What a kernel computes for one model, operation by operation: its loops run once, on numbers that write down what becomes of them
// (tape.cpp). Source is written from that, for this model alone (pycraft/compiled).
//
// Plain data; nothing is folded here: constants are operations too, zeros and ones among them.
#pragma once

#include <vector>

#include "kernels/links.h"

namespace pycraft::kernels {

// number: the constant; q, v, u: entry `first` of that input; else of the results of operations `first` and `second`. greater and both: truths.
enum class Does : unsigned char { number, q, v, u, add, subtract, multiply, divide, negate, sine, cosine, magnitude, larger, greater, both };
inline constexpr const char* names_of_operations[] = {"number", "q", "v", "u", "add", "subtract", "multiply", "divide", "negate", "sine", "cosine", "magnitude", "larger", "greater", "both"};

struct Operation {
  Does does;
  int first, second;
  double number;
};

struct Tape {
  std::vector<Operation> operations;  // each after those that it takes; the first is zero
  std::vector<int> results;           // by the entry of the output, the operation that it comes from
  int sound;                          // the truth that the results may be trusted; -1: they always may
};

// A call's tape. `size` numbers are its output; without u, inverse dynamics is that of no acceleration.
Tape tape_of(const Links<double>& links, Call call, const double* gravity, bool with_u, int size);

}  // namespace pycraft::kernels
