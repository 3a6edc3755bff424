"""Words of numbers: traces, ln|det| and norms, their reciprocals and products.

A number is a polynomial whose words are ("tr", X, Y, ...), the trace of XY... up to rotation and transposition, ("ln det", X),
("norm", X) and ("1",), their reciprocals ("1/", ...) and products ("×", ..., ";", ...).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from .. import _core
from .normal_form import WORDS
from .walk import GaveUp
from .words import NUMBER, Alphabet, Polynomial, Word, add_to, factors_of, ratio, split, underived

_DUALS = {"F": "V", "V": "F", "NodesF": "NodesV", "NodesV": "NodesF"}
_SPACES_OF = {s.name: (s.domain, s.codomain) for s in _core.symbols} | {"S": ("F", "V")}


def trace_word(word: Word, alphabet: Alphabet, space: str) -> Word:
    """Return tr(word), by the first of its rotations and its transpose's rotations; tr I by its space."""
    if not word:
        return ("tr", f"I[{min(space, _DUALS.get(space, space))}]")
    return ("tr", *min(rotations(word, alphabet)))


def trace_of(p: Polynomial, alphabet: Alphabet, space: str) -> Polynomial:
    """The trace of a polynomial that acts on this space."""
    total: Polynomial = {}
    for word, c in p.items():
        add_to(total, trace_word(word, alphabet, space), c)
    return total


def product_word(factors: Iterable[Word]) -> Word:
    """The product of numbers, which commute."""
    every = sorted(factors)
    if len(every) < 2:
        return every[0] if every else NUMBER
    return ("×", *(x for i, f in enumerate(every) for x in ((";",) if i else ()) + f))


def product_of(p: Polynomial, q: Polynomial) -> Polynomial:
    """p q, of numbers."""
    total: Polynomial = {}
    for u, x in p.items():
        for w, y in q.items():
            add_to(total, product_word([*factors_of(u), *factors_of(w)]), x * y)
    if len(total) > WORDS:
        raise GaveUp
    return total


def reciprocal_of(p: Polynomial) -> Polynomial | None:
    """1/p of one word; None of zero and of sums."""
    if len(p) != 1:
        return None
    ((word, c),) = p.items()
    return {product_word(w[1:] if w[0] == "1/" else ("1/", *w) for w in factors_of(word)): ratio(1, c)}


def space_of(word: Word, alphabet: Alphabet) -> str:
    """Return the space of a word's values."""
    name, mark = split(word[0])
    known = alphabet.letters[underived(name)]
    if known.word:
        return space_of(alphabet.star_word(known.word) if mark == "*" else known.word, alphabet)
    e = known.expression
    if isinstance(e, _core.Operator) and e.domain is not None:
        domain, codomain = e.domain.name, e.codomain.name
    else:
        domain, codomain = _SPACES_OF[known.ascii or known.name]
    return {"": codomain, "⁻¹": domain, "*": _DUALS.get(domain, domain), "⁻*": _DUALS.get(codomain, codomain)}[mark]


def rotations(word: Word, alphabet: Alphabet) -> Iterator[Word]:
    """Return the words with the same trace: the rotations of this word and of its transpose."""
    for w in (word, alphabet.star_word(word)):
        yield from (w[i:] + w[:i] for i in range(len(w)))
