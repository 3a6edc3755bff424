// How an expression is shown: as the book prints it (unicode, LaTeX) and as Python reads it back.
#include <cstdlib>
#include <iterator>

#include "algebra/language/display.h"
#include "algebra/language/expression.h"
#include "runtime/errors.h"

namespace pycraft {

namespace {

enum Level { sum_level, product_level, postfix_level };

std::string number(const Coefficient& c, Style style) {
  std::string text = c.text();
  const size_t e = text.find('e'), bar = text.find('/');
  if (style == Style::latex && e != std::string::npos)
    text = text.substr(0, e) + " \\cdot 10^{" + std::to_string(std::atoi(text.c_str() + e + 1)) + "}";
  else if (style == Style::latex && bar != std::string::npos)
    text = "\\frac{" + text.substr(0, bar) + "}{" + text.substr(bar + 1) + "}";
  else if (style == Style::python && !c.is_double()) {
    const auto [above, below] = c.as_ratio();
    text = below == "1" ? above : "Fraction(" + above + ", " + below + ")";
  }
  return text;
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

// A text still to be written: as it is, or an expression with what stands around it.
struct Piece {
  std::string text;
  const Expression* expression = nullptr;
  Level around = sum_level;
};

// The pieces that one node is written with, its parts among them.
class Spelling {
 public:
  Spelling(Style style, std::vector<Piece>& pieces) : style_(style), pieces_(pieces) {}

  void operator()(const Expression& e, Level around) {
    switch (e.kind()) {
      case NodeKind::symbol: return write(symbol_text(e.node().symbol, style_));
      case NodeKind::vector: return write(e.node().name);
      case NodeKind::identity: return write("I");
      case NodeKind::zero: return write("0");
      case NodeKind::constant: return write(e.node().constant->name);
      case NodeKind::external: return write(e.node().external->name);
      case NodeKind::sum: return wrapped(around > sum_level, [&] { sum(e); });
      case NodeKind::scaled:
        if (e.node().coefficient < 0) return wrapped(around > sum_level, [&] { write(minus()), multiple(-e.node().coefficient, e.children()[0]); });
        return wrapped(around > product_level, [&] {
          write(number(e.node().coefficient, style_) + times());
          part(e.children()[0], product_level);
        });
      case NodeKind::product:
        return wrapped(around > product_level, [&] {
          for (size_t i = 0; i < e.children().size(); ++i) {
            if (i) write(python() ? " @ " : " ");
            part(e.children()[i], postfix_level);
          }
        });
      case NodeKind::transpose: return postfix(e.children()[0], ".T", "*", "*");
      case NodeKind::inverse: {
        const Expression& inner = e.children()[0];
        if (inner.kind() == NodeKind::square_root && !python()) return postfix(inner.children()[0], "", "^-½", "-1/2");
        return postfix(inner, ".inv()", "⁻¹", "-1");
      }
      case NodeKind::square_root: return postfix(e.children()[0], ".sqrt()", "^½", "1/2");
      case NodeKind::block_function: {
        const SymbolDefinition& d = *e.node().symbol.definition;
        return function(latex() ? d.latex : python() ? d.ascii : d.unicode, e.children()[0]);
      }
      case NodeKind::block_diagonal: return function(latex() ? "\\operatorname{blockdiag}" : "blockdiag", e.children()[0]);
    }
  }

 private:
  bool latex() const { return style_ == Style::latex; }
  bool python() const { return style_ == Style::python; }
  const char* minus() const { return style_ == Style::unicode ? "−" : "-"; }
  const char* times() const { return python() ? "*" : latex() ? "\\," : " "; }

  void write(std::string text) { pieces_.push_back({std::move(text)}); }
  void part(const Expression& e, Level around) { pieces_.push_back({{}, &e, around}); }

  template <class F>
  void wrapped(bool parentheses, F inside) {
    if (parentheses) write(latex() ? "\\left(" : "(");
    inside();
    if (parentheses) write(latex() ? "\\right)" : ")");
  }
  void multiple(const Coefficient& c, const Expression& e) {
    if (c != 1) write(number(c, style_) + times());
    part(e, product_level);
  }
  // Signs of terms stand between them.
  void sum(const Expression& e) {
    for (size_t i = 0; i < e.children().size(); ++i) {
      const Expression& term = e.children()[i];
      const bool negative = term.kind() == NodeKind::scaled && term.node().coefficient < 0;
      if (i || negative) write(i == 0 ? minus() : std::string(" ") + (negative ? minus() : "+") + " ");
      if (negative)
        multiple(-term.node().coefficient, term.children()[0]);
      else
        part(term, product_level);
    }
  }
  void postfix(const Expression& e, const char* in_python, const char* in_unicode, const char* exponent) {
    if (latex()) write("{");
    part(e, postfix_level);
    write(latex() ? std::string("}^{") + exponent + "}" : python() ? in_python : in_unicode);
  }
  void function(const std::string& name, const Expression& operand) {
    write(name + (latex() ? "\\left(" : "("));
    part(operand, sum_level);
    write(latex() ? "\\right)" : ")");
  }

  Style style_;
  std::vector<Piece>& pieces_;
};

// Piece by piece from the left, until the text is longer than asked for; the rest is left out.
std::string written(const Expression& e, Style style, size_t length, bool& cut) {
  std::string text;
  std::vector<Piece> todo = {{{}, &e, sum_level}}, pieces;
  while (!todo.empty()) {
    cut = text.size() > length;
    if (cut) break;
    const Piece next = std::move(todo.back());
    todo.pop_back();
    if (!next.expression) {
      text += next.text;
      continue;
    }
    pieces.clear();
    Spelling(style, pieces)(*next.expression, next.around);
    todo.insert(todo.end(), std::make_move_iterator(pieces.rbegin()), std::make_move_iterator(pieces.rend()));
  }
  return text;
}

}  // namespace

std::string show(const Expression& e, Style style, size_t length) {
  bool cut = false;
  std::string text = written(e, style, length, cut);
  return cut ? text + " …" : text;
}

std::string show_in_full(const Expression& e, Style style) {
  bool cut = false;
  std::string text = written(e, style, longest_text, cut);
  if (cut)
    throw EvaluationError("the text of this expression has more than " + std::to_string(longest_text) +
                          " characters: parts of it occur many times over; its repr() shows how it begins");
  return text;
}

std::string label(const Expression& e) {
  const std::string text = show(e, Style::unicode, 60);
  return text.ends_with(" …") ? "(an expression that begins " + show(e, Style::unicode, 30) + ")" : text;
}

}  // namespace pycraft
