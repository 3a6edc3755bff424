// Expressions: what a user wrote, as data. An expression holds no numbers but the user's own constants; its parts are shared and
// immutable; constructors check spaces and never rewrite (semantics: what was typed is what is shown). Sums and products are kept flat.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "algebra/language/space.h"
#include "algebra/language/symbol.h"
#include "numerics/coefficient.h"

namespace pycraft {

class Memo;

enum class NodeKind { symbol, vector, identity, zero, constant, external, sum, product, scaled, transpose, inverse, block_diagonal, square_root, block_function };

// A user's numbers. Cut into tree blocks where they are block diagonal over the bodies; else dense.
struct ConstantData {
  std::vector<double> dense;                // row-major (codomain, domain); empty where blocks are kept
  std::vector<std::vector<double>> blocks;  // per body, row-major
  bool symmetric = false;
  std::string name;
};

// Somebody else's linear operator: double precision only.
struct ExternalData {
  std::function<void(const double* x, double* y, int columns)> apply, apply_transposed;  // row-major columns
  std::string name;
};

// A fact about a node that is found when it is first asked for; a copy of the node starts without it.
class Found {
 public:
  Found() = default;
  Found(const Found&) {}
  Found& operator=(const Found&) { return value_ = -1, *this; }
  int value() const { return value_.load(std::memory_order_relaxed); }  // -1: not known yet
  void set(int value) const { value_.store(value, std::memory_order_relaxed); }

 private:
  mutable std::atomic<int> value_{-1};
};

// The memo of a node, made when it is first asked for: most nodes are never evaluated. A copy of the node starts without one.
class MemoPlace {
 public:
  MemoPlace() = default;
  MemoPlace(const MemoPlace&) {}
  MemoPlace(MemoPlace&& other) noexcept : kept_(other.kept_.exchange(nullptr)) {}
  MemoPlace& operator=(const MemoPlace&) = delete;
  ~MemoPlace() { delete kept_.load(std::memory_order_relaxed); }
  const std::shared_ptr<Memo>& operator()() const {
    if (const std::shared_ptr<Memo>* kept = kept_.load(std::memory_order_acquire)) return *kept;
    return make();
  }
  // That of another node; only before anybody asks.
  void share(std::shared_ptr<Memo> memo) { kept_.store(new std::shared_ptr<Memo>(std::move(memo)), std::memory_order_release); }

 private:
  const std::shared_ptr<Memo>& make() const;
  mutable std::atomic<std::shared_ptr<Memo>*> kept_{nullptr};
};

class Expression {
 public:
  struct Node;
  Expression() = default;
  explicit Expression(std::shared_ptr<const Node> node) : node_(std::move(node)) {}
  explicit operator bool() const { return node_ != nullptr; }
  const Node& node() const { return *node_; }
  const Node* get() const { return node_.get(); }
  NodeKind kind() const;
  const Space& domain() const;    // empty for an identity that has not met an operator yet
  const Space& codomain() const;
  const std::vector<Expression>& children() const;
  bool floating() const { return !domain(); }
  bool is(SymbolId id) const;     // this very symbol, not transposed

  Expression T() const;
  Expression inv() const;

  // The same expression with every symbol that is not bound yet bound to this state.
  Expression at(std::shared_ptr<const Binding> binding) const;
  // Throws StaleOperatorError if a model's structure changed since.
  void check_current() const;

 private:
  std::shared_ptr<const Node> node_;
};

// The parts of a node. They go one after the other when it goes, not one within the other: any depth is taken apart.
class Parts : public std::vector<Expression> {
 public:
  using std::vector<Expression>::vector;
  Parts(std::vector<Expression> parts) : std::vector<Expression>(std::move(parts)) {}
  Parts(const Parts&) = default;
  Parts(Parts&&) = default;
  Parts& operator=(const Parts&) = default;
  Parts& operator=(Parts&&) = default;
  ~Parts();
};

struct Expression::Node {
  NodeKind kind;
  Space domain, codomain;
  Parts children;
  Coefficient coefficient = 1;                  // scaled
  Symbol symbol{};                              // symbol, block_function (the function, and whose); of every leaf: its binding
  std::string name;                             // vector
  std::shared_ptr<const ConstantData> constant;
  std::shared_ptr<const ExternalData> external;
  size_t hash = 0;
  int depth = 1;                                // levels of nodes, this one included
  MemoPlace memo;                               // filled at the first evaluation; what is kept holds no expression, so no cycle
  Found triangles;                              // see properties.cpp
  Found lowered, spelled_out;                   // that lowering leaves it as it is, without and with expanding: see lower.cpp
};

inline NodeKind Expression::kind() const { return node_->kind; }
inline const Space& Expression::domain() const { return node_->domain; }
inline const Space& Expression::codomain() const { return node_->codomain; }
inline const std::vector<Expression>& Expression::children() const { return node_->children; }
inline bool Expression::is(SymbolId id) const { return kind() == NodeKind::symbol && node_->symbol.definition->id == id; }

// Structural, after flattening; sums whatever their order.
bool operator==(const Expression& a, const Expression& b);
inline bool operator!=(const Expression& a, const Expression& b) { return !(a == b); }
struct ExpressionHash {
  size_t operator()(const Expression& e) const { return e.node().hash; }
};

Expression make_symbol(const SymbolDefinition& definition, std::shared_ptr<SkoSource> source, SymbolArguments arguments = {},
                       std::string argument_text = "");
Expression make_symbol(SymbolId id, std::shared_ptr<SkoSource> source, std::shared_ptr<const Binding> binding = nullptr);
Expression make_vector(const std::string& name, const Space& space);
Expression identity();
Expression identity(const Space& space);
Expression zero(const Space& domain, const Space& codomain);
// dense: row-major (codomain, domain). Recognises what is block diagonal over the bodies.
Expression constant(std::vector<double> dense, const Space& domain, const Space& codomain, const std::string& name);
Expression constant_blocks(std::vector<std::vector<double>> blocks, const Space& domain, const Space& codomain, const std::string& name);
Expression external(std::shared_ptr<const ExternalData> data, const Space& domain, const Space& codomain);

Expression operator+(const Expression& a, const Expression& b);
Expression operator-(const Expression& a, const Expression& b);
Expression operator-(const Expression& a);
Expression operator*(const Expression& a, const Expression& b);
Expression operator*(const Coefficient& c, const Expression& a);
inline Expression operator*(const Expression& a, const Coefficient& c) { return c * a; }
inline Expression operator/(const Expression& a, const Coefficient& c) { return (1 / c) * a; }
Expression sum_of(std::vector<Expression> terms);
Expression product_of(std::vector<Expression> factors);
Expression block_diagonal(const Expression& a);
// L with A = L L*, block by block lower triangular (Cholesky), of an A that is known to be symmetric and block diagonal: `square_root` of
// algebra/planning/square_root.h sees to it.
Expression square_root_of(const Expression& a);
Expression power(const Expression& a, int exponent);
// A block-diagonal operator made of an operand, body by body (Pattern::function); linear in it.
Expression block_function(const SymbolDefinition& function, std::shared_ptr<SkoSource> source, std::shared_ptr<const Binding> binding, const Expression& operand);
// The lower triangle of every diagonal block with half its diagonal: what differentiates a Cholesky factor.
Expression lower_half(const Expression& a);

// An identity (or an expression made of identities alone) given its space.
Expression with_space(const Expression& e, const Space& space);

// Every distinct (source, binding) below, in order of appearance.
struct Context {
  std::shared_ptr<SkoSource> source;
  std::shared_ptr<const Binding> binding;
};
inline bool operator==(const Context& a, const Context& b) { return a.source == b.source && a.binding == b.binding; }
std::vector<Context> contexts(const Expression& e);

// The batch of states that e is bound to, -1 for none; throws EvaluationError for two batches. What `at` bound counts, also where no
// number of it hangs on a state: the value of a batch is a batch, whatever theorems make of it.
int batch_of(const Expression& e);
// `made`, found equal to or derived from `typed`, bound to the same batch: by a zero that remembers it where nothing else is left of it.
Expression with_batch_of(const Expression& typed, const Expression& made);

// Calls f on every node below and including e, each once and after what is below it. Iterative: any depth, any sharing.
template <class F>
void each_from_below(const Expression& e, F f) {
  std::unordered_set<const Expression::Node*> seen = {e.get()};
  std::vector<std::pair<const Expression*, size_t>> path = {{&e, 0}};
  while (!path.empty()) {
    auto& [x, next] = path.back();
    if (next < x->children().size()) {
      const Expression& child = x->children()[next++];
      if (seen.insert(child.get()).second) path.emplace_back(&child, 0);
    } else {
      const Expression& done = *x;
      path.pop_back();
      f(done);
    }
  }
}

// Calls f on every node below and including e, each once and before what is below it.
void visit(const Expression& e, const std::function<void(const Expression&)>& f);

}  // namespace pycraft
