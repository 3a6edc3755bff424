// How an expression is shown: as the book prints it (unicode, LaTeX) and as Python reads it back.
#include <cmath>
#include <cstdio>

#include "algebra/expression.h"

namespace pycraft {

namespace {

enum Level { sum_level, product_level, postfix_level };

std::string number(double c, Style style) {
  char buffer[40];
  for (int digits = 6; digits <= 17; ++digits) {
    std::snprintf(buffer, sizeof buffer, "%.*g", digits, c);
    if (std::strtod(buffer, nullptr) == c) break;
  }
  std::string text = buffer;
  const size_t e = text.find('e');
  if (style == Style::latex && e != std::string::npos)
    text = text.substr(0, e) + " \\cdot 10^{" + std::to_string(std::atoi(text.c_str() + e + 1)) + "}";
  return text;
}

std::string parenthesised(const std::string& text, Style style) {
  return style == Style::latex ? "\\left(" + text + "\\right)" : "(" + text + ")";
}

std::string symbol_text(const Symbol& s, Style style) {
  const SymbolDefinition& d = *s.definition;
  if (s.argument_text.empty()) return style == Style::unicode ? d.unicode : style == Style::python ? d.ascii : d.latex;
  if (style == Style::python) return d.ascii + "(" + s.argument_text + ")";
  if (style == Style::unicode) return d.unicode + "(" + s.argument_text + ")";
  std::string escaped;
  for (char c : s.argument_text) {
    if (c == '_' || c == '%' || c == '&' || c == '#') escaped += '\\';
    escaped += c;
  }
  return d.latex + "_{\\mathrm{" + escaped + "}}";
}

std::string render(const Expression& e, Style style, Level around);

// A term of a sum with its sign taken out.
std::string term(const Expression& e, Style style, bool& negative) {
  negative = false;
  if (e.kind() == NodeKind::scaled && e.node().coefficient < 0) {
    negative = true;
    const Expression& inner = e.children()[0];
    const double c = -e.node().coefficient;
    if (c == 1) return render(inner, style, product_level);
    return number(c, style) + (style == Style::python ? "*" : style == Style::latex ? "\\," : " ") + render(inner, style, product_level);
  }
  return render(e, style, product_level);
}

std::string render(const Expression& e, Style style, Level around) {
  const bool latex = style == Style::latex, python = style == Style::python;
  const auto wrap = [&](const std::string& text, Level own) { return own < around ? parenthesised(text, style) : text; };
  switch (e.kind()) {
    case NodeKind::symbol: return symbol_text(e.node().symbol, style);
    case NodeKind::vector: return e.node().name;
    case NodeKind::identity: return "I";
    case NodeKind::zero: return "0";
    case NodeKind::constant: return e.node().constant->name;
    case NodeKind::external: return e.node().external->name;
    case NodeKind::sum: {
      std::string text;
      for (size_t i = 0; i < e.children().size(); ++i) {
        bool negative;
        const std::string part = term(e.children()[i], style, negative);
        const char* minus = python || latex ? "-" : "−";
        if (i == 0)
          text = (negative ? minus : "") + part;
        else
          text += std::string(" ") + (negative ? minus : "+") + " " + part;
      }
      return wrap(text, sum_level);
    }
    case NodeKind::scaled: {
      bool negative;
      const double c = e.node().coefficient;
      if (c < 0) {
        const std::string part = term(e, style, negative);
        return wrap((python || latex ? "-" : "−") + part, around > sum_level ? sum_level : around);
      }
      return wrap(number(c, style) + (python ? "*" : latex ? "\\," : " ") + render(e.children()[0], style, product_level), product_level);
    }
    case NodeKind::product: {
      std::string text;
      for (size_t i = 0; i < e.children().size(); ++i) {
        const Expression& factor = e.children()[i];
        const std::string part = render(factor, style, postfix_level);
        text += (i ? (python ? " @ " : " ") : "") + part;
      }
      return wrap(text, product_level);
    }
    case NodeKind::transpose: {
      const std::string inner = render(e.children()[0], style, postfix_level);
      return python ? inner + ".T" : latex ? "{" + inner + "}^{*}" : inner + "*";
    }
    case NodeKind::inverse: {
      if (e.children()[0].kind() == NodeKind::square_root && !python) {
        const std::string base = render(e.children()[0].children()[0], style, postfix_level);
        return latex ? "{" + base + "}^{-1/2}" : base + "^-½";
      }
      const std::string inner = render(e.children()[0], style, postfix_level);
      return python ? inner + ".inv()" : latex ? "{" + inner + "}^{-1}" : inner + "⁻¹";
    }
    case NodeKind::square_root: {
      const std::string inner = render(e.children()[0], style, postfix_level);
      return python ? inner + ".sqrt()" : latex ? "{" + inner + "}^{1/2}" : inner + "^½";
    }
    case NodeKind::block_function: {
      const SymbolDefinition& d = *e.node().symbol.definition;
      const std::string inner = render(e.children()[0], style, sum_level);
      return latex ? d.latex + "\\left(" + inner + "\\right)" : (python ? d.ascii : d.unicode) + "(" + inner + ")";
    }
    case NodeKind::block_diagonal: {
      const std::string inner = render(e.children()[0], style, sum_level);
      return latex ? "\\operatorname{blockdiag}\\left(" + inner + "\\right)" : "blockdiag(" + inner + ")";
    }
  }
  return "";
}

}  // namespace

std::string show(const Expression& e, Style style) { return render(e, style, sum_level); }

}  // namespace pycraft
