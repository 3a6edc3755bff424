"""Recursions in textbook notation: in text with Unicode letters, and in LaTeX."""

from __future__ import annotations

import re
from fractions import Fraction

from .elimination_passes import SystemLetters, selected_passes, solution_passes, system_passes
from .formulas import (
    Assembled,
    At,
    Cut,
    DiagonalPart,
    Function,
    HingeRow,
    Identity,
    Inverse,
    Node,
    Part,
    Product,
    Quantity,
    Transposed,
    product,
)
from .passes import (
    CompositeAssembly,
    Elimination,
    Equation,
    InverseBlock,
    Item,
    MadeDense,
    Once,
    Operator,
    Selected,
    Solution,
    Sweep,
    System,
    SystemLogdet,
    Term,
)

_SHOWN = 1000
"""Ratios with a larger denominator are shown as decimals."""
_PLACES = {
    "k": {"k": "k", "p": "p", "c": "c"},
    "pk": {"k": "p,k", "c": "k,c"},
    "kp": {"k": "k,p", "c": "c,k"},
    "kk": {"k": "k,k", "p": "p,p", "c": "c,c"},
    "kb": {"k": "k,b", "p": "p,b"},
    "bk": {"k": "b,k", "p": "b,p"},
    "bb": {"": "b,b"},
}
Line = tuple[int, str]  # depth, text


def pass_words(direction: int) -> str:
    """Return the heading of a pass."""
    return {-1: "for k from tip to base:", 1: "for k from base to tip:", 0: "for every body k:"}[direction]


# ---------------------------------------------------------------------- text
class Text:
    """Formulas and passes in Unicode."""

    join, minus, child_sum, body_sum, quote = " ", "-", "Σ_c ", "Σ_k ", ""

    # ------------------------------------------------------------------ letters
    def letter(self, quantity: Quantity, marks: str = "") -> str:
        """The letter with its number and marks: "+", "*", "-1"."""
        letter = quantity.letter
        base = letter.text
        if quantity.number:
            subscript = "".join("₀₁₂₃₄₅₆₇₈₉"[int(d)] for d in str(quantity.number))
            base += subscript
        base += "⁺" if letter.plus else ""
        return base + marks.replace("-1", "⁻¹").replace("⁻¹*", "⁻*")

    def place(self, quantity: Quantity, at: str) -> str:
        """(k), (p,k), ...; nothing for the whole."""
        where = _PLACES[quantity.indices].get(at, "")
        return f"({where})" if where else ""

    def number(self, x: float | Fraction) -> str:
        """A coefficient: a ratio of small numbers as such."""
        return str(x) if isinstance(x, Fraction) and x.denominator <= _SHOWN else f"{float(x):.12g}"

    # ------------------------------------------------------------------ formulas
    def node(self, node: Node, marks: str = "") -> str:
        """Return a formula; `marks` are the star and the inverse that follow it."""
        if isinstance(node, Transposed):
            return self.node(node.inner, marks + "*")
        if isinstance(node, Inverse):
            return self.node(node.inner, "-1" + marks)
        if isinstance(node, At):
            return self.letter(node.quantity, marks) + self.place(node.quantity, node.at)
        if isinstance(node, Product):
            if not node.factors:
                return "1"
            inner = self.join.join(self.node(factor) for factor in node.factors)
            return self.marked(inner, marks) if marks else inner
        plain = self.plain(node)
        return self.marked(plain, marks) if marks else plain

    def marked(self, inner: str, marks: str) -> str:
        """(inner)*, (inner)⁻¹."""
        return f"({inner})" + marks.replace("-1", "⁻¹")

    def plain(self, node: Node) -> str:
        """Return a formula that is neither a letter nor a product."""
        if isinstance(node, Identity):
            return "I"
        if isinstance(node, Function):
            return self.function(node.name, self.node(node.inner))
        if isinstance(node, HingeRow):
            return self.hinge_row(node)
        if isinstance(node, Part):
            where = "(k,·)" if node.axis == 0 else "(·,k)"
            return self.letter(node.quantity, "*" if node.transposed else "") + where
        if isinstance(node, DiagonalPart):
            return self.letter(node.quantity) + "(k,k)"
        if isinstance(node, Assembled):
            return self.function("blockdiag", self.letter(node.quantity))
        if isinstance(node, SystemLogdet):
            L = SystemLetters(node.system)
            pivots = self.body_sum + self.function("logdet", self.node(At(L("A", "k"))))
            return pivots + (" + " + self.function("logdet", self.letter(L("S", ""))) if node.system.border else "")
        if isinstance(node, InverseBlock):
            return f"{self.letter(node.quantity)}(k,k)[s{node.state + 1}, b{node.equation + 1}]"
        assert isinstance(node, MadeDense)
        return self.letter(node.operator.quantity) + self.join + "I"

    def hinge_row(self, node: HingeRow) -> str:
        """Row j of H(k) as a column."""
        return f"{self.letter(node.quantity)}*(k)[{node.row + 1}]"

    def function(self, name: str, inner: str) -> str:
        """A named function of a formula."""
        shapes = {
            "trace": "tr {}",
            "logdet": "ln|det {}|",
            "norm": "‖{}‖",
            "square_root": "√{}",
            "diagonal": "diag {}",
            "root": "chol({})",
            "blockdiag": "blockdiag {}",
        }
        return shapes.get(name, name + "({})").format(inner)

    def terms(self, terms: tuple[Term, ...]) -> str:
        """A sum; sums over children and bodies come last."""
        text = ""
        ordered = sorted(terms, key=lambda t: t.over in ("c", "bodies"))
        for term in ordered:
            size = abs(term.coefficient)
            negative = term.coefficient < 0
            text += (f" {self.minus} " if text else self.minus) if negative else (" + " if text else "")
            text += {"c": self.child_sum, "bodies": self.body_sum}.get(term.over, "")
            if term.node == Product(()):
                text += self.number(size)
            else:
                text += (self.number(size) + self.join if size != 1 else "") + self.node(term.node)
        return text or "0"

    def equation(self, equation: Equation) -> str:
        """target = sum."""
        target = equation.target
        at = "k" if target.kind == "blocks" else ""
        only = [term.body for term in equation.terms if term.body is not None]
        where = self.only_at(only[0]) if only else ""
        return f"{self.letter(target)}{self.place(target, at)} = {self.terms(equation.terms)}{where}"

    def only_at(self, body: int) -> str:
        """Return the words for a block that exists at one body only."""
        return f" for k = {body}, else 0"

    # ------------------------------------------------------------------ passes
    def items(self, items: list[Item]) -> list[Line]:
        """The lines of a recursion."""
        lines: list[Line] = []
        for item in items:
            lines += self.item(item)
        return lines

    def words(self, text: str) -> str:
        """Words between formulas."""
        return text

    def item(self, item: Item) -> list[Line]:
        """The lines of one pass."""
        if isinstance(item, Sweep):
            return [(0, self.words(pass_words(item.direction))), *((1, self.equation(e)) for e in item.equations)]
        if isinstance(item, Once):
            return [(0, self.whole(item.equation))]
        if isinstance(item, Elimination):
            return self.elimination(item.system)
        if isinstance(item, Solution):
            return self.solution(item)
        if isinstance(item, Selected):
            return [(0, self.words("diagonal blocks of the inverse")), *self.items(selected_passes(item))]
        if isinstance(item, CompositeAssembly):
            return self.composite(item)
        return self.operator(item)

    def whole(self, equation: Equation) -> str:
        """An equation of the whole: blocks are written without (k)."""
        return f"{self.letter(equation.target)} = {self.terms(equation.terms)}"

    def elimination(self, system: System) -> list[Line]:
        """The equations of a realization and their elimination."""
        T, s, b = (self.letter(SystemLetters(system)(name, "k")) for name in "Tsb")
        lines = [(0, self.words("equations of the realization,") + f" {T}{self.join}{s} = {b}:")]
        lines += [(1, self.relation(system, i)) for i in range(len(system.relations))]
        lines.append((0, self.words("eliminated from the leaves to the root, T the blocks of these equations body by body")))
        return lines + self.items(system_passes(system))

    def relation(self, system: System, i: int) -> str:
        """Equation i of a realization."""
        terms = []
        for term, j in system.relations[i]:
            state = system.states[j]
            at = {"c": "c", "p": "p"}.get(term.over, "k") if state.kind == "blocks" else ""
            terms.append(Term(product(term.node, At(state, at)), term.coefficient, term.over))
        return f"{self.terms(tuple(terms))} = {self.input_side(system, i)}"

    def input_equation(self, item: Solution, i: int) -> str:
        """The right-hand side of equation i."""
        return f"{self.input_side(item.system, i)} = {self.terms(item.inputs[i])}"

    def input_side(self, system: System, i: int) -> str:
        """b_i(k)."""
        cut = system.cuts[i]
        return self.subscripted("b", i + 1) + ("(k)" if isinstance(cut, Cut) else "")

    def subscripted(self, name: str, i: int) -> str:
        """b₁."""
        return name + "".join("₀₁₂₃₄₅₆₇₈₉"[int(d)] for d in str(i))

    def solution(self, item: Solution) -> list[Line]:
        """One solve with the factors."""
        lines = [(0, self.words("solved for"))]
        lines += [(1, self.input_equation(item, i)) for i, terms in enumerate(item.inputs) if terms]
        return lines + self.items(solution_passes(item.system))

    def composite(self, item: CompositeAssembly) -> list[Line]:
        """The composite-body assembly of ℳ."""
        f, H, R, E = "f", self.letter(item.H), self.letter(item.R), self.letter(item.E)
        A, j = self.letter(item.target), self.join
        own = f" + {self.letter(item.J)}(k)" if item.J else ""
        return [
            (0, self.words("for every body k:")),
            (1, f"{f} = {R}(k){j}{self.letter(item.H, '*')}(k)"),
            (1, f"{A}(k,k) = {H}(k){j}{f}{own}"),
            (1, self.words("for c = k and then its ancestors, p the parent of c:")),
            (2, f"{f} = {E}(p,c){j}{f}"),
            (2, f"{A}(p,k) = {H}(p){j}{f}, {self.letter(item.target, '*')}(p,k) = {A}(k,p)"),
        ]

    def operator(self, item: Operator) -> list[Line]:
        """A recursion inside a recursion."""
        x = item.program.inputs[0]
        title = f"{self.letter(item.program.result)} = {self.letter(item.quantity)}{self.join}{self.letter(x)}"
        lines = [(0, self.words("column by column,") + f" {title}:")]
        return lines + [(depth + 1, line) for depth, line in self.items(item.program.items)]


# ---------------------------------------------------------------------- LaTeX
class Latex(Text):
    """The same in LaTeX."""

    join, child_sum, body_sum = "\\,", "\\sum_{c} ", "\\sum_{k} "

    def letter(self, quantity: Quantity, marks: str = "") -> str:
        letter = quantity.letter
        base = letter.latex
        if quantity.number or marks or letter.plus:
            base = "{" + base + "}" if "_" in base or "^" in base else base
        if quantity.number:
            base += f"_{{{quantity.number}}}"
        upper = ("+" if letter.plus else "") + marks
        return base + (f"^{{{upper}}}" if upper else "")

    def marked(self, inner: str, marks: str) -> str:
        return f"\\left({inner}\\right)^{{{marks}}}"

    def number(self, x: float | Fraction) -> str:
        if isinstance(x, Fraction) and 1 < x.denominator <= _SHOWN:
            return f"\\tfrac{{{x.numerator}}}{{{x.denominator}}}"
        mantissa, _, exponent = f"{float(x):.12g}".partition("e")
        return f"{mantissa}\\cdot 10^{{{int(exponent)}}}" if exponent else mantissa

    def plain(self, node: Node) -> str:
        if isinstance(node, Part):
            where = "(k,\\cdot)" if node.axis == 0 else "(\\cdot,k)"
            return self.letter(node.quantity, "*" if node.transposed else "") + where
        if isinstance(node, InverseBlock):
            return f"{self.letter(node.quantity)}(k,k)_{{s_{{{node.state + 1}}},\\,b_{{{node.equation + 1}}}}}"
        return super().plain(node)

    def hinge_row(self, node: HingeRow) -> str:
        return f"{self.letter(node.quantity, '*')}_{{{node.row + 1}}}(k)"

    def function(self, name: str, inner: str) -> str:
        shapes = {
            "trace": "\\operatorname{{tr}} {}",
            "logdet": "\\ln\\left|\\det {}\\right|",
            "norm": "\\left\\Vert {} \\right\\Vert",
            "square_root": "\\sqrt{{{}}}",
            "diagonal": "\\operatorname{{diag}} {}",
            "root": "\\operatorname{{chol}}\\left({}\\right)",
            "blockdiag": "\\operatorname{{blockdiag}} {}",
        }
        return shapes.get(name, "\\operatorname{{" + name.replace("_", "\\_") + "}}\\left({}\\right)").format(inner)

    def only_at(self, body: int) -> str:
        return f"\\text{{ for }} k = {body}\\text{{, else }} 0"

    def subscripted(self, name: str, i: int) -> str:
        return f"{name}_{{{i}}}"

    def words(self, text: str) -> str:
        return "\\text{" + re.sub(r"\b([kcpT])\b", r"$\1$", text) + " }"
