#include "algebra/language/scalar_expression.h"

#include <algorithm>
#include <cstdlib>

#include "algebra/language/display.h"
#include "runtime/errors.h"

namespace pycraft {

const char* scalar_kind_name(ScalarKind kind) {
  static const char* const names[] = {"number", "trace", "logdet", "norm", "sum", "scaled", "product", "reciprocal"};
  return names[static_cast<int>(kind)];
}

namespace {

constexpr size_t most_factors = 1000;

void require_square(const Expression& e, const char* what) {
  if (e.floating()) throw SpaceError(std::string(what) + " of I: it has no space yet");
  if (e.domain().dimension() != e.codomain().dimension())
    throw SpaceError(std::string(what) + " of " + show(e) + ", which maps " + e.domain().description() + " to " + e.codomain().description() +
                     ": it is not square");
}

}  // namespace

Scalar::Scalar(Node node) {
  for (const Scalar& t : node.terms) node.depth = std::max(node.depth, 1 + t.node().depth);
  if (node.depth > most_levels)
    throw EvaluationError("a scalar of sums within multiples and products within sums, " + std::to_string(node.depth) + " levels deep: evaluate a part of it, and go on with the number");
  node_ = std::make_shared<const Node>(std::move(node));
}

Scalar number(const Coefficient& value) { return Scalar({ScalarKind::number, value, {}, {}}); }
Scalar trace(const Expression& e) {
  require_square(e, "trace");
  return Scalar({ScalarKind::trace, 0, e, {}});
}
Scalar logdet(const Expression& e) {
  require_square(e, "logdet");
  return Scalar({ScalarKind::logdet, 0, e, {}});
}
Scalar norm(const Expression& e) {
  if (e.floating()) throw SpaceError("norm of I: it has no space yet");
  return Scalar({ScalarKind::norm, 0, e, {}});
}
Scalar operator+(const Scalar& a, const Scalar& b) {
  std::vector<Scalar> terms;
  for (const Scalar& s : {a, b}) {
    if (s.node().kind == ScalarKind::sum)
      terms.insert(terms.end(), s.node().terms.begin(), s.node().terms.end());
    else
      terms.push_back(s);
  }
  return Scalar({ScalarKind::sum, 0, {}, std::move(terms)});
}
Scalar operator*(const Coefficient& c, const Scalar& a) { return Scalar({ScalarKind::scaled, c, {}, {a}}); }
Scalar operator-(const Scalar& a, const Scalar& b) { return a + -1 * b; }

// Flat; numbers in front of factors are one number in front of the product.
Scalar operator*(const Scalar& a, const Scalar& b) {
  Coefficient c = 1;
  std::vector<Scalar> factors;
  for (Scalar s : {a, b}) {
    while (s.node().kind == ScalarKind::scaled) {
      c *= s.node().value;
      s = Scalar(s.node().terms[0]);
    }
    if (s.node().kind == ScalarKind::number)
      c *= s.node().value;
    else if (s.node().kind == ScalarKind::product)
      factors.insert(factors.end(), s.node().terms.begin(), s.node().terms.end());
    else
      factors.push_back(s);
  }
  if (factors.size() > most_factors) throw EvaluationError("a product of more than " + std::to_string(most_factors) + " scalars: evaluate a part of it, and go on with the number");
  if (factors.empty()) return number(c);
  const Scalar product = factors.size() == 1 ? factors[0] : Scalar({ScalarKind::product, 0, {}, std::move(factors)});
  return c == 1 ? product : c * product;
}

Scalar reciprocal(const Scalar& a) {
  if (a.node().kind == ScalarKind::reciprocal) return a.node().terms[0];
  if (a.node().kind == ScalarKind::number && !a.node().value.is_zero()) return number(1 / a.node().value);
  return Scalar({ScalarKind::reciprocal, 0, {}, {a}});
}

Scalar power(const Scalar& a, int exponent) {
  if (std::abs(double(exponent)) > double(most_factors)) throw EvaluationError("scalar ** " + std::to_string(exponent) + ": a power is a product of as many factors; exponents go to " + std::to_string(most_factors));
  Scalar product = number(1);
  for (int i = 0; i < std::abs(exponent); ++i) product = product * a;
  return exponent < 0 ? reciprocal(product) : product;
}

bool operator==(const Scalar& a, const Scalar& b) {
  const auto &x = a.node(), &y = b.node();
  if (x.kind != y.kind || x.value != y.value || x.terms.size() != y.terms.size()) return false;
  if (x.operand || y.operand)
    if (!(x.operand == y.operand)) return false;
  for (size_t i = 0; i < x.terms.size(); ++i)
    if (!(x.terms[i] == y.terms[i])) return false;
  return true;
}

Scalar at(const Scalar& a, const std::shared_ptr<const Binding>& binding) {
  Scalar::Node n = a.node();
  if (n.operand) n.operand = n.operand.at(binding);
  for (Scalar& t : n.terms) t = at(t, binding);
  return Scalar(std::move(n));
}

void visit(const Scalar& a, const std::function<void(const Expression&)>& operands) {
  if (a.node().operand) operands(a.node().operand);
  for (const Scalar& t : a.node().terms) visit(t, operands);
}

constexpr size_t longest_operand = 100000;

// Written without parentheses: one letter, starred or not.
static bool short_operand(const Expression& e) {
  const Expression& inner = e.kind() == NodeKind::transpose || e.kind() == NodeKind::inverse ? e.children()[0] : e;
  return inner.children().empty();
}

std::string show(const Scalar& a, Style style) {
  const auto& n = a.node();
  const bool latex = style == Style::latex;
  const auto real = [&](const Coefficient& x) {
    const std::string text = x.text();
    const size_t bar = text.find('/');
    return latex && bar != std::string::npos ? "\\frac{" + text.substr(0, bar) + "}{" + text.substr(bar + 1) + "}" : text;
  };
  const auto operand = [&] { return show(n.operand, style, longest_operand); };
  const auto call = [&](const char* plain, const char* tex) {
    return latex ? std::string(tex) + "\\left(" + operand() + "\\right)" : std::string(plain) + "(" + operand() + ")";
  };
  const auto wrapped = [&](const Scalar& x, bool also_products) {
    const ScalarKind kind = x.node().kind;
    const bool wrap = kind == ScalarKind::sum || kind == ScalarKind::scaled || (also_products && (kind == ScalarKind::product || kind == ScalarKind::reciprocal));
    const std::string text = show(x, style);
    return wrap ? (latex ? "\\left(" + text + "\\right)" : "(" + text + ")") : text;
  };
  switch (n.kind) {
    case ScalarKind::number: return real(n.value);
    case ScalarKind::trace: return call(style == Style::unicode ? "tr" : "trace", "\\operatorname{tr}");
    case ScalarKind::logdet:
      if (style != Style::unicode) return call("logdet", "\\ln\\det");
      return short_operand(n.operand) ? "ln det " + operand() : "ln det(" + operand() + ")";
    case ScalarKind::norm: return latex ? "\\left\\Vert " + operand() + " \\right\\Vert" : style == Style::unicode ? "‖" + operand() + "‖" : call("norm", "");
    case ScalarKind::sum: {
      std::string text = show(n.terms[0], style);
      for (size_t i = 1; i < n.terms.size(); ++i) {
        const auto& t = n.terms[i].node();
        const bool negative = t.kind == ScalarKind::scaled && t.value < 0;
        const Scalar term = negative ? (t.value == -1 ? t.terms[0] : -t.value * t.terms[0]) : n.terms[i];
        text += (negative ? " - " : " + ") + (negative && term.node().kind == ScalarKind::sum ? wrapped(term, false) : show(term, style));
      }
      return text;
    }
    case ScalarKind::scaled: return (n.value == -1 ? "-" : real(n.value) + (latex ? "\\," : " ")) + wrapped(n.terms[0], false);
    case ScalarKind::product: {
      std::string above, below;
      for (const Scalar& t : n.terms) {
        const bool divides = t.node().kind == ScalarKind::reciprocal;
        std::string& text = divides ? below : above;
        text += (text.empty() ? "" : latex ? "\\," : " ") + wrapped(divides ? t.node().terms[0] : t, true);
      }
      if (below.empty()) return above;
      if (latex) return "\\frac{" + (above.empty() ? "1" : above) + "}{" + below + "}";
      const bool several = std::count_if(n.terms.begin(), n.terms.end(), [](const Scalar& t) { return t.node().kind == ScalarKind::reciprocal; }) > 1;
      return (above.empty() ? "1" : above) + "/" + (several ? "(" + below + ")" : below);
    }
    case ScalarKind::reciprocal: return latex ? "\\frac{1}{" + show(n.terms[0], style) + "}" : "1/" + wrapped(n.terms[0], true);
  }
  return "";
}

}  // namespace pycraft
