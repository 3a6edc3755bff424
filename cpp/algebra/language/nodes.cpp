#include "algebra/language/nodes.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "algebra/language/memo.h"
#include "algebra/language/mixed_hash.h"

namespace pycraft {

namespace {

using Node = Expression::Node;

// The number in front and what it scales. Signs move freely, -(2X) is (-2)X, as they round nothing.
std::pair<Coefficient, const Expression*> scaling(const Node& n) {
  Coefficient c = n.coefficient;
  const Expression* x = &n.children[0];
  while (x->kind() == NodeKind::scaled && (abs(c) == 1 || abs(x->node().coefficient) == 1)) {
    c *= x->node().coefficient;
    x = &x->children()[0];
  }
  return {c, x};
}

// Spaces that are equal have the same.
size_t hash_of(const Space& s) {
  return s ? mix(mix(static_cast<size_t>(s.kind()), reinterpret_cast<size_t>(s.layout().owner)), s.dimension()) : 0;
}

size_t hash_of(const Node& n) {
  size_t h = mix(17, static_cast<size_t>(n.kind));
  switch (n.kind) {
    case NodeKind::symbol:
      h = mix(mix(mix(h, static_cast<size_t>(n.symbol.definition->id)), reinterpret_cast<size_t>(n.symbol.source.get())), reinterpret_cast<size_t>(n.symbol.binding.get()));
      return mix(h, hash_of(n.symbol.arguments));
    case NodeKind::block_function:
      return mix(mix(mix(h, static_cast<size_t>(n.symbol.definition->id)), reinterpret_cast<size_t>(n.symbol.source.get())), n.children[0].node().hash);
    case NodeKind::vector: return mix(mix(h, std::hash<std::string>()(n.name)), hash_of(n.codomain));
    case NodeKind::identity:
    case NodeKind::zero: return mix(mix(h, hash_of(n.domain)), hash_of(n.codomain));
    case NodeKind::constant: return mix(h, reinterpret_cast<size_t>(n.constant.get()));
    case NodeKind::external: return mix(h, reinterpret_cast<size_t>(n.external.get()));
    case NodeKind::scaled: {
      const auto [c, x] = scaling(n);
      return mix(mix(h, CoefficientHash()(c)), x->node().hash);
    }
    case NodeKind::sum: {
      size_t total = 0;  // whatever the order
      for (const Expression& c : n.children) total += mix(31, c.node().hash);
      return mix(h, total);
    }
    default:
      for (const Expression& c : n.children) h = mix(h, c.node().hash);
      return h;
  }
}

// What two nodes are beside their parts; `pairs` gets the parts that must be equal.
bool equal_but_for_parts(const Node& x, const Node& y, std::vector<std::pair<const Expression*, const Expression*>>& pairs) {
  if (x.hash != y.hash || x.kind != y.kind || x.children.size() != y.children.size()) return false;
  switch (x.kind) {
    case NodeKind::symbol: return x.symbol == y.symbol;
    case NodeKind::vector: return x.name == y.name && x.codomain == y.codomain;
    case NodeKind::identity: return x.domain == y.domain;
    case NodeKind::zero: return x.domain == y.domain && x.codomain == y.codomain;
    case NodeKind::constant: return x.constant == y.constant;
    case NodeKind::external: return x.external == y.external;
    case NodeKind::scaled: {
      const auto [c, s] = scaling(x);
      const auto [d, t] = scaling(y);
      pairs.emplace_back(s, t);
      return c == d;
    }
    case NodeKind::sum: {  // whatever the order: equal terms have equal hashes
      const auto by_hash = [](const Node& n) {
        std::vector<const Expression*> terms;
        for (const Expression& c : n.children) terms.push_back(&c);
        std::stable_sort(terms.begin(), terms.end(), [](auto* a, auto* b) { return a->node().hash < b->node().hash; });
        return terms;
      };
      const auto a = by_hash(x), b = by_hash(y);
      for (size_t i = 0; i < a.size(); ++i) pairs.emplace_back(a[i], b[i]);
      return true;
    }
    case NodeKind::block_function:
      if (x.symbol.definition != y.symbol.definition || x.symbol.source != y.symbol.source) return false;
      break;
    default: break;
  }
  for (size_t i = 0; i < x.children.size(); ++i) pairs.emplace_back(&x.children[i], &y.children[i]);
  return true;
}

}  // namespace

Parts::~Parts() {
  thread_local std::vector<Expression>* leaving = nullptr;
  if (empty()) return;
  if (leaving) {
    leaving->insert(leaving->end(), std::make_move_iterator(begin()), std::make_move_iterator(end()));
    return;
  }
  std::vector<Expression> todo;
  leaving = &todo;
  todo.swap(*this);
  while (!todo.empty()) {
    const Expression last = std::move(todo.back());
    todo.pop_back();
  }
  leaving = nullptr;
}

bool operator==(const Expression& a, const Expression& b) {
  if (a.get() == b.get()) return true;
  if (!a || !b || a.node().hash != b.node().hash) return false;
  std::vector<std::pair<const Expression*, const Expression*>> todo = {{&a, &b}};
  std::map<std::pair<const Node*, const Node*>, char> seen;
  while (!todo.empty()) {
    const auto [x, y] = todo.back();
    todo.pop_back();
    if (x->get() == y->get()) continue;
    if (!x->children().empty() && !seen.try_emplace({x->get(), y->get()}).second) continue;  // compared, or about to be
    if (!equal_but_for_parts(x->node(), y->node(), todo)) return false;
  }
  return true;
}

// Two threads may make one at the same time: the first one's is kept.
const std::shared_ptr<Memo>& MemoPlace::make() const {
  auto made = std::make_unique<std::shared_ptr<Memo>>(std::make_shared<Memo>());
  std::shared_ptr<Memo>* kept = nullptr;
  return kept_.compare_exchange_strong(kept, made.get(), std::memory_order_acq_rel) ? *made.release() : *kept;
}

Expression make_node(Node node, std::shared_ptr<Memo> memo) {
  node.hash = hash_of(node);
  node.depth = 1;
  for (const Expression& c : node.children) node.depth = std::max(node.depth, 1 + c.node().depth);
  if (memo) node.memo.share(std::move(memo));
  return Expression(std::make_shared<const Node>(std::move(node)));
}

}  // namespace pycraft
