#include "algebra/language/properties.h"

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

// From those of its parts.
unsigned triangles_of_node(const Expression& e) {
  switch (e.kind()) {
    case NodeKind::symbol: {
      const Symbol& symbol = e.node().symbol;
      const SymbolDefinition& d = *symbol.definition;
      // Blocks over other bodies than those of its spaces: of no known structure there.
      if (d.pattern != Pattern::vector && !(cut_into_bodies_of(symbol.source->structure(), e.domain()) && cut_into_bodies_of(symbol.source->structure(), e.codomain())))
        return 0;
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
    case NodeKind::scaled:
    case NodeKind::inverse: return triangles(e.children()[0]);  // the inverse of a block-triangular operator is so too
    case NodeKind::sum: {
      unsigned t = both;
      for (const Expression& c : e.children()) t &= triangles(c);
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
      for (const Expression& c : f) t &= triangles(c);
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

bool is_symmetric(const Expression& e) {
  if (e.floating()) return true;
  if (!(e.domain() == e.codomain().dual())) return false;
  return lower(e, true) == lower(e.T(), true);
}

}  // namespace pycraft
