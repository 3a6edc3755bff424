"""Formulas one slip of the pen away: star, sign, tilde, letter, order, inverse, factor, number, term; with a description.

A slip may occur at every copy of the same part, as in [I - HφK]* D⁻¹ [I - HφK] with φ for ψ: each change is also made
in all equal parts at once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

from ..formula_nodes import parts
from .formula import Call, Formula, Letter, Node, Number, Power, Product, Star, Sum, inverted, product, rebuilt, starred, total, written

_CONFUSED = (
    {"phi", "psi"}, {"E", "E_psi"}, {"phi_tilde", "psi_tilde"},
    {"M", "P", "R", "P_plus"}, {"G", "K"}, {"Upsilon", "Omega"}, {"D", "MM", "J"},
    {"a", "b"}, {"V_tilde", "V_bar"},
)  # fmt: skip
_ACCENTED = ({"phi", "phi_tilde"}, {"psi", "psi_tilde"}, {"tau", "tau_bar"}, {"P", "P_plus"})
_INSERTED = ("phi", "psi", "H", "M", "P", "D", "G", "K", "E", "tau", "tau_bar", "E_psi", "Upsilon", "Omega", "J")
_ADDED = ("I", "phi", "psi", "M", "P", "R", "J", "D", "K", "G")


@dataclass(frozen=True)
class Slip:
    """A mistake in words, and its cost: likelier slips cost less."""

    words: str
    cost: float


def changed(formula: Formula) -> Iterator[tuple[Formula, Slip]]:
    """Yield every formula one change away, and the slip that leads from it to the typed one."""
    seen = {formula}
    for new, slip in _all(formula):
        if new not in seen and new[0] != new[1]:
            seen.add(new)
            yield new, slip


def _all(formula: Formula) -> Iterator[tuple[Formula, Slip]]:
    for side in (0, 1):
        for new, slip in (*_within(formula[side]), *_numbers(formula[side])):
            yield (new, formula[1]) if side == 0 else (formula[0], new), slip
    repeated = [node for node in dict.fromkeys(p for side in formula for p in parts(side)) if _count(formula, node) > 1]
    for node in repeated:
        for new, slip in _local(node):
            both = tuple(_replaced(side, node, new) for side in formula)
            yield (both[0], both[1]), replace(slip, words=f"{slip.words}, at all {_count(formula, node)} places", cost=slip.cost + 0.25)


def _count(formula: Formula, node: Node) -> int:
    return sum(p == node for side in formula for p in parts(side))


def _replaced(tree: Node, old: Node, new: Node) -> Node:
    if tree == old:
        return new
    return rebuilt(tree, [_replaced(child, old, new) for child in tree.children]) if tree.children else tree


def _within(node: Node) -> Iterator[tuple[Node, Slip]]:
    """Yield changes of a part or within it."""
    yield from _local(node)
    letters = [p for child in node.children for p in parts(child) if isinstance(p, Letter)]
    for i, child in enumerate(node.children):
        where = f", in {_place(node, i)}" if isinstance(node, (Product, Sum)) and not isinstance(child, Letter) else ""
        if isinstance(node, Product) and isinstance(child, Letter) and letters.count(child) > 1:
            where = f", {_place(node, i)}"
        for new, slip in _within(child):
            children = [*node.children[:i], new, *node.children[i + 1 :]]
            deeper = where and ", " not in slip.words and isinstance(child, (Letter, Sum, Product, Star, Power))
            yield rebuilt(node, children), replace(slip, words=slip.words + where) if deeper else slip


_ORDINALS = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth")


def _place(node: Node, i: int) -> str:
    kind = "factor" if isinstance(node, Product) else "term"
    which = "last" if i == len(node.children) - 1 and i > 1 else _ORDINALS[i] if i < len(_ORDINALS) else f"{i + 1}th"
    return f"the {which} {kind}"


def _shown(node: Node) -> str:
    text = written(node, shown=True)
    return f"[{text}]" if isinstance(node, Sum) else text


def _local(node: Node) -> Iterator[tuple[Node, Slip]]:
    """Yield changes of this part itself."""
    if isinstance(node, Number):
        return
    if isinstance(node, Sum):
        yield from _of_sum(node)
    elif isinstance(node, Product):
        yield from _of_product(node)
    if isinstance(node, Letter):
        yield from _of_letter(node)
    if node != Letter("I"):
        had = isinstance(node, Star)
        inner = node.inner if isinstance(node, Star) else node
        yield starred(node), Slip(f"star {'too many' if had else 'missing'} on {_shown(inner)}", 1.0)
        if isinstance(node, (Letter, Sum)) or isinstance(node, Power) and node.exponent == -1:
            had = isinstance(node, Power)
            inner = node.inner if isinstance(node, Power) else node
            yield inverted(node), Slip(f"inverse {'too many' if had else 'missing'} on {_shown(inner)}", 2.0)
    if not isinstance(node, (Sum, Call)):
        yield from _terms_with(node)
        for name in _INSERTED:
            for factor in (Letter(name), Star(Letter(name))):
                yield product(factor, node), Slip(f"factor {_shown(factor)} missing before {_shown(node)}", 2.75)
                yield product(node, factor), Slip(f"factor {_shown(factor)} missing after {_shown(node)}", 2.75)


def _numbers(node: Node) -> Iterator[tuple[Node, Slip]]:
    """Yield changes of a whole side by a number."""
    if isinstance(node, (Sum, Number)):
        return
    for value, name in (*_scales(node), (Fraction(-1), "-1")):
        slip = Slip(f"sign of {_shown(node)}", 1.0) if value < 0 else Slip(f"factor {name} missing in {_shown(node)}", 2.5)
        yield total([(-1, node)]) if value < 0 else product(Number(value), node), slip


def _scales(node: Node) -> tuple[tuple[Fraction, str], ...]:
    """Return numbers that may be missing in a term; none if it has a number, which may be superfluous."""
    has_one = isinstance(node, Product) and any(isinstance(f, Number) for f in node.factors)
    return () if has_one else ((Fraction(2), "2"), (Fraction(1, 2), "½"))


def _of_letter(letter: Letter) -> Iterator[tuple[Node, Slip]]:
    from .formula import INDEXED, SYMBOLS

    if letter.arguments:
        return
    for name in SYMBOLS:
        if name in (letter.name, "N", "I", *INDEXED):
            continue
        new = Letter(name)
        pair = {name, letter.name}
        if pair in _ACCENTED:
            longer = max(pair, key=len)
            mark = {"tilde": "tilde", "bar": "bar", "plus": "plus"}[longer.split("_")[1]]
            yield new, Slip(f"{mark} {'missing' if name == longer else 'too many'} on {_shown(Letter(min(pair, key=len)))}", 1.0)
        else:
            close = any(pair <= group for group in _CONFUSED)
            yield new, Slip(f"{_shown(letter)} written for {_shown(new)}", 1.5 if close else 2.25)


def _of_product(node: Product) -> Iterator[tuple[Node, Slip]]:
    factors = node.factors
    for i, factor in enumerate(factors):
        rest = [*factors[:i], *factors[i + 1 :]]
        yield product(*rest), Slip(f"factor {_shown(factor)} too many", 2.25)
        if isinstance(factor, Number) and factor.value != 0:
            yield product(Number(1 / factor.value), *rest), Slip(f"number {_shown(factor)} upside down", 2.0)
        if i:
            swapped = [*factors[: i - 1], factor, factors[i - 1], *factors[i + 1 :]]
            yield product(*swapped), Slip(f"{_shown(factors[i - 1])} and {_shown(factor)} in the wrong order", 1.5)
    for i in range(1, len(factors)):
        for name in _INSERTED:
            for new in (Letter(name), Star(Letter(name)), Power(Letter(name), -1)):
                words = f"factor {_shown(new)} missing between {_shown(factors[i - 1])} and {_shown(factors[i])}"
                yield product(*factors[:i], new, *factors[i:]), Slip(words, 2.5)


def _of_sum(node: Sum) -> Iterator[tuple[Node, Slip]]:
    terms = list(zip(node.signs, node.terms, strict=True))
    for i, (sign, term) in enumerate(terms):
        flipped = [*terms[:i], (-sign, term), *terms[i + 1 :]]
        yield total(flipped), Slip(f"sign of {_shown(term)}", 1.0)
        for value, name in _scales(term):
            scaled = [*terms[:i], (sign, product(Number(value), term)), *terms[i + 1 :]]
            yield total(scaled), Slip(f"factor {name} missing in {_shown(term)}", 2.5)
        if len(terms) > 1:
            yield total([*terms[:i], *terms[i + 1 :]]), Slip(f"term {_shown(term)} too many", 2.5)
    yield from _terms_with(node)


def _terms_with(node: Node) -> Iterator[tuple[Node, Slip]]:
    for name in _ADDED:
        for sign in (1, -1):
            new = Letter(name)
            yield total([(1, node), (sign, new)]), Slip(f"term {'+' if sign > 0 else '-'} {_shown(new)} missing", 3.0)
