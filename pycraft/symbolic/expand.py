"""Expressions written out as sums of words: products distributed, transposes and inverses carried to the letters.

(AB)* = B*A*, (AB)⁻¹ = B⁻¹A⁻¹ for factors that are square by meaning, (A⁻¹)* = (A*)⁻¹, coefficients as exact fractions of the doubles that
were typed. What is no product of letters (the inverse of a sum, a diagonal part, a square root) becomes a letter of its own that remembers
what stands inside it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from .. import _core
from .equations import Equation, Step, symmetries
from .rules import WORDS, GaveUp
from .words import Alphabet, Letter, Polynomial, add_to, combine, inverse_of, shape_of, split, times

_UNFOLDED = {"Jacobian": "𝒥 = B* φ* H*", "Lambda": "Λ = (B* Ω B)⁻¹"}
_INVERTIBLE = {"φ", "ψ", "D", "M", "P", "R", "J", "Υ"}
_SUFFIXES = ["", *"₂₃₄₅₆₇₈₉"]
_TABLE = {ascii: (text, latex) for ascii, text, latex, *_ in _core.symbol_table()}


@dataclass(eq=False)
class Opaque:
    """A letter that stands for an operand of a sum's inverse, a diagonal part or a square root.

    `name` is the letter; for an inverse it is the operand's, used with the mark ⁻¹, else that of the whole. `inner` is the operand in words.
    """

    name: str
    kind: str
    expression: Any
    inner: Polynomial
    steps: list[Step] = field(default_factory=list)


class Problem:
    """The letters of one statement, and how its expressions are written in them."""

    def __init__(self) -> None:
        self.alphabet = Alphabet()
        self.opaque: list[Opaque] = []
        self.contexts: list[tuple[Any, Any]] = []
        self.unfolded: dict[str, Equation] = {}
        self._leaves: dict[Any, str] = {}
        self._transposed = False
        self._used: list[Equation] = []

    @property
    def suffixes(self) -> tuple[str, ...]:
        """The marks of the models whose letters occur; the first has none."""
        return tuple(_SUFFIXES[: max(1, len(self.contexts))])

    def expand(self, expression: Any) -> tuple[Polynomial, Step]:
        """(the polynomial, the step that says so).

        Raises
        ------
        GaveUp
            More than `rules.WORDS` words.
        """
        self._transposed, self._used = False, []
        p = self._expand(expression, False)
        extra = list(dict.fromkeys(self._used))
        if self._transposed:
            extra += [e for e in symmetries(self.alphabet, p) if e not in extra]
        title = "write out" + (f", with {', '.join(e.text for e in self._used)}" if self._used else "")
        step = Step(p, p, [], self.alphabet, title, expression=expression, extra=extra, check=lambda: self._expand(expression, False) == p)
        return p, step

    # ------------------------------------------------------------------ by kind
    def _expand(self, e: Any, transposed: bool) -> Polynomial:
        kind = e.kind
        if kind == "zero":
            return {}
        if kind == "identity":
            return {(): Fraction(1)}
        if kind == "scaled":
            c = Fraction(e.coefficient)
            return {w: c * x for w, x in self._expand(e.children[0], transposed).items()} if c else {}
        if kind == "sum":
            return combine(*((1, self._expand(c, transposed)) for c in e.children))
        if kind == "product":
            p: Polynomial = {(): Fraction(1)}
            for factor in reversed(e.children) if transposed else e.children:
                p = times(p, self._expand(factor, transposed))
                if len(p) > WORDS:
                    raise GaveUp
            return p
        if kind == "transpose":
            self._transposed = True
            return self._expand(e.children[0], not transposed)
        if kind == "inverse":
            return self._starred(self._inverse(e.children[0]), transposed)
        if kind == "symbol" and (unfolded := self._unfold(e)) is not None:
            return self._expand(unfolded, transposed)
        return self._starred({(self._letter(e),): Fraction(1)}, transposed)

    def _starred(self, p: Polynomial, transposed: bool) -> Polynomial:
        return self.alphabet.star_of(p) if transposed else p

    def _inverse(self, e: Any) -> Polynomial:
        """The words of e⁻¹."""
        kind = e.kind
        if kind == "inverse":
            return self._expand(e.children[0], False)
        if kind == "identity":
            return {(): Fraction(1)}
        if kind == "scaled" and e.coefficient:
            c = 1 / Fraction(e.coefficient)
            return {w: c * x for w, x in self._inverse(e.children[0]).items()}
        if kind == "transpose":
            self._transposed = True
            return self.alphabet.star_of(self._inverse(e.children[0]))
        if kind == "product" and all(map(_square, e.children)):
            p: Polynomial = {(): Fraction(1)}
            for factor in reversed(e.children):
                p = times(p, self._inverse(factor))
                if len(p) > WORDS:
                    raise GaveUp
            return p
        if kind == "symbol":
            unfolded = self._unfold(e)
            if unfolded is not None:
                return self._inverse(unfolded)
            letter = self._letter(e)
            if split(letter)[0].rstrip("".join(_SUFFIXES)) in _INVERTIBLE:
                return {(inverse_of(letter),): Fraction(1)}
        elif kind not in ("sum", "product", "scaled"):
            return {(inverse_of(self._letter(e)),): Fraction(1)}
        return {(inverse_of(self._opaque("inverse", e, e)),): Fraction(1)}

    # ------------------------------------------------------------------ letters
    def _context(self, source: Any, binding: Any) -> str:
        """The mark of a model at a state."""
        for i, (s, b) in enumerate(self.contexts):
            if s is source and b is binding:
                return _SUFFIXES[i]
        if len(self.contexts) == len(_SUFFIXES):
            raise GaveUp
        self.contexts.append((source, binding))
        suffix = _SUFFIXES[len(self.contexts) - 1]
        if suffix:
            for known in list(Alphabet().letters.values()):
                self.alphabet.add(
                    Letter(known.name + suffix, known.text + suffix, f"{{{known.latex}}}'", known.symmetric, known.shape, known.ascii)
                )
        return suffix

    def _unfold(self, e: Any) -> Any:
        """𝒥 and Λ by their definitions; None for any other symbol."""
        if e.name not in _UNFOLDED:
            return None
        _, (source, name, nodes, binding), _ = e._parts()
        B, phi, H, Omega = (
            _bound(source.symbol("B", nodes=list(nodes)), binding),
            *(_bound(source.symbol(n), binding) for n in ("phi", "H", "Omega")),
        )
        if name not in self.unfolded:
            text = _UNFOLDED[name]
            self.unfolded[name] = Equation({}, {}, "definition", text)
        if self.unfolded[name] not in self._used:
            self._used.append(self.unfolded[name])
        return B.T @ phi.T @ H.T if name == "Jacobian" else (B.T @ Omega @ B).inv()

    def _letter(self, e: Any) -> str:
        if e in self._leaves:
            return self._leaves[e]
        kind = e.kind
        if kind in ("blockdiag", "sqrt"):
            name = self._opaque(kind, e, e.children[0])
        elif kind == "symbol":
            _, (source, ascii, arguments, binding), _ = e._parts()
            suffix = self._context(source, binding)
            text, latex = _TABLE[ascii]
            name = text + suffix
            if arguments or ascii in ("Delta", "B"):
                name = e.text() + suffix
                self.alphabet.add(Letter(name, name, e.latex(), bool(e.is_symmetric), shape_of(text), None, e))
            else:
                known = self.alphabet.letters[name]
                self.alphabet.add(Letter(known.name, known.text, known.latex, known.symmetric, known.shape, known.ascii, e))
        elif kind == "derivative":
            name = self._derivative(e)
        else:
            name = f"{e.text()}"
            while name in self.alphabet.letters:
                name += "′"
            shape = "diagonal" if kind != "vector" and e.is_block_diagonal else "full"
            self.alphabet.add(Letter(name, name, e.latex(), kind != "vector" and bool(e.is_symmetric), shape, None, e))
        self._leaves[e] = name
        return name

    def _derivative(self, e: Any) -> str:
        raise _core.EvaluationError("a derivative is proved by prove_derivative")

    def _opaque(self, kind: str, e: Any, operand: Any) -> str:
        key = (kind, e)
        if key in self._leaves:
            return self._leaves[key]
        inner = self._expand(operand, False)
        name = f"⟨{len(self.opaque) + 1}⟩"
        text, latex = (f"({e.text()})", f"({e.latex()})") if kind == "inverse" else (e.text(), f"{{{e.latex()}}}")
        shape = "diagonal" if kind != "inverse" else "full"
        symmetric = kind == "blockdiag" and bool(e.is_symmetric)
        self.alphabet.add(Letter(name, text, latex, symmetric, shape, None, e))
        self.opaque.append(Opaque(name, kind, e, inner))
        self._leaves[key] = name
        return name


def _bound(symbol: Any, binding: Any) -> Any:
    return symbol if binding is None else symbol._bound(binding)


def _square(factor: Any) -> bool:
    """Whether a factor is square by meaning: H may be square by accident."""
    domain, codomain = factor.domain, factor.codomain
    return domain is None or domain == codomain or domain.dual == codomain
