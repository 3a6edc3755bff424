#include "algebra/scalar_expression.h"

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "algebra/errors.h"

namespace pycraft {

namespace {

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
    throw EvaluationError("a scalar of sums within multiples within sums, " + std::to_string(node.depth) + " levels deep: evaluate a part of it, and go on with the number");
  node_ = std::make_shared<const Node>(std::move(node));
}

Scalar number(double value) { return Scalar({ScalarKind::number, value, {}, {}}); }
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
Scalar operator*(double c, const Scalar& a) { return Scalar({ScalarKind::scaled, c, {}, {a}}); }
Scalar operator-(const Scalar& a, const Scalar& b) { return a + -1.0 * b; }

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

std::string show(const Scalar& a, Style style) {
  const auto& n = a.node();
  const bool latex = style == Style::latex;
  const auto real = [](double x) {
    char buffer[40];
    std::snprintf(buffer, sizeof buffer, "%.12g", x);
    return std::string(buffer);
  };
  const auto call = [&](const char* plain, const char* tex) {
    return latex ? std::string(tex) + "\\left(" + show(n.operand, style, longest_operand) + "\\right)" : std::string(plain) + "(" + show(n.operand, style, longest_operand) + ")";
  };
  switch (n.kind) {
    case ScalarKind::number: return real(n.value);
    case ScalarKind::trace: return call("trace", "\\operatorname{tr}");
    case ScalarKind::logdet: return style == Style::unicode ? "ln det(" + show(n.operand, style, longest_operand) + ")" : call("logdet", "\\ln\\det");
    case ScalarKind::norm: return style == Style::unicode ? "‖" + show(n.operand, style, longest_operand) + "‖" : call("norm", "\\left\\Vert");
    case ScalarKind::sum: {
      std::string text = show(n.terms[0], style);
      for (size_t i = 1; i < n.terms.size(); ++i) {
        const auto& t = n.terms[i].node();
        const bool negative = t.kind == ScalarKind::scaled && t.value < 0;
        const Scalar term = negative ? (t.value == -1 ? t.terms[0] : -t.value * t.terms[0]) : n.terms[i];
        text += (negative ? " - " : " + ") + show(term, style);
      }
      return text;
    }
    case ScalarKind::scaled: {
      const std::string inner = show(n.terms[0], style);
      const bool wrap = n.terms[0].node().kind == ScalarKind::sum;
      return (n.value == -1 ? "-" : real(n.value) + (latex ? "\\," : " ")) + (wrap ? "(" + inner + ")" : inner);
    }
  }
  return "";
}

}  // namespace pycraft
