// Fibers: turns, errors, calls that are left for good; and runs that wait for each other. Meant for the address and thread sanitizers, too.
#define BOOST_TEST_MODULE fibers
#include <algorithm>
#include <boost/test/included/unit_test.hpp>
#include <cstdint>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "runtime/fiber.h"

using namespace pycraft;

namespace {

struct Leaving {
  explicit Leaving(int& count) : count(count) {}
  ~Leaving() { ++count; }
  int& count;
};

// A frame that a misaligned stack would show, at every level.
double deep(int levels, double x) {
  alignas(64) volatile double room[8] = {x, 1, 2, 3, 4, 5, 6, 7};
  BOOST_REQUIRE_EQUAL(reinterpret_cast<std::uintptr_t>(&room) % 64, 0);
  if (levels == 0) {
    Fiber::pause();
    return room[0];
  }
  return deep(levels - 1, x + room[1]) + room[2];
}

}  // namespace

BOOST_AUTO_TEST_CASE(calls_take_turns_and_keep_what_they_hold) {
  if (!Fiber::there) return;
  std::vector<std::unique_ptr<Fiber>> fibers;
  std::vector<double> found(5, 0);
  std::string order;
  for (int i = 0; i < 5; ++i) {
    fibers.push_back(std::make_unique<Fiber>());
    fibers[i]->begin([&, i] {
      double sum = 0;
      for (int k = 0; k <= i; ++k) {
        order += std::to_string(i);
        sum += deep(20, i + 0.25 * k);
      }
      found[i] = sum;
    });
  }
  std::vector<int> turns(5, 0);
  for (bool any = true; any;) {
    any = false;
    for (int i = 0; i < 5; ++i)
      if (turns[i] >= 0) {
        if (fibers[i]->resume()) {
          ++turns[i], any = true;
        } else {
          BOOST_TEST(turns[i] == i + 1);
          turns[i] = -1;
        }
      }
  }
  BOOST_TEST(order == "012341234234344");
  for (int i = 0; i < 5; ++i) {
    double sum = 0;
    for (int k = 0; k <= i; ++k) sum += i + 0.25 * k + 20 + 40;
    BOOST_TEST(found[i] == sum);
  }
}

BOOST_AUTO_TEST_CASE(errors_come_through_and_the_next_call_begins) {
  if (!Fiber::there) return;
  Fiber fiber;
  int left = 0;
  fiber.begin([&] {
    const Leaving leaving(left);
    Fiber::pause();
    try {
      throw std::runtime_error("inner");
    } catch (const std::runtime_error&) {
    }
    throw std::runtime_error("wrong");
  });
  BOOST_TEST(fiber.resume());
  BOOST_CHECK_EXCEPTION(fiber.resume(), std::runtime_error, [](const auto& e) { return std::string(e.what()) == "wrong"; });
  BOOST_TEST(left == 1);
  int sum = 0;
  fiber.begin([&] { sum += 1; });
  BOOST_TEST(!fiber.resume());
  BOOST_TEST(sum == 1);
}

BOOST_AUTO_TEST_CASE(a_call_that_waits_is_unwound) {
  if (!Fiber::there) return;
  int left = 0, after = 0;
  {
    Fiber waits, never_begun;
    never_begun.begin([&] { ++after; });
    waits.begin([&] {
      const Leaving leaving(left);
      try {
        Fiber::pause();
      } catch (const std::exception&) {
        ++after;
      }
      ++after;
    });
    waits.resume();
  }
  BOOST_TEST(left == 1);
  BOOST_TEST(after == 0);
}

BOOST_AUTO_TEST_CASE(fibers_within_fibers_and_threads) {
  if (!Fiber::there) return;
  const auto nested = [] {
    std::string order;
    Fiber outer, inner;
    outer.begin([&] {
      inner.begin([&] {
        order += 'a';
        Fiber::pause();
        order += 'c';
      });
      inner.resume();
      order += 'b';
      Fiber::pause();
      inner.resume();
      order += 'd';
    });
    while (outer.resume()) order += '.';
    return order;
  };
  std::vector<std::string> found(4);
  std::vector<std::thread> threads;
  for (auto& of : found) threads.emplace_back([&] { of = nested(); });
  for (auto& thread : threads) thread.join();
  for (const auto& of : found) BOOST_TEST(of == "ab.cd");
}

BOOST_AUTO_TEST_CASE(runs_wait_for_each_other_and_the_next_takes_a_place_that_is_free) {
  if (!Fiber::there) return;
  const std::vector<int> asks = {3, 0, 1, 5, 2, 2, 0, 4};
  std::vector<int> waiting, answered(asks.size(), 0);
  int going = 0, most = 0;
  std::string sizes;
  side_by_side(
      static_cast<int>(asks.size()), 3,
      [&](int i) {
        most = std::max(most, ++going);
        for (int k = 0; k < asks[i]; ++k) {
          waiting.push_back(i);
          Fiber::pause();
        }
        --going;
      },
      [&] {
        sizes += std::to_string(waiting.size());
        for (int i : waiting) ++answered[i];
        waiting.clear();
      });
  BOOST_TEST(answered == asks, boost::test_tools::per_element());
  BOOST_TEST(most == 3);
  BOOST_TEST(sizes == "3333311");
}

BOOST_AUTO_TEST_CASE(an_error_ends_all) {
  if (!Fiber::there) return;
  int left = 0;
  const auto run = [&](int i) {
    const Leaving leaving(left);
    Fiber::pause();
    if (i == 1) throw std::runtime_error("one");
    Fiber::pause();
  };
  BOOST_CHECK_THROW(side_by_side(3, 3, run, [] {}), std::runtime_error);
  BOOST_TEST(left == 3);
  BOOST_CHECK_THROW(side_by_side(2, 2, run, [] { throw std::logic_error("answer"); }), std::logic_error);
  BOOST_TEST(left == 5);
}
