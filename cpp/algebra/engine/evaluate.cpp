#include "algebra/engine/evaluate.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>

#include "algebra/engine/plan_cache.h"
#include "algebra/language/display.h"
#include "algebra/language/memo.h"
#include "runtime/errors.h"

namespace pycraft {

std::shared_ptr<ExecutionPool> prepare(const Expression& e, Request request, bool rules) {
  return e.node().memo()->get<PlanCache>().find_or_make(e, request, PlanOptions{rules});
}

void evaluate(const Expression& e, Request request, const Inputs& inputs, Result& result, bool rules, bool expansions) {
  while (!prepare(e, request, rules)->run(inputs, expansions, result)) check_interrupt();
}

void apply(const Expression& e, const Inputs& inputs, Result& result, bool rules, bool expansions) {
  evaluate(e, Request::apply, inputs, result, rules, expansions);
}

void evaluate(const Expression& e, Request request, Result& result, bool rules, bool expansions) {
  evaluate(e, request, Inputs{}, result, rules, expansions);
}

namespace {

using Widest = Digits100;

// Sums are taken in it, so that a difference of two scalars keeps what the engine computed.
Widest widened(const std::vector<double>& parts) {
  Widest sum = 0;
  for (auto p = parts.rbegin(); p != parts.rend(); ++p) sum += Widest(*p);
  return sum;
}

// The value, or one for each state of a batch.
struct Values {
  std::vector<Widest> of = {Widest(0)};
  int batch = -1;
};

// f(a, b), state by state; what has no batch is the same in each.
template <class F>
Values together(const Values& a, const Values& b, F f) {
  if (a.batch >= 0 && b.batch >= 0 && a.batch != b.batch) throw EvaluationError("batches of different lengths in one scalar");
  Values all{{}, std::max(a.batch, b.batch)};
  const size_t states = all.batch < 0 ? 1 : all.batch;
  for (size_t i = 0; i < states; ++i) all.of.push_back(f(a.of[a.batch < 0 ? 0 : i], b.of[b.batch < 0 ? 0 : i]));
  return all;
}

// Of what is no sum, product, ... of others.
std::optional<Request> request_of(const Scalar& s) {
  switch (s.node().kind) {
    case ScalarKind::trace: return Request::trace;
    case ScalarKind::logdet: return Request::logdet;
    case ScalarKind::norm: return Request::norm;
    default: return std::nullopt;
  }
}

Values values_of(const Scalar& s, bool rules) {
  const auto& n = s.node();
  switch (n.kind) {
    case ScalarKind::number: return {{Widest(n.value)}};
    case ScalarKind::sum:
    case ScalarKind::product: {
      const bool sum = n.kind == ScalarKind::sum;
      Values all{{Widest(sum ? 0 : 1)}};
      for (const Scalar& t : n.terms)
        all = together(all, values_of(t, rules), [&](const Widest& x, const Widest& y) { return sum ? Widest(x + y) : Widest(x * y); });
      return all;
    }
    case ScalarKind::scaled: {
      Values all = values_of(n.terms[0], rules);
      for (Widest& x : all.of) x *= Widest(n.value);
      return all;
    }
    case ScalarKind::reciprocal: {
      Values all = values_of(n.terms[0], rules);
      for (size_t i = 0; i < all.of.size(); ++i)
        naming_state(static_cast<int>(i), static_cast<int>(all.of.size()), [&] {
          if (all.of[i] == 0) throw SingularOperatorError(show(n.terms[0]) + " is divided by, and is 0 here");
          all.of[i] = 1 / all.of[i];
        });
      return all;
    }
    default: break;
  }
  Result r;
  evaluate(n.operand, *request_of(s), r, rules, true);
  Values all{{}, r.batch};
  for (size_t i = 0; i < (r.batch >= 0 ? size_t(r.batch) : 1); ++i) all.of.push_back(widened(r.expansions[i]));
  return all;
}

}  // namespace

std::vector<double> evaluate(const Scalar& s, int* batch, bool rules) {
  if (const auto request = request_of(s)) {  // a number of one run, rounded as it leaves it
    Result r;
    evaluate(s.node().operand, *request, r, rules);
    if (batch) *batch = r.batch;
    return std::move(r.values);
  }
  const Values all = values_of(s, rules);
  if (batch) *batch = all.batch;
  std::vector<double> rounded;
  for (const Widest& x : all.of) rounded.push_back(to_double(x));
  return rounded;
}

// ------------------------------------------------------------------ residuals

namespace {

constexpr int probe_above = 400, probe_count = 8;

// Random signs, the same for the same size.
std::vector<double> probes(int dimension) {
  std::mt19937 generator(static_cast<unsigned>(dimension));
  std::vector<double> x(size_t(dimension) * probe_count);
  for (double& s : x) s = generator() & 1 ? 1.0 : -1.0;
  return x;
}

// Largest entry of e (signed, if the positive part alone counts), of all blocks or of those on one path to the base.
double largest_entry(const Expression& e, const std::map<std::string, std::vector<double>>& vectors, bool on_one_path, bool positive_part) {
  Result r;
  Inputs inputs;
  inputs.vectors = vectors;
  std::vector<double> x;
  if (e.domain().dimension() > probe_above && !on_one_path) {
    x = probes(e.domain().dimension());
    inputs.x = x.data();
    inputs.columns = probe_count;
    evaluate(e, Request::apply, inputs, r, false);
  } else {
    evaluate(e, Request::dense, inputs, r, false);
  }
  std::vector<int> row_body, column_body;
  const SkoStructure* tree = nullptr;
  if (on_one_path) {
    for (const Context& c : contexts(e))
      if (cut_alike(c.source->motions(), e.codomain()) && cut_alike(c.source->motions(), e.domain())) tree = &c.source->structure();
    if (!tree) throw SpaceError("blocks on one path of " + show(e) + ": " + e.domain().description() + " and " + e.codomain().description() + " are not cut into the bodies of one model");
    row_body.resize(r.rows), column_body.resize(r.columns);
    for (const auto& block : e.codomain().layout().blocks) std::fill_n(row_body.begin() + block.offset, block.size, block.body);
    for (const auto& block : e.domain().layout().blocks) std::fill_n(column_body.begin() + block.offset, block.size, block.body);
  }
  const auto related = [&](int i, int j) {
    int low = std::max(i, j);
    const int high = std::min(i, j);
    while (low > high) low = tree->parent[low];
    return low == high;
  };
  double top = 0;
  for (int i = 0; i < r.rows; ++i)
    for (int j = 0; j < r.columns; ++j) {
      if (on_one_path && !related(row_body[i], column_body[j])) continue;
      const double value = r.values[size_t(i) * r.columns + j], counted = positive_part ? std::max(value, 0.0) : std::abs(value);
      if (!(counted <= top)) top = counted;  // lets a NaN through
    }
  return top;
}

}  // namespace

Residual residual(const Expression& left, const Expression& right, const std::map<std::string, std::vector<double>>& vectors, bool on_one_path, bool at_most) {
  const Expression a = left.floating() && !right.floating() ? with_space(left, right.domain()) : left;
  const Expression b = right.floating() && !left.floating() ? with_space(right, left.domain()) : right;
  if (a.floating()) throw SpaceError("a residual of " + show(a) + " and " + show(b) + ": they have no space yet");
  // The difference is planned as typed, so that it is taken at the full precision.
  return {largest_entry(a - b, vectors, on_one_path, at_most), largest_entry(a, vectors, on_one_path, false), largest_entry(b, vectors, on_one_path, false)};
}

Residual residual(const Scalar& a, const Scalar& b) {
  return {std::abs(evaluate(a - b, nullptr, false)[0]), std::abs(evaluate(a, nullptr, false)[0]), std::abs(evaluate(b, nullptr, false)[0])};
}

}  // namespace pycraft
