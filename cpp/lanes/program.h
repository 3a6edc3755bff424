// A tape made ready to be done again at many states: what is not asked for left out, sums of products in one piece, equal instructions one after
// the other, numbers in places that serve again once nobody needs them.
//
// An instruction works on a number of each of a block of states, side by side in one place of the block's memory. Code gives places in bytes, of
// one vector a place; in blocks of several vectors a place they lie that many times as far. Sums of products
//
//   first ± a b ± c d,   first a number or a product,
//
// are taken in the tape's order and rounded as there: every product and every sum by itself, or, where the tape fused them, together. So a
// program has the bits of what was written down. Constants in them have no places: an instruction gives their number.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "lanes/tape.h"

namespace pycraft::kernels {

// Sums of products have the codes below `add`: whether fused, what comes first, how many terms follow, and of each whether it is subtracted and
// whether its first factor is a constant.
constexpr int most_terms = 2;
enum class First { number, product, multiple, constant };  // multiple: of a constant
enum Kind : unsigned { subtracted = 1, of_constant = 2 };
enum class Code : std::uint16_t {
  add = 512, subtract, divide, negate, sines, root, logarithm, fraction, exponent, magnitude, larger, greater, at_least, equal, both, choose,
  require_greater, require_at_least, require_equal, refuse_greater, refuse_at_least, refuse_equal,  // of lanes where a guard does not hold
  finite, input, result, count
};
constexpr int code_of_sum(bool fused, First first, int terms, unsigned kinds) {
  return (fused ? 256 : 0) | static_cast<int>(first) << 6 | terms << 4 | static_cast<int>(kinds);
}
// Runs of equal instructions: a head, then the words of each: where it writes, what it reads; of an input the array and the entry, of a result
// the entry before what is read.
constexpr int code_bits = 10;
constexpr std::uint32_t head(int code, std::uint32_t count) { return static_cast<std::uint32_t>(code) | count << code_bits; }
constexpr std::uint32_t longest_run = (1u << (32 - code_bits)) - 1;

// As replays read it: plain data.
struct ProgramText {
  const std::uint32_t *code, *end;
  const double* constants;
  size_t placed;  // constants that have places, the first ones
  const double* blank;  // results that are the same at all states, where there are many, and zeros; null: none
  const int* fixed;     // where there are few: their entries
  const double* fixed_values;
  size_t fixed_count;
};

struct Program {
  std::vector<std::uint32_t> code;
  std::vector<double> constants;
  std::vector<double> blank, fixed_values;
  std::vector<int> fixed;
  size_t places = 0, placed = 0, instructions = 0;
  int width = 0;  // states in a vector
  ProgramText text() const {
    return {code.data(), code.data() + code.size(), constants.data(), placed, blank.empty() ? nullptr : blank.data(), fixed.data(), fixed_values.data(), fixed.size()};
  }
};

// For vectors of `width` states.
Program program_of(const Tape& tape, int width);

// An input: numbers of every state, or, with stride 0, of all alike.
struct Entries {
  const double* numbers;
  size_t stride;
};

// Some states of a batch, and where their results go; `sound` is 0 afterwards for those whose results mean nothing.
struct BlockOfStates {
  const Entries* inputs;
  size_t first;
  int states;
  double* out;           // of state 0
  size_t stride;         // results a state
  unsigned char* sound;  // of the first
};

// Blocks of up to registers · width states, registers vectors a place, in memory of `places` times as many doubles, aligned to a vector: it is
// prepared once.
struct Replay {
  int registers;
  void (*prepare)(const ProgramText& program, double* memory);
  void (*run)(const ProgramText& program, const BlockOfStates& block, double* memory);
};

}  // namespace pycraft::kernels
