"""Expressions written out as sums of words: products distributed, transposes and inverses carried to the letters.

(AB)* = B*A*, (AB)⁻¹ = B⁻¹A⁻¹ for factors that are square by meaning, (A⁻¹)* = (A*)⁻¹, coefficients as exact fractions of what
was typed. Other expressions (the inverse of a sum, a diagonal part, a square root) become new letters that remember
their operands.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from .. import _core
from . import factors
from .axioms import INVERTIBLE
from .derivative import Formula
from .equations import Equation, Step, symmetries
from .normal_form import WORDS
from .walk import GaveUp, Walk, carried_out
from .words import (
    FURTHER,
    ONE,
    SAME_EDGES,
    SHARED,
    Alphabet,
    Letter,
    Number,
    Polynomial,
    Word,
    add_to,
    inverse_of,
    monomial,
    parse,
    plain,
    ratio,
    shape_of,
    sko_letters,
    times,
)

UNFOLDED = {"Jacobian": "𝒥 = B* φ* H*", "Lambda": "Λ = (B* Ω B)⁻¹"}
"""Symbols that are replaced by their definitions."""
LENGTH = 200
"""Length of a word, in letters, at which expansion gives up."""
OPERANDS = 40
"""Number of inverses of sums, diagonal parts and roots in a statement at which expansion gives up."""
MASS_MATRIX = parse("H φ M φ* H*")
_TABLE = {s.name: (s.text, s.latex) for s in _core.symbols}


@dataclass(eq=False)
class Opaque:
    """A letter that stands for the operand of an inverse, for a diagonal part or for a square root.

    `name` is the letter; the letter of an inverse is its operand's with the mark ⁻¹. `inner` is the operand in words.
    """

    name: str
    kind: str
    expression: Any
    inner: Polynomial
    definition: Equation


class Spelling(Step):
    """The step from an expression as it was typed to words."""

    def __init__(self, problem: Problem, expression: Any, p: Polynomial, uses: list[Equation], backwards: bool = False):
        super().__init__(p, p, [], problem.alphabet)
        self.problem, self.expression, self.definitions, self.backwards = problem, expression, uses, backwards
        opened = [e.text for e in uses if e.kind == "definition"]
        self.title = "write out" + (f", {'; '.join(opened)}" if opened else "")

    def holds(self) -> bool:
        return self.problem.words(self.expression) == self.before

    def premises(self) -> Iterator[Equation]:
        yield from self.definitions

    def reversed(self) -> Spelling:
        return Spelling(self.problem, self.expression, self.before, self.definitions, not self.backwards)

    @property
    def says_something(self) -> bool:
        """True if the typed expression looks different."""
        return self.expression.text() != self.alphabet.text(self.before) or any(e.kind == "axiom" for e in self.definitions)

    def before_text(self) -> str:
        return super().before_text() if self.backwards else self.expression.text()

    def after_text(self) -> str:
        return self.expression.text() if self.backwards else super().after_text()

    def before_latex(self) -> str:
        return super().before_latex() if self.backwards else self.expression.latex()

    def after_latex(self) -> str:
        return self.expression.latex() if self.backwards else super().after_latex()


class Problem:
    """The letters of one statement, and the expansion of its expressions in them."""

    def __init__(self) -> None:
        self.alphabet = Alphabet()
        self.opaque: list[Opaque] = []
        self.contexts: list[tuple[Any, Any]] = []  # (source, binding): the models at their states
        self.relations: list[tuple[str, str, str]] = []  # (mark of a tree derived from another, how, the mark of that tree)
        self.sides: list[Polynomial] = []
        self.of_one_model = False  # True if the statement consists of one model's expressions, instead of text for all models
        self.unknown: set[str] = set()  # names of constants whose values are ignored
        self.assumed: list[tuple[Equation, str]] = []  # the user's hypotheses, with the letter that one declares definite
        self.determinants: set[str] = set()  # operands of ln|det|, presupposed to be regular
        self.scalars = False  # True if both sides are scalars: traces, determinants, norms
        self.numbers = False  # True if both sides map R^1 to R^1
        self._named_operands = 0
        self._leaves: dict[Any, str] = {}
        self._definitions: dict[str, Equation] = {}
        self._used: list[Equation] = []

    @property
    def marks(self) -> tuple[str, ...]:
        """The marks of the models whose letters occur; the first has none."""
        return tuple(["", *FURTHER][: max(1, len(self.contexts))])

    def polynomials(self) -> list[Polynomial]:
        """Return the polynomials of the statement: both sides, and the operands of the letters that it adds."""
        assumed = [p for equation, _ in self.assumed for p in (equation.lhs, equation.rhs)]
        return [*self.sides, *(o.inner for o in self.opaque), *assumed]

    def recursion_rules(self) -> list[tuple[Equation, Word]]:
        """Return equations between derivatives of one recursion under blockdiag: none for a statement without derivatives."""
        return []

    def expand(self, expression: Any) -> Spelling:
        """Return the expression in words, with the step that states it.

        Raises
        ------
        GaveUp
            More than `normal_form.WORDS` words.
        """
        self._used = []
        p = self.words(expression)
        return Spelling(self, expression, p, list(dict.fromkeys(self._used)))

    def _star(self, p: Polynomial) -> Polynomial:
        self._used += symmetries(self.alphabet, p)
        return self.alphabet.star_of(p)

    # ------------------------------------------------------------------ by kind
    def words(self, e: Any, transposed: bool = False) -> Polynomial:
        """Return the expression, or its transpose, as a polynomial.

        Raises
        ------
        GaveUp
            Beyond `walk.NODES` nodes, `OPERANDS` inverses, `normal_form.WORDS` words, or words of `LENGTH` letters.
        """
        return carried_out(self._words(e, transposed))

    def _words(self, e: Any, transposed: bool = False) -> Walk:
        """Do `words` as a generator that yields a walk for each part and is sent its result, so that depth is unlimited."""
        match e.kind:
            case "zero":
                return {}
            case "identity":
                return {(): ONE}
            case "scaled":
                c = exact(e.coefficient)
                p = yield self._words(e.children[0], transposed)
                return {w: c * x for w, x in p.items()} if c else {}
            case "sum":
                total: Polynomial = {}
                for child in e.children:
                    for word, c in (yield self._words(child, transposed)).items():
                        add_to(total, word, c)
                return total
            case "product":
                factors = reversed(e.children) if transposed else e.children
                return (yield self._product(self._words(f, transposed) for f in factors))
            case "transpose":
                return (yield self._words(e.children[0], not transposed))
            case "inverse":
                p = yield self._inverse(e.children[0])
            case "symbol" if e.name in UNFOLDED:
                return (yield self._words(self._unfolded(e), transposed))
            case _:
                p = {((yield self._letter(e)),): ONE}
        return self._star(p) if transposed else p

    def _product(self, factors: Iterator[Walk]) -> Walk:
        p: Polynomial = {(): ONE}
        for factor in factors:
            p = times(p, (yield factor))
            if len(p) > WORDS or any(len(word) > LENGTH for word in p):
                raise GaveUp
        return p

    def _inverse(self, e: Any) -> Walk:
        """The words of e⁻¹."""
        match e.kind:
            case "inverse":
                return (yield self._words(e.children[0]))
            case "identity":
                return {(): ONE}
            case "scaled" if e.coefficient:
                c = ratio(1, exact(e.coefficient))
                return {w: c * x for w, x in (yield self._inverse(e.children[0])).items()}
            case "transpose":
                return self._star((yield self._inverse(e.children[0])))
            case "product" if all(map(square, e.children)):
                return (yield self._product(self._inverse(f) for f in reversed(e.children)))
            case "symbol" if e.name in UNFOLDED:
                return (yield self._inverse(self._unfolded(e)))
            case "symbol" if plain(letter := (yield self._letter(e))) in INVERTIBLE:
                return {(inverse_of(letter),): ONE}
            case "symbol" | "sum" | "product" | "scaled":
                return {(inverse_of((yield self._operand("inverse", e, e))),): ONE}
        return {(inverse_of((yield self._letter(e))),): ONE}

    def _unfolded(self, e: Any) -> Any:
        """𝒥 and Λ by their definitions."""
        if e.name not in self._definitions:
            self._definitions[e.name] = Equation("definition", UNFOLDED[e.name], {}, {})
        self._used.append(self._definitions[e.name])
        return e.definition

    # ------------------------------------------------------------------ letters
    def letter(self, e: Any) -> str:
        """Return the letter of an expression."""
        return carried_out(self._letter(e))

    def operand(self, e: Any) -> str:
        """Return the letter of the operand of a determinant or norm: the operand itself if it is a letter."""
        return (
            self.letter(e) if e.kind in ("symbol", "constant") and e.name not in UNFOLDED else carried_out(self._operand("operand", e, e))
        )

    def _letter(self, e: Any) -> Walk:
        if e not in self._leaves:
            if e.kind in ("blockdiag", "sqrt") or e.kind == "function" and e.name == "lower_half":
                return (yield self._operand("half" if e.kind == "function" else e.kind, e, e.children[0]))
            self._leaves[e] = self._symbol(e) if e.kind == "symbol" else self._other(e)
        return self._leaves[e]

    def _symbol(self, e: Any) -> str:
        source, ascii, arguments, binding = symbol_parts(e)
        text, _ = _TABLE.get(ascii, (e.text(), ""))
        made = source.derived_from
        if made is not None and (made[0] == "loops" or made[0] in SAME_EDGES and text in SHARED):
            source, made = made[1], None
        mark = self.mark_of(source, binding)
        if made is not None and (mark, made[0]) not in [(m, kind) for m, kind, _ in self.relations]:
            self.relations.append((mark, made[0], self.mark_of(made[1], binding)))
        known = self.alphabet.letters.get(text + mark)
        if known is not None and known.ascii == ascii and not arguments:
            self.alphabet.add(Letter(known.name, known.text, known.latex, known.symmetric, known.shape, known.ascii, e))
            return known.name
        shape = "diagonal" if e.is_block_diagonal else shape_of(text)
        return self._named(f"‹{e.text()}›{mark}", Letter("", e.text() + mark, e.latex(), bool(e.is_symmetric), shape, None, e))

    def mark_of(self, source: Any, binding: Any) -> str:
        """The mark of a model at a state."""
        for i, (s, b) in enumerate(self.contexts):
            if s is source and _same_state(b, binding):
                return ["", *FURTHER][i]
        if len(self.contexts) > len(FURTHER):
            raise GaveUp
        self.contexts.append((source, binding))
        mark = ["", *FURTHER][len(self.contexts) - 1]
        for known in sko_letters().values() if mark else ():
            latex = f"{{{known.latex}}}_{{({len(self.contexts)})}}"
            self.alphabet.add(Letter(known.name + mark, known.text + mark, latex, known.symmetric, known.shape, known.ascii))
        return mark

    def _other(self, e: Any) -> str:
        """Add vectors, constants and external operators: letters with no known properties except their kind's."""
        vector = e.kind == "vector"
        if e.kind == "constant" and e.name in self.unknown:
            return self._named(f"‹{e.text()}›", Letter("", e.text(), e.latex(), False, "full", None, e))
        shape = "diagonal" if not vector and e.is_block_diagonal else "full"
        return self._named(f"‹{e.text()}›", Letter("", e.text(), e.latex(), not vector and bool(e.is_symmetric), shape, None, e))

    def _named(self, name: str, letter: Letter) -> str:
        """Add a letter under an unused name."""
        while name in self.alphabet.letters:
            name = "‹" + name + "›"
        self.alphabet.add(Letter(name, letter.text, letter.latex, letter.symmetric, letter.shape, letter.ascii, letter.expression))
        return name

    def _operand(self, kind: str, e: Any, operand: Any) -> Walk:
        """The letter of something opaque."""
        key = (kind, e)
        if key not in self._leaves:
            inner = yield self._words(operand)
            if len(self.opaque) == OPERANDS:
                raise GaveUp
            name = self._factor(inner) or f"⟨{len(self.opaque) + 1}⟩"
            text, latex = self._shown(inner, e) if kind in ("inverse", "operand") else (e.text(), f"{{{e.latex()}}}")
            symmetric = kind == "blockdiag" and bool(e.is_symmetric)
            shape = "diagonal" if kind in ("blockdiag", "sqrt", "half") else "full"
            known = e.written_out() if isinstance(e, Formula) else e  # a formula with derivatives, expanded
            self.alphabet.add(Letter(name, text, latex, symmetric, shape, None, known))
            definition = Equation("definition", f"{text} = {self.alphabet.text(inner)}", monomial(name), inner)
            self.opaque.append(Opaque(name, kind, e, inner, definition))
            self._leaves[key] = name
        found = self._leaves[key]
        if kind in ("inverse", "operand"):
            self._used.append(next(o.definition for o in self.opaque if o.name == found))
        return found

    def _factor(self, inner: Polynomial) -> str:
        """Return the name of A = I + HφK if these words are the innovations factor of a model, which has one name."""
        for mark in self.marks:
            base = next((base for m, how, base in self.relations if m == mark and how in SAME_EDGES), mark)
            if inner == factors.of(factors.FACTOR, mark, base) and factors.name_of(mark) not in self.alphabet.letters:
                return factors.name_of(mark)
        return ""

    def _shown(self, inner: Polynomial, e: Any) -> tuple[str, str]:
        """Return the displayed name of the operand of an inverse: ℳ for the mass matrix, X₁, X₂, ... if its own text is long."""
        if inner == MASS_MATRIX:
            return "ℳ", "\\mathcal{M}"
        text = self.alphabet.text(inner)
        if len(text) <= 12:
            return f"({text})", f"({self.alphabet.latex(inner)})"
        self._named_operands += 1
        number = str(self._named_operands)
        return "X" + number.translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")), f"X_{{{number}}}"


def symbol_parts(e: Any) -> tuple[Any, str, tuple[Any, ...], Any]:
    """Return (source, ASCII name, arguments, binding) of a symbol."""
    letter = e.letter
    return letter.source, letter.name, letter.arguments, letter.binding


def _same_state(a: Any, b: Any) -> bool:
    return a is b or a is not None and b is not None and a.__reduce__()[1] == b.__reduce__()[1]


def exact(coefficient: float | Fraction) -> Number:
    """Return the exact value of a coefficient."""
    if isinstance(coefficient, float) and not math.isfinite(coefficient):
        raise _core.EvaluationError(f"the coefficient {coefficient} is not a finite number")
    return ratio(Fraction(coefficient), 1)


def square(factor: Any) -> bool:
    """Return True if a factor is square by definition; H may be square by accident."""
    domain, codomain = factor.domain, factor.codomain
    return domain is None or domain == codomain or domain.dual == codomain
