// What a computation does, operation by operation, as numbers that write down what becomes of them leave it (numerics/recorded.h,
// kernels/traced.h): to be done again at other states (program.h), or to be written out as source (pycraft/compiled). Plain data.
#pragma once

#include <vector>

namespace pycraft::kernels {

// number: the constant. input: entry `first` of array `second`. Else of the results of operations `first`, `second`, `third`: fused is
// first · second + third, rounded once where the instruction set can; fraction and exponent are what frexp gives; greater, at_least, equal and
// both are truths; choose is the second where the first is true, else the third.
enum class Does : unsigned char {
  number, input, add, subtract, multiply, divide, negate, fused, sine, cosine, root, logarithm, fraction, exponent, magnitude, larger,
  greater, at_least, equal, both, choose
};
inline constexpr const char* names_of_operations[] = {"number", "input", "add", "subtract", "multiply", "divide", "negate", "fused", "sine", "cosine", "root",
                                                      "logarithm", "fraction", "exponent", "magnitude", "larger", "greater", "at_least", "equal", "both", "choose"};
// How many operations it takes.
inline constexpr int operands_of[] = {0, 0, 2, 2, 2, 2, 1, 3, 1, 1, 1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 3};
inline int operands(Does does) { return operands_of[static_cast<int>(does)]; }

struct Operation {
  Does does;
  int first = 0, second = 0, third = 0;
  double number = 0;
};

// The results hold where a truth is, or is not.
struct Guard {
  int truth;
  bool holds;
};

// An entry of the output and the operation that it comes from.
struct TapedResult {
  int entry, from;
};

struct Tape {
  std::vector<Operation> operations = {{Does::number}};  // each after those that it takes; the first is zero
  std::vector<TapedResult> results;
  std::vector<Guard> guards;
  std::vector<int> finite;  // and they hold where these are finite: what was multiplied by zero
};

}  // namespace pycraft::kernels
