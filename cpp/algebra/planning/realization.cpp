#include "algebra/planning/realization.h"

#include <algorithm>
#include <map>

#include "algebra/language/display.h"
#include "algebra/language/lower.h"
#include "algebra/language/properties.h"
#include "algebra/language/source.h"
#include "algebra/planning/low_rank.h"
#include "algebra/planning/planner.h"
#include "runtime/interrupt.h"

namespace pycraft {

namespace {

// Rows of a pivot block. Beyond it, one inverse after the other made dense costs less than all of them in one elimination, unless the
// model is large.
int most_rows(const Space& domain) { return domain.dimension() <= 3000 ? 256 : 1024; }

// A vector of the expression as it is known so far: Σ coefficient · left · (edge) · right · state. State -1 is the input.
struct SignalTerm {
  int state;
  Coefficient coefficient = 1;
  int right = -1, left = -1;
  Shift shift = Shift::none;
  int context = -1;
  bool operator==(const SignalTerm&) const = default;
};
struct Signal {
  Space space;
  std::vector<SignalTerm> terms;
};

}  // namespace

class RealizationBuilder {
 public:
  RealizationBuilder(Planner& planner, std::string& reason) : planner_(planner), reason_(reason), r_(std::make_shared<Realization>()) {}

  std::shared_ptr<const Realization> build(const Expression& e, bool local_ends) {
    r_->domain = e.domain();
    r_->codomain = e.codomain();
    const auto models = contexts(e);
    if (models.empty()) return fail("no tree in it");
    if (!planner_.one_cut_) return fail("its coordinates are cut into bodies in two ways");
    r_->tree = models[0].source;
    const SkoStructure& tree = r_->tree->structure();
    for (const Context& c : models)
      if (c.source->structure().parent != tree.parent) return fail("it mixes two different trees");
    Signal input{e.domain(), {{-1}}};
    if (local_ends || e.domain().kind() == SpaceKind::Euclidean) {
      if (!materialise(input)) return nullptr;
    }
    Signal output;
    if (!apply(e, input, output)) return nullptr;
    const bool shifted = std::any_of(output.terms.begin(), output.terms.end(), [](const SignalTerm& t) { return t.shift != Shift::none; });
    if (shifted || local_ends || e.codomain().kind() == SpaceKind::Euclidean)
      if (!materialise(output)) return nullptr;
    for (const SignalTerm& t : output.terms) r_->outputs.push_back({-1, t.state, t.coefficient, t.right, t.left, t.shift, t.context});
    if (!check_sizes(tree)) return nullptr;
    order_states();
    return r_;
  }

 private:
  std::shared_ptr<const Realization> fail(const std::string& reason) {
    if (reason_.empty()) reason_ = reason;
    return nullptr;
  }
  bool refuse(const std::string& reason) {
    if (reason_.empty()) reason_ = reason;
    return false;
  }

  int new_state(const Space& space) {
    r_->states.push_back(space);
    r_->equations.push_back(space);
    count_rows(space);
    return static_cast<int>(r_->states.size()) - 1;
  }

  void count_rows(const Space& space) {
    const int bodies = std::max(1, r_->tree ? r_->tree->structure().bodies() : 1);
    if (space.belongs_to_bodies()) rows_ += (space.dimension() + bodies - 1) / bodies;
  }

  // Adds f · signal to equation `row`.
  void add_to_equation(int row, const Signal& signal, double f) {
    for (const SignalTerm& t : signal.terms) {
      if (t.state < 0)
        r_->inputs.push_back({row, -1, -f * t.coefficient, t.right, t.left, Shift::none, -1});  // moved to the right side
      else
        r_->terms.push_back({row, t.state, f * t.coefficient, t.right, t.left, t.shift, t.context});
    }
  }

  static bool plain(const Signal& s) {
    return s.terms.size() == 1 && s.terms[0].coefficient == 1 && s.terms[0].right < 0 && s.terms[0].left < 0 && s.terms[0].shift == Shift::none &&
           s.terms[0].state >= 0;
  }

  // s - signal = 0: the signal gets a state of its own.
  bool materialise(Signal& signal) {
    if (plain(signal)) return true;
    const int s = new_state(signal.space);
    r_->terms.push_back({s, s, 1.0});
    add_to_equation(s, signal, -1.0);
    signal.terms = {{s}};
    return true;
  }

  static bool has_input(const Signal& s) {
    return std::any_of(s.terms.begin(), s.terms.end(), [](const SignalTerm& t) { return t.state < 0; });
  }
  static bool has_shift(const Signal& s) {
    return std::any_of(s.terms.begin(), s.terms.end(), [](const SignalTerm& t) { return t.shift != Shift::none; });
  }

  // The same expression of the same signal is the same signal: shared parts of an expression share their states.
  bool apply(const Expression& e, const Signal& x, Signal& y) {
    check_interrupt();
    std::vector<Known>& known = known_[{planner_.id_of(e), key_of(x)}];
    for (const Known& k : known)
      if (k.input == x.terms) {
        y = k.output;
        return true;
      }
    if (!compute(e, x, y)) return false;
    known.push_back({x.terms, y});
    return true;
  }

  bool compute(const Expression& e, const Signal& x, Signal& y) {
    if (rows_ > most_rows(r_->domain)) return refuse("its realization has more than " + std::to_string(most_rows(r_->domain)) + " states on a body");
    y.space = e.codomain();
    y.terms.clear();
    switch (e.kind()) {
      case NodeKind::identity: y.terms = x.terms; return true;
      case NodeKind::zero: return true;
      case NodeKind::scaled:
        if (!apply(e.children()[0], x, y)) return false;
        for (SignalTerm& t : y.terms) t.coefficient *= e.node().coefficient;
        return true;
      case NodeKind::sum: {
        for (const Expression& c : e.children()) {
          Signal part;
          if (!apply(c, x, part)) return false;
          y.terms.insert(y.terms.end(), part.terms.begin(), part.terms.end());
        }
        collect(y);
        return true;
      }
      case NodeKind::product: return product(e, x, y);
      default: break;
    }
    if (tree_space(e) && is_block_diagonal(e)) {
      multiply(planner_.blocks(e), x, y);
      return true;
    }
    bool transposed = e.kind() == NodeKind::transpose;
    const Expression& inner = transposed ? e.children()[0] : e;
    if (inner.kind() == NodeKind::symbol) return letter(e, inner.node().symbol, transposed, x, y);
    if (inner.kind() == NodeKind::constant) return border(inner.node().constant, transposed, e, x, y);
    if (e.kind() == NodeKind::inverse) return inverse(e.children()[0], x, y);
    if (inner.kind() == NodeKind::external) return refuse(show(inner) + " is an operator of unknown structure");
    return refuse(show(e) + " is no tree operator");
  }

  bool product(const Expression& e, const Signal& x, Signal& y) {
    Signal s = x;
    const auto& f = e.children();
    size_t end = f.size();
    while (end > 0) {
      // A run of block-diagonal factors is one block register.
      size_t begin = end;
      while (begin > 0 && tree_space(f[begin - 1]) && is_block_diagonal(f[begin - 1])) --begin;
      Signal next;
      if (begin < end) {
        const Expression run = product_of(std::vector<Expression>(f.begin() + begin, f.begin() + end));
        next.space = run.codomain();
        multiply(planner_.blocks(run), s, next);
        end = begin;
      } else if (!apply(f[--end], s, next)) {
        return false;
      }
      s = next;
    }
    y = s;
    y.space = e.codomain();
    return true;
  }

  // e: the letter, or its transpose.
  bool letter(const Expression& e, const Symbol& symbol, bool transposed, const Signal& x, Signal& y) {
    switch (symbol.definition->pattern) {
      case Pattern::compound: return apply(lower(e, true), x, y);
      case Pattern::edges: return shift(symbol, transposed, x, y);
      case Pattern::resolvent: return resolvent(symbol, transposed, x, y);
      case Pattern::vector: return refuse("the vector " + show(transposed ? e.children()[0] : e) + " in it is no tree operator");
      default: return refuse(show(transposed ? e.children()[0] : e) + " has blocks over other bodies than those of its spaces");
    }
  }

  // y = X⁻¹ x: states w with X w = x.
  bool inverse(const Expression& X, const Signal& x, Signal& y) {
    if (!same_cut(X.domain(), X.codomain())) return refuse(show(X) + " has no square blocks");
    Signal w{X.domain(), {}};
    const int s = static_cast<int>(r_->states.size());
    implicit_.push_back(s);
    r_->states.push_back(X.domain());
    r_->equations.push_back(X.codomain());
    count_rows(X.domain());
    w.terms = {{s}};
    Signal image;
    if (!apply(X, w, image)) return false;
    add_to_equation(s, image, 1.0);
    add_to_equation(s, x, -1.0);
    y.terms = w.terms;
    return true;
  }

  // Terms on the same state through the same factors are one.
  static void collect(Signal& s) {
    std::vector<SignalTerm> kept;
    for (const SignalTerm& t : s.terms) {
      auto same = std::find_if(kept.begin(), kept.end(), [&](const SignalTerm& k) {
        return k.state == t.state && k.right == t.right && k.left == t.left && k.shift == t.shift && k.context == t.context;
      });
      if (same == kept.end())
        kept.push_back(t);
      else
        same->coefficient += t.coefficient;
    }
    std::erase_if(kept, [](const SignalTerm& t) { return t.coefficient == 0; });
    s.terms = std::move(kept);
  }

  // y = B x for a block register.
  void multiply(int block, const Signal& x, Signal& y) {
    for (SignalTerm t : x.terms) {
      int& place = t.shift == Shift::none ? t.right : t.left;
      place = place < 0 ? block : planner_.multiply_blocks(block, place);
      y.terms.push_back(t);
    }
  }

  // y = E x or E* x.
  bool shift(const Symbol& symbol, bool transposed, const Signal& x, Signal& y) {
    Signal s = x;
    if (has_shift(s) || has_input(s)) materialise(s);
    const int context = planner_.context_of(symbol, Group::kinematics);
    for (SignalTerm t : s.terms) {
      t.shift = transposed ? Shift::down : Shift::up;
      t.context = context;
      y.terms.push_back(t);
    }
    return true;
  }

  // s - E s - x = 0, E_ψ = E τ̄ for ψ.
  bool resolvent(const Symbol& symbol, bool transposed, const Signal& x, Signal& y) {
    const bool articulated_sweep = symbol.definition->id == SymbolId::psi;
    const int s = new_state(y.space);
    const int context = planner_.context_of(symbol, symbol.definition->groups);
    r_->terms.push_back({s, s, 1.0});
    Realization::Term edge{s, s, -1.0};
    edge.shift = transposed ? Shift::down : Shift::up;
    edge.context = context;
    if (articulated_sweep) {
      const Expression bar = make_symbol(SymbolId::tau_bar, symbol.source, symbol.binding);
      const int block = planner_.blocks(lower(transposed ? bar.T() : bar, true));
      (transposed ? edge.left : edge.right) = block;
    }
    r_->terms.push_back(edge);
    add_to_equation(s, x, -1.0);
    y.terms = {{s}};
    return true;
  }

  // A dense constant between a tree space and R^n, or within R^n: a low-rank border.
  bool border(const std::shared_ptr<const ConstantData>& constant, bool transposed, const Expression& e, const Signal& x, Signal& y) {
    const bool in = e.domain().kind() == SpaceKind::Euclidean, out = e.codomain().kind() == SpaceKind::Euclidean;
    Signal s = x;
    materialise(s);
    if (!in && !out) {  // of low rank: through R^r
      const int rows = (transposed ? e.domain() : e.codomain()).dimension(), columns = (transposed ? e.codomain() : e.domain()).dimension();
      const auto factors = low_rank_factors(*constant, rows, columns, planner_.more_digits_);
      if (!factors) return refuse("the constant " + constant->name + " is a full matrix between tree spaces");
      const int middle = new_state(Space::euclidean(factors->rank));  // C(I,J) middle = C(I,:) s
      r_->border_terms.push_back({middle, middle, 1.0, factors->core, transposed});
      r_->border_terms.push_back({middle, s.terms[0].state, -1.0, transposed ? factors->columns : factors->rows, transposed});
      const int row = new_state(y.space);
      r_->terms.push_back({row, row, 1.0});
      r_->border_terms.push_back({row, middle, -1.0, transposed ? factors->rows : factors->columns, transposed});
      y.terms = {{row}};
      return true;
    }
    const int row = new_state(y.space);
    r_->terms.push_back({row, row, 1.0});
    r_->border_terms.push_back({row, s.terms[0].state, -1.0, constant, transposed});
    y.terms = {{row}};
    return true;
  }

  static bool tree_space(const Expression& e) { return e.domain().belongs_to_bodies() && e.codomain().belongs_to_bodies(); }
  static bool same_cut(const Space& a, const Space& b) {
    if (a.kind() == SpaceKind::Euclidean || b.kind() == SpaceKind::Euclidean) return a.dimension() == b.dimension() && a.kind() == b.kind();
    return cut_equally(a, b);
  }

  // States that their equations give explicitly (of resolvents and shifts) come before those of inverses, inner inverses before outer ones:
  // the pivots of the former are ones, and what is left for an inverse is its Schur complement, D of the Riccati sweep where it is a mass
  // matrix. In the order in which they were met, resolvents would be eliminated through an inverse that lacks what outboard bodies add.
  void order_states() {
    const int count = static_cast<int>(r_->states.size());
    std::vector<int> order, at(count);
    for (int s = 0; s < count; ++s)
      if (std::find(implicit_.begin(), implicit_.end(), s) == implicit_.end()) order.push_back(s);
    order.insert(order.end(), implicit_.rbegin(), implicit_.rend());
    std::vector<Space> states, equations;
    for (int i = 0; i < count; ++i) {
      at[order[i]] = i;
      states.push_back(r_->states[order[i]]);
      equations.push_back(r_->equations[order[i]]);
    }
    r_->states = std::move(states), r_->equations = std::move(equations);
    const auto move = [&](int& s) {
      if (s >= 0) s = at[s];
    };
    for (auto* terms : {&r_->terms, &r_->inputs, &r_->outputs})
      for (Realization::Term& t : *terms) move(t.row), move(t.column);
    for (Realization::Border& t : r_->border_terms) move(t.row), move(t.column);
  }

  bool check_sizes(const SkoStructure& tree) {
    for (const auto* spaces : {&r_->states, &r_->equations})
      for (const Space& s : *spaces)
        if (s.belongs_to_bodies() && static_cast<int>(s.layout().of_body.size()) != tree.bodies()) return refuse("its spaces are cut into different bodies");
    return true;
  }

  Planner& planner_;
  std::string& reason_;
  std::shared_ptr<Realization> r_;
  int rows_ = 0;   // states on a body, about
  std::vector<int> implicit_;   // states of inverses, outer ones first
  struct Known {
    std::vector<SignalTerm> input;
    Signal output;
  };
  std::map<std::pair<int, size_t>, std::vector<Known>> known_;  // by expression and a key of its input
  static size_t key_of(const Signal& s) {
    size_t key = s.terms.size();
    for (const SignalTerm& t : s.terms) key = key * 1000003 + size_t(t.state + 2) * 31 + size_t(t.right + 2) * 7 + size_t(t.left + 2);
    return key;
  }
};

std::shared_ptr<const Realization> build_realization(Planner& planner, const Expression& e, bool local_ends, std::string& reason) {
  return RealizationBuilder(planner, reason).build(e, local_ends);
}

}  // namespace pycraft
