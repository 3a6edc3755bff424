// Programs of random tapes against the tapes themselves, operation by operation: in every instruction set that is here, bit by bit.
#define BOOST_TEST_MODULE programs
#include <boost/test/included/unit_test.hpp>

#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "lanes/lane_sets.h"
#include "lanes/replayed.h"
#include "numerics/recorded.h"

using namespace pycraft;
using namespace pycraft::kernels;

namespace {

constexpr int entries = 6;

struct Given {
  std::vector<std::vector<double>> arrays;
  std::vector<Entries> inputs;  // the last one is the same at all states
  Given(int states, std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-2, 2);
    for (int a = 0; a < 3; ++a) {
      arrays.emplace_back(size_t(states) * entries);
      for (double& x : arrays.back()) x = uniform(random);
    }
    for (int a = 0; a < 3; ++a) inputs.push_back({arrays[a].data(), a == 2 ? 0u : size_t(entries)});
  }
};

// What every operation gives at a state.
std::vector<double> values(const Tape& tape, const Given& given, int state, bool fuses) {
  std::vector<double> v(tape.operations.size());
  for (size_t i = 0; i < v.size(); ++i) {
    const Operation& o = tape.operations[i];
    const double a = v[o.first], b = v[o.second], c = v[o.third];
    int n = 0;
    double sines[3];
    switch (o.does) {
      case Does::number: v[i] = o.number; break;
      case Does::input: v[i] = given.inputs[o.second].numbers[state * given.inputs[o.second].stride + o.first]; break;
      case Does::add: v[i] = a + b; break;
      case Does::subtract: v[i] = a - b; break;
      case Does::multiply: v[i] = a * b; break;
      case Does::divide: v[i] = a / b; break;
      case Does::negate: v[i] = -a; break;
      case Does::fused: v[i] = fuses ? std::fma(a, b, c) : a * b + c; break;
      case Does::sine: turn_sines(a, sines), v[i] = sines[1]; break;
      case Does::cosine: turn_sines(a, sines), v[i] = sines[0]; break;
      case Does::root: v[i] = std::sqrt(a); break;
      case Does::logarithm: v[i] = std::log(a); break;
      case Does::fraction: v[i] = std::frexp(a, &n); break;
      case Does::exponent: static_cast<void>(std::frexp(a, &n)), v[i] = n; break;
      case Does::magnitude: v[i] = std::abs(a); break;
      case Does::larger: v[i] = a < b ? b : a; break;
      case Does::greater: v[i] = a > b; break;
      case Does::at_least: v[i] = a >= b; break;
      case Does::equal: v[i] = a == b; break;
      case Does::both: v[i] = a != 0 && b != 0; break;
      case Does::choose: v[i] = a != 0 ? b : c; break;
    }
  }
  return v;
}

bool is_truth(Does does) { return does >= Does::greater && does <= Does::both; }

// Sums and products mostly, of what came shortly before or long ago; functions of the C library only where its bits are those of packs.
Tape random_tape(int length, std::mt19937& random, bool sines) {
  Tape tape;
  const auto below = [&](int n) { return static_cast<int>(random() % unsigned(n)); };
  std::vector<int> numbers{0}, truths;
  std::uniform_real_distribution<double> uniform(-2, 2);
  const auto number = [&] {
    const int n = static_cast<int>(numbers.size());
    return numbers[below(3) ? n - 1 - below(std::min(n, 12)) : below(n)];
  };
  for (int i = 0; i < length; ++i) {
    const int kind = below(40);
    Operation o{Does::add, number(), number(), 0, 0};
    if (kind < 2 || i < 3) o = {Does::number, 0, 0, 0, below(4) ? uniform(random) : 1.0};
    else if (kind < 4) o = {Does::input, below(entries), below(3)};
    else if (kind < 16) o.does = Does::multiply;
    else if (kind < 21) o.does = Does::subtract;
    else if (kind < 24) o.does = Does::fused, o.third = number();
    else if (kind < 25) o.does = Does::divide;
    else if (kind < 27) o = {Does::negate, number()};
    else if (kind < 28) o = {below(2) && sines ? (below(2) ? Does::sine : Does::cosine) : Does::magnitude, number()};
    else if (kind < 29) o.does = Does::larger;
    else if (kind < 30) o = {std::array{Does::root, Does::logarithm, Does::fraction, Does::exponent}[below(4)], number()};
    else if (kind < 32) o.does = std::array{Does::greater, Does::at_least, Does::equal}[below(3)];
    else if (kind < 33 && truths.size() > 1) o = {Does::both, truths[below(static_cast<int>(truths.size()))], truths[below(static_cast<int>(truths.size()))]};
    else if (kind < 34 && !truths.empty()) o = {Does::choose, truths[below(static_cast<int>(truths.size()))], number(), number()};
    tape.operations.push_back(o);
    (is_truth(o.does) ? truths : numbers).push_back(static_cast<int>(tape.operations.size()) - 1);
  }
  for (int i = 0; i < 12; ++i) tape.results.push_back({i, number()});
  for (int t : truths)
    if (tape.operations[t].does != Does::both && below(8) == 0) tape.guards.push_back({t, below(2) == 0});
  for (int i = 0; i < 3; ++i) tape.finite.push_back(number());
  return tape;
}

struct Expected {
  std::vector<double> out;
  std::vector<char> sound;
};
Expected expected(const Tape& tape, const Given& given, int states, bool fuses) {
  Expected e{std::vector<double>(size_t(states) * tape.results.size()), std::vector<char>(states, 1)};
  for (int s = 0; s < states; ++s) {
    const std::vector<double> v = values(tape, given, s, fuses);
    for (const Guard& g : tape.guards) e.sound[s] &= (v[g.truth] != 0) == g.holds;
    for (int i : tape.finite) e.sound[s] &= std::isfinite(v[i]);
    for (const TapedResult& r : tape.results) e.out[s * tape.results.size() + r.entry] = v[r.from], e.sound[s] &= std::isfinite(v[r.from]);
  }
  return e;
}

bool same(double a, double b) { return std::memcmp(&a, &b, sizeof a) == 0; }

// Results of sound states, and which are sound; memory is no number where nothing was put.
void check(const Tape& tape, const Given& given, int states, const LaneSet& set, int width, const Replay& replay, const Expected& e) {
  const Program program = program_of(tape, width);
  const int block = replay.registers * width;
  const size_t size = tape.results.size();
  std::vector<double> room(program.places * block + 8, std::numeric_limits<double>::quiet_NaN()), out(states * size);
  double* const memory = room.data() + (-reinterpret_cast<std::uintptr_t>(room.data()) & 63) / sizeof(double);
  std::vector<unsigned char> sound(states, 7);
  replay.prepare(program.text(), memory);
  for (int first = 0; first < states; first += block)
    replay.run(program.text(), {given.inputs.data(), size_t(first), std::min(block, states - first), out.data(), size, sound.data() + first}, memory);
  for (int s = 0; s < states; ++s) {
    BOOST_TEST(int(sound[s]) == int(e.sound[s]), set.name << ", " << replay.registers << " registers, state " << s);
    for (size_t i = 0; i < size && e.sound[s]; ++i) BOOST_TEST(same(out[s * size + i], e.out[s * size + i]), set.name << ", state " << s << ", result " << i);
  }
}

}  // namespace

BOOST_AUTO_TEST_CASE(random_tapes) {
  std::mt19937 random(1);
  int sound = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const int states = 1 + static_cast<int>(random() % 70);
    const Given given(states, random);
    const Tape tape = random_tape(20 + static_cast<int>(random() % (trial % 10 ? 200 : 3000)), random, true);
    for (const LaneSet& set : lane_sets()) {
      // sines are those of the set that is in use
      Tape own = tape;
      if (set.name != lane_set().name)
        for (Operation& o : own.operations)
          if (o.does == Does::sine || o.does == Does::cosine) o.does = Does::negate;
      const Expected e = expected(own, given, states, set.functions.fuses);
      for (char s : e.sound) sound += s;
      for (const Replay& replay : set.functions.replays) check(own, given, states, set, set.functions.width, replay, e);
      check(own, given, states, set, set.functions.few, set.functions.of_few, e);
    }
  }
  BOOST_TEST(sound > 2000);  // that there was something to compare
}

BOOST_AUTO_TEST_CASE(whole_batches) {
  std::mt19937 random(2);
  Rooms rooms;
  for (const int states : {0, 1, 2, 7, 8, 9, 31, 32, 33, 63, 64, 65, 300}) {
    const Given given(std::max(states, 1), random);
    const Tape tape = random_tape(300, random, true);
    const Program of_many = program_of(tape, lane_set().functions.width), of_few = program_of(tape, lane_set().functions.few);
    const Expected e = expected(tape, given, states, lane_set().functions.fuses);
    const size_t size = tape.results.size();
    for (const Program* program : {&of_many, &of_few})
      for (const int threads : {1, 3})
        for (const int from : {0, states / 3}) {
          std::vector<double> out(states * size, -7.0);
          std::vector<int> wanted;
          for (int s = from; s < states; ++s)
            if (!e.sound[s]) wanted.push_back(s);
          const std::vector<int> left = replayed(*program, given.inputs, {from, states, threads, out.data(), size}, rooms);
          BOOST_TEST(left == wanted, boost::test_tools::per_element());
          for (int s = 0; s < states; ++s)
            for (size_t i = 0; i < size; ++i) BOOST_TEST((s < from ? out[s * size + i] == -7.0 : !e.sound[s] || same(out[s * size + i], e.out[s * size + i])));
        }
  }
}

BOOST_AUTO_TEST_CASE(what_is_folded) {
  Recording recording(1000);
  const Recorded x = recording.input(0.5, 0, 0), y = recording.input(-3.0, 0, 1), zero(0), one(1), two(2);
  BOOST_TEST((x + zero).id == x.id);
  BOOST_TEST((one * x).id == x.id);
  BOOST_TEST((zero * x).is_constant());
  BOOST_TEST((x + y).id == (y + x).id);
  BOOST_TEST((x - -y).id == (x + y).id);
  BOOST_TEST((-(-x)).id == x.id);
  BOOST_TEST((x / two).value == 0.25);
  BOOST_TEST((two * two).value == 4.0);
  BOOST_TEST(fused(zero, x, y).id == y.id);
  BOOST_TEST(fused(x, y, zero).id == (x * y).id);
  BOOST_TEST(fused(-x, -y, two).id == fused(y, x, two).id);
  BOOST_TEST(maximum(zero, abs(x)).id == abs(x).id);
  BOOST_TEST(recording.tape().guards.size() == 0);
  BOOST_TEST((x > y));
  BOOST_TEST(!(x > x * two));
  BOOST_TEST((x > y));
  BOOST_TEST(recording.tape().guards.size() == 2);  // the same one once
  BOOST_TEST(!vanishes(x));
  BOOST_TEST(vanishes(zero));
  BOOST_TEST(recording.trusted());
  BOOST_TEST(static_cast<double>(two) == 2.0);
  BOOST_TEST(recording.trusted());
  BOOST_TEST(static_cast<double>(x) == 0.5);
  BOOST_TEST(!recording.trusted());
}

BOOST_AUTO_TEST_CASE(too_long) {
  Recording recording(10);
  Recorded x = recording.input(0.5, 0, 0);
  const auto go_on = [&] {
    for (int i = 0; i < 100; ++i) x = x * x + Recorded(0.25);
  };
  BOOST_CHECK_THROW(go_on(), Recording::OffTape);
}

BOOST_AUTO_TEST_CASE(recordings_within_recordings) {
  Recording outer(1000);
  const Recorded x = outer.input(0.5, 0, 0);
  {
    Recording inner(1000);
    BOOST_TEST(Recording::current() == &inner);
    BOOST_TEST((inner.input(2.0, 0, 0) * Recorded(3)).value == 6.0);
  }
  BOOST_TEST(Recording::current() == &outer);
  BOOST_TEST((x * x).value == 0.25);
}
