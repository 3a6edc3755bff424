#include "algebra/language/properties.h"

#include <unordered_map>

#include "algebra/language/lower.h"
#include "algebra/language/source.h"

namespace pycraft {

namespace {

enum Triangle : unsigned { upper = 1, lower_ = 2, both = 3 };

unsigned flip(unsigned t) { return ((t & upper) ? lower_ : 0u) | ((t & lower_) ? upper : 0u); }

const Symbol* edge_symbol(const Expression& e, bool& transposed) {
  transposed = e.kind() == NodeKind::transpose;
  const Expression& inner = transposed ? e.children()[0] : e;
  if (inner.kind() != NodeKind::symbol || inner.node().symbol.definition->pattern != Pattern::edges) return nullptr;
  return &inner.node().symbol;
}

unsigned triangles(const Expression& e);

// f(block of a, block of b) of the blocks that both have at body k, in their order; false where they have not as many.
template <class F>
bool over_blocks(const Space& a, const Space& b, size_t k, F f) {
  const std::vector<int>&of_a = a.layout().of_body[k], &of_b = b.layout().of_body[k];
  if (of_a.size() != of_b.size()) return false;
  for (size_t i = 0; i < of_a.size(); ++i)
    if (!f(a.layout().blocks[of_a[i]], b.layout().blocks[of_b[i]])) return false;
  return true;
}

// Blocks over one model's bodies and over another's, of the same coordinates, add up to none over either.
bool cut_alike(const Expression& sum, const Expression& term) {
  return sum.floating() || term.floating() || (cut_alike(sum.domain(), term.domain()) && cut_alike(sum.codomain(), term.codomain()));
}
bool meet_cut_alike(const Expression& left, const Expression& right) {
  return left.floating() || right.floating() || cut_alike(left.domain(), right.codomain());
}

// From those of its parts.
unsigned triangles_of_node(const Expression& e) {
  switch (e.kind()) {
    case NodeKind::symbol: {
      const Symbol& symbol = e.node().symbol;
      const SymbolDefinition& d = *symbol.definition;
      switch (d.pattern) {
        case Pattern::block_diagonal:
        case Pattern::function: return both;
        case Pattern::edges:
        case Pattern::resolvent: return upper;
        case Pattern::compound: return triangles(lower(d.expand(symbol), true));
        case Pattern::vector: return 0;
      }
      return 0;
    }
    case NodeKind::identity:
    case NodeKind::square_root:
    case NodeKind::block_function:
    case NodeKind::block_diagonal: return both;
    case NodeKind::zero: return cut_alike(e.domain(), e.codomain()) ? both : 0u;
    case NodeKind::constant: return e.node().constant->blocks.empty() ? 0u : both;
    case NodeKind::vector:
    case NodeKind::external: return 0;
    case NodeKind::transpose: return flip(triangles(e.children()[0]));
    case NodeKind::scaled: return triangles(e.children()[0]);
    case NodeKind::inverse:  // of a block-triangular operator: so too, where the blocks on its diagonal are square
      return e.floating() || cut_equally(e.domain(), e.codomain()) ? triangles(e.children()[0]) : 0u;
    case NodeKind::sum: {
      unsigned t = both;
      for (const Expression& c : e.children()) t &= cut_alike(e, c) ? triangles(c) : 0u;
      return t;
    }
    case NodeKind::product: {
      // E X E* with X block diagonal is block diagonal: every body has one parent.
      const auto& f = e.children();
      bool first_transposed = false, last_transposed = false;
      const Symbol* first = edge_symbol(f.front(), first_transposed);
      const Symbol* last = edge_symbol(f.back(), last_transposed);
      if (f.size() >= 3 && first && last && *first == *last && !first_transposed && last_transposed) {
        bool inner = true;
        for (size_t i = 1; i + 1 < f.size(); ++i) inner &= triangles(f[i]) == both;
        if (inner) return both;
      }
      unsigned t = both;
      for (size_t i = 0; i < f.size(); ++i) t &= i && !meet_cut_alike(f[i - 1], f[i]) ? 0u : triangles(f[i]);
      return t;
    }
  }
  return 0;
}

// Found once for each node.
unsigned triangles(const Expression& e) {
  const auto known = [](const Expression& x) { return x.node().triangles.value(); };
  if (known(e) < 0) {
    std::vector<const Expression*> todo = {&e};
    while (!todo.empty()) {
      const Expression& x = *todo.back();
      const size_t before = todo.size();
      if (known(x) < 0)
        for (const Expression& c : x.children())
          if (known(c) < 0) todo.push_back(&c);
      if (todo.size() > before) continue;
      todo.pop_back();
      if (known(x) < 0) x.node().triangles.set(static_cast<int>(triangles_of_node(x)));
    }
  }
  return static_cast<unsigned>(known(e));
}

}  // namespace

bool is_block_diagonal(const Expression& e) { return triangles(e) == both; }
bool is_upper_triangular(const Expression& e) { return triangles(e) & upper; }
bool is_lower_triangular(const Expression& e) { return triangles(e) & lower_; }

bool cut_equally(const Space& a, const Space& b) {
  if (!cut_alike(a, b)) return false;
  if (a.layout_pointer() == b.layout_pointer()) return true;
  for (size_t k = 0; k < a.layout().of_body.size(); ++k)
    if (a.body_size(static_cast<int>(k)) != b.body_size(static_cast<int>(k))) return false;
  return true;
}

bool cut_at_the_same_rows(const Space& a, const Space& b) {
  if (!cut_alike(a, b)) return false;
  if (a.layout_pointer() == b.layout_pointer()) return true;
  for (size_t k = 0; k < a.layout().of_body.size(); ++k)
    if (!over_blocks(a, b, k, [](const auto& x, const auto& y) { return x.offset == y.offset && x.size == y.size; })) return false;
  return true;
}

bool cut_in_one_way(const Expression& e) {
  std::unordered_map<const void*, const void*> bodies;  // by whose coordinates they are
  bool one = true;
  visit(e, [&](const Expression& x) {
    if (!one || x.floating()) return;
    for (const Space& space : {x.domain(), x.codomain()})
      if (space.kind() == SpaceKind::Theta) one &= bodies.emplace(space.layout().owner, space.layout().bodies).first->second == space.layout().bodies;
  });
  return one;
}

bool is_symmetric(const Expression& e) {
  if (e.floating()) return true;
  if (!(e.domain() == e.codomain().dual())) return false;
  return lower(e, true) == lower(e.T(), true);
}

}  // namespace pycraft
