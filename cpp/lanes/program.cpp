#include "lanes/program.h"

#include <algorithm>
#include <limits>

#include "lanes/instructions.h"
#include "lanes/schedule.h"

namespace pycraft::kernels {

namespace {

// Numbers in places: each from where it is made to where it is read last.
class Placing {
 public:
  Placing(const Tape& tape, const Instructions& given, int width)
      : tape_(tape), given_(given), vector_(width * sizeof(double)), place_(given.numbers, none), index_(given.numbers, none), last_(given.numbers, -1) {
    give_constants();
    for (int k = 0; k < static_cast<int>(given.all.size()); ++k) {
      const Instruction& i = given.all[k];
      for (int r = i.first_read; r < i.first_read + i.reads; ++r)
        if (given.reads[r] >= 0) last_[given.reads[r]] = k;
    }
    give_fixed_results();
  }
  Program run() {
    for (int k = 0; k < static_cast<int>(given_.all.size()); ++k) write(given_.all[k], k);
    program_.instructions = given_.all.size();
    return std::move(program_);
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  double constant(int number) const { return number == given_.one ? 1.0 : tape_.operations[number].number; }
  // Those that need places come first, and all in the order in which they are needed.
  void give_constants() {
    const auto give = [&](int number) {
      index_[number] = static_cast<std::uint32_t>(program_.constants.size());
      program_.constants.push_back(constant(number));
    };
    for (int read : given_.reads)
      if (read >= 0 && read < static_cast<int>(tape_.operations.size()) && tape_.operations[read].does == Does::number && index_[read] == none) give(read), place_[read] = index_[read];
    program_.placed = program_.places = program_.constants.size();
    for (int read : given_.reads)
      if (read < 0 && index_[~read] == none) give(~read);
  }
  void give_fixed_results() {
    int size = 0;
    for (const TapedResult& r : tape_.results) {
      size = std::max(size, r.entry + 1);
      if (tape_.operations[r.from].does == Does::number) program_.fixed.push_back(r.entry), program_.fixed_values.push_back(tape_.operations[r.from].number);
    }
    if (4 * program_.fixed.size() < size_t(size)) return;
    program_.blank.assign(size, 0.0);
    for (size_t i = 0; i < program_.fixed.size(); ++i) program_.blank[program_.fixed[i]] = program_.fixed_values[i];
    program_.fixed.clear(), program_.fixed_values.clear();
  }
  void write(const Instruction& i, int k) {
    words_.clear();
    for (int r = i.first_read; r < i.first_read + i.reads; ++r) words_.push_back(given_.reads[r] < 0 ? index_[~given_.reads[r]] : word(place_[given_.reads[r]]));
    for (int r = i.first_read; r < i.first_read + i.reads; ++r)
      if (const int read = given_.reads[r]; read >= 0 && last_[read] == k) release(read);
    std::uint32_t made[2];
    int makes = 0;
    for (int number : i.makes)
      if (number >= 0) made[makes++] = word(place_[number] = taken());
    for (int number : i.makes)
      if (number >= 0 && last_[number] < 0) release(number);
    std::vector<std::uint32_t>& code = program_.code;
    begin(i.code);
    code.insert(code.end(), made, made + makes);
    if (i.code == static_cast<int>(Code::input)) code.push_back(i.array), code.push_back(i.entry);
    if (i.code == static_cast<int>(Code::result)) code.push_back(i.entry);
    code.insert(code.end(), words_.begin(), words_.end());
  }
  void begin(int of) {
    std::vector<std::uint32_t>& code = program_.code;
    if (!code.empty() && static_cast<int>(code[run_] & (head(0, 1) - 1)) == of && code[run_] >> code_bits < longest_run) {
      code[run_] += head(0, 1);
    } else {
      run_ = code.size();
      code.push_back(head(of, 1));
    }
  }
  // The place that was free last is the one most at hand.
  std::uint32_t taken() {
    if (free_.empty()) return static_cast<std::uint32_t>(program_.places++);
    const std::uint32_t place = free_.back();
    free_.pop_back();
    return place;
  }
  void release(int number) {
    if (place_[number] < program_.placed) return;
    last_[number] = std::numeric_limits<int>::max();  // once
    free_.push_back(place_[number]);
  }
  std::uint32_t word(std::uint32_t place) const { return static_cast<std::uint32_t>(place * vector_); }

  const Tape& tape_;
  const Instructions& given_;
  const size_t vector_;
  std::vector<std::uint32_t> place_, index_, free_, words_;  // index: of constants
  std::vector<int> last_;  // the instruction that reads it last; -1: none
  size_t run_ = 0;
  Program program_;
};

}  // namespace

Program program_of(const Tape& tape, int width) {
  Instructions instructions = instructions_of(tape);
  schedule(instructions);
  Program program = Placing(tape, instructions, width).run();
  program.width = width;
  return program;
}

}  // namespace pycraft::kernels
