// Trees taken apart for threads: what is a subtree, what is the trunk.
#define BOOST_TEST_MODULE tree_parts
#include <boost/test/included/unit_test.hpp>

#include <numeric>
#include <random>
#include <vector>

#include "kernels/tree_parts.h"

using pycraft::kernels::tree_parts;
using pycraft::kernels::TreePart;

namespace {

// Depth first: a link hangs on the one before it or, now and then, on an ancestor far from it.
std::vector<int> random_tree(std::mt19937& g, int count) {
  std::vector<int> parents;
  for (int k = 0; k < count; ++k) {
    int p = k - 1;
    if (g() % 25 == 0)
      for (unsigned climb = g() % 100; climb > 0 && p >= 0; --climb) p = parents[p];
    parents.push_back(p);
  }
  return parents;
}

}  // namespace

BOOST_AUTO_TEST_CASE(subtrees_and_the_trunk_between_them) {
  std::mt19937 g(1);
  int several = 0;
  for (int round = 0; round < 300; ++round) {
    const int count = 1 + static_cast<int>(g() % 600), least = 20;
    const std::vector<int> parents = random_tree(g, count);
    const std::vector<TreePart> parts = tree_parts(parents, least);
    if (parts.empty()) continue;
    ++several;
    std::vector<char> trunk(count);
    int next = 0, apart = 0;
    for (const TreePart& part : parts) {
      BOOST_TEST_REQUIRE(part.first == next);
      BOOST_TEST_REQUIRE(part.last > part.first);
      next = part.last;
      apart += part.apart;
      for (int k = part.first; k < part.last; ++k) {
        trunk[k] = !part.apart;
        const int p = parents[k];
        if (part.apart && k > part.first)
          BOOST_TEST(p >= part.first);  // in the subtree
        else
          BOOST_TEST((p < 0 || trunk[p]));
      }
      if (part.apart) BOOST_TEST(4 * (part.last - part.first) >= least);
    }
    BOOST_TEST(next == count);
    BOOST_TEST(apart >= 2);
  }
  BOOST_TEST(several > 100);
}

BOOST_AUTO_TEST_CASE(what_has_no_two_large_subtrees_is_whole) {
  BOOST_TEST(tree_parts({}, 10).empty());
  BOOST_TEST(tree_parts({-1}, 1).empty());
  std::vector<int> chain(1000);
  std::iota(chain.begin(), chain.end(), -1);
  BOOST_TEST(tree_parts(chain, 10).empty());
  for (int k = 500; k < 508; ++k) chain.push_back(k % 3);  // leaves
  BOOST_TEST(tree_parts(chain, 10).empty());
  std::vector<int> star;
  for (int arm = 0; arm < 3; ++arm)
    for (int k = 0; k < 20; ++k) star.push_back(k == 0 ? -1 : static_cast<int>(star.size()) - 1);
  BOOST_TEST(tree_parts(star, 20).size() == 3);
  BOOST_TEST(tree_parts(star, 21).size() == 3);
}
