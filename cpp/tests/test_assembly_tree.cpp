// Assembly trees: every body once, what hangs together is joined in order, and the depth is logarithmic over any tree.
#define BOOST_TEST_MODULE assembly_tree
#include <boost/test/included/unit_test.hpp>

#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

#include "dynamics/assembly_tree.h"

using pycraft::AssemblyNode;
using pycraft::AssemblyTree;
using Kind = AssemblyNode::Kind;

namespace {

std::vector<int> chain(int count) {
  std::vector<int> parents(count);
  std::iota(parents.begin(), parents.end(), -1);
  return parents;
}

std::vector<int> tree(int count, const std::function<int(int)>& parent_of) {
  std::vector<int> parents;
  for (int k = 0; k < count; ++k) parents.push_back(k == 0 ? -1 : parent_of(k));
  return parents;
}

// A backbone, and from every body of it a tooth of so many.
std::vector<int> comb(int teeth, int length) {
  std::vector<int> parents;
  int spine = -1;
  for (int i = 0; i < teeth; ++i) {
    parents.push_back(spine);
    spine = static_cast<int>(parents.size()) - 1;
    for (int k = 0; k < length; ++k) parents.push_back(static_cast<int>(parents.size()) - 1);
  }
  return parents;
}

// Of each node the body that it hangs with on what is inboard and the last one of its chain, by what it is said to be made of.
struct Ends {
  int first = -1, last = -1, branches_of = -1;
};

// Boost's own checks of every node of large trees would take seconds.
void demand(bool holds) {
  if (!holds) BOOST_FAIL("a node is not what it should be");
}

void check(const std::vector<int>& parents, double most_per_doubling) {
  const AssemblyTree assembly(parents);
  const auto& nodes = assembly.nodes();
  std::vector<Ends> ends(nodes.size());
  std::vector<char> seen(parents.size()), used(nodes.size());
  const auto hang = [&](int node, int body) {  // a chain, or several, on a body
    if (nodes[node].kind == Kind::branches)
      demand(ends[node].branches_of == body);
    else
      demand((parents[ends[node].first] == body && assembly.next()[ends[node].last] < 0));
  };
  for (size_t i = 0; i < nodes.size(); ++i) {
    const AssemblyNode& node = nodes[i];
    int inside = 1;
    for (const int part : {node.first, node.second})
      if (part >= 0) {
        demand((part < int(i) && !used[part]));
        used[part] = 1;
        inside += nodes[part].size;
      }
    demand(node.size == inside);
    if (node.second >= 0) demand((node.second == int(i) - 1 && node.first == node.second - nodes[node.second].size));  // one after the other
    switch (node.kind) {
      case Kind::body:
        demand(!seen[node.body]);
        seen[node.body] = 1;
        if (node.first >= 0) hang(node.first, node.body);
        ends[i] = {node.body, node.body, -1};
        break;
      case Kind::join: {
        const Ends &one = ends[node.first], &two = ends[node.second];
        demand((one.last == node.body && assembly.next()[node.body] == two.first && parents[two.first] == one.last));
        ends[i] = {one.first, two.last, -1};
        break;
      }
      case Kind::branches:
        hang(node.first, node.body), hang(node.second, node.body);
        ends[i].branches_of = node.body;
    }
  }
  for (const int root : assembly.roots()) {
    demand(!used[root]);
    used[root] = 1;
    hang(root, -1);
  }
  BOOST_TEST(std::accumulate(seen.begin(), seen.end(), 0) == int(parents.size()));
  BOOST_TEST(std::accumulate(used.begin(), used.end(), 0) == int(nodes.size()));
  BOOST_TEST(assembly.depth() <= most_per_doubling * std::log2(std::max<double>(parents.size(), 1)) + 4);
}

}  // namespace

BOOST_AUTO_TEST_CASE(small_ones) {
  check({}, 6);
  check({-1}, 6);
  check({-1, -1, -1}, 6);
  BOOST_TEST(AssemblyTree({}).depth() == 0);
  BOOST_TEST(AssemblyTree({-1}).depth() == 1);
  BOOST_TEST(AssemblyTree({-1, 0}).depth() == 2);
}

BOOST_AUTO_TEST_CASE(chains_are_halved) {
  for (const int count : {1, 2, 3, 4, 5, 8, 9, 100, 1000, 1000000}) {
    check(chain(count), 1);
    BOOST_TEST(AssemblyTree(chain(count)).depth() == 1 + int(std::ceil(std::log2(count))));
  }
}

BOOST_AUTO_TEST_CASE(every_tree_is_logarithmic) {
  check(tree(1000000, [](int) { return 0; }), 1);                       // a star
  check(tree(1000000, [](int k) { return (k - 1) / 2; }), 3);           // balanced
  check(tree(1000000, [](int k) { return (k - 1) / 10; }), 3);
  check(tree(1000000, [](int k) { return std::max(0, k - 2); }), 3);    // two chains from one body
  check(tree(1000000, [](int k) { return k % 2 ? std::max(0, k - 2) : k - 1; }), 3);  // a caterpillar
  check(comb(1000, 999), 3);
  check(comb(100000, 9), 3);
  check(comb(10, 99999), 3);
  std::mt19937 g(1);
  check(tree(1000000, [&](int k) { return int(g() % unsigned(k)); }), 3);
  check(tree(1000000, [&](int k) { return k - 1 - int(g() % unsigned(std::min(k, 20))); }), 3);
  check(std::vector<int>(1000000, -1), 1);  // nothing hangs together
}

// Worst for halving by weight: on every body of a chain a branch as large as the rest of the chain, again and again.
BOOST_AUTO_TEST_CASE(branches_as_large_as_what_follows) {
  std::vector<int> parents;
  const std::function<void(int, int)> grow = [&](int on, int count) {
    while (count > 0) {
      parents.push_back(on);
      const int body = int(parents.size()) - 1;
      grow(body, (count - 1) / 2);
      on = body, count = (count - 1) - (count - 1) / 2;
    }
  };
  grow(-1, 1000000);
  check(parents, 6);
}

BOOST_AUTO_TEST_CASE(random_small_trees) {
  std::mt19937 g(2);
  for (int round = 0; round < 500; ++round) {
    std::vector<int> parents;
    const int count = 1 + int(g() % 60), reach = 1 + int(g() % 60);
    for (int k = 0; k < count; ++k) parents.push_back(k - 1 - int(g() % unsigned(std::min(k + 1, reach))));
    check(parents, 6);
  }
}

BOOST_AUTO_TEST_CASE(pieces_and_the_rest_are_the_whole) {
  std::mt19937 g(3);
  const AssemblyTree assembly(tree(5000, [&](int k) { return k - 1 - int(g() % unsigned(std::min(k, 30))); }));
  std::vector<AssemblyTree::Piece> pieces;
  std::vector<int> rest;
  for (const int most : {0, 1, 10, 300, 5000, 100000}) {
    assembly.cut(most, pieces, rest);
    std::vector<int> owner(assembly.nodes().size(), -1);
    for (size_t p = 0; p < pieces.size(); ++p) {
      BOOST_TEST_REQUIRE(pieces[p].last - pieces[p].first <= most);
      for (int i = pieces[p].first; i < pieces[p].last; ++i) owner[i] = int(p);
    }
    size_t outside = 0;
    for (const int i : rest) BOOST_TEST_REQUIRE(owner[i] == -1);
    for (size_t i = 0; i < owner.size(); ++i) {
      outside += owner[i] < 0;
      for (const int part : {assembly.nodes()[i].first, assembly.nodes()[i].second})
        if (part >= 0 && owner[i] >= 0) BOOST_TEST_REQUIRE(owner[part] == owner[i]);  // a piece needs nothing of another
    }
    BOOST_TEST(outside == rest.size());
    BOOST_TEST((most < 100000 || rest.empty()));
  }
}
