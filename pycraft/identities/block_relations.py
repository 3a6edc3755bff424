"""Which bodies a statement by block is about: `i above j`, `c the closest common ancestor of i and j`, `j child of k`, ..."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from itertools import combinations, product

from .vocabulary import Misread

Test = Callable[[Sequence[int], "tuple[int, ...]"], bool]
"""Of the parents of all bodies, and the bodies that the letters of a relation stand for."""


def ancestors(parents: Sequence[int], k: int) -> list[int]:
    """k and the bodies between it and the base, outermost first."""
    found = []
    while k >= 0:
        found.append(k)
        k = parents[k]
    return found


def _above(parents: Sequence[int], b: tuple[int, ...]) -> bool:
    return b[0] != b[1] and b[0] in ancestors(parents, b[1])


def _on_one_path(parents: Sequence[int], b: tuple[int, ...]) -> bool:
    return b[0] in ancestors(parents, b[1]) or b[1] in ancestors(parents, b[0])


def _closest(parents: Sequence[int], b: tuple[int, ...]) -> bool:
    of_j = ancestors(parents, b[2])
    return next((a for a in ancestors(parents, b[1]) if a in of_j), None) == b[0]


_TESTS: dict[str, Test] = {
    "{} is above {}": _above,
    "{} is below {}": lambda parents, b: _above(parents, b[::-1]),
    "{} is above {} or the same": lambda parents, b: b[0] in ancestors(parents, b[1]),
    "{} is below {} or the same": lambda parents, b: b[1] in ancestors(parents, b[0]),
    "{} and {} are on one path to the base": _on_one_path,
    "{} and {} are not on one path to the base": lambda parents, b: not _on_one_path(parents, b),
    "{} = {}": lambda _, b: b[0] == b[1],
    "{} ≠ {}": lambda _, b: b[0] != b[1],
    "{} is the parent of {}": lambda parents, b: parents[b[1]] == b[0],
    "{} is a child of {}": lambda parents, b: parents[b[0]] == b[1],
    "{} is the closest common ancestor of {} and {}": _closest,
    "{} is a root": lambda parents, b: parents[b[0]] < 0,
    "{} is the last body": lambda parents, b: b[0] == len(parents) - 1,
}


@dataclass(frozen=True)
class Relation:
    """What is said of the bodies that some letters stand for."""

    says: str
    letters: tuple[str, ...]

    def holds(self, parents: Sequence[int], bodies: dict[str, int]) -> bool:
        return _TESTS[self.says](parents, tuple(bodies[x] for x in self.letters))

    def __str__(self) -> str:
        return self.says.format(*self.letters)


_X = r"([c-z]\d?)(?!\w)"
_IS = r"\s*(?:is|=|:=|,)?\s*"
_AND = rf"{_X}\s*(?:,|and)\s*{_X}"
_CLOSEST = "{} is the closest common ancestor of {} and {}"
_SAME = r"\s+or\s+(?:equal\s+to|the\s+same\s+as|at)\s+"
_PHRASES = [
    (
        rf"{_X}{_IS}(?:the\s+)?(?:closest|nearest|lowest)\s+common\s+ancestor\s+of\s+{_AND}",
        "{} is the closest common ancestor of {} and {}",
    ),
    (rf"{_X}\s*=\s*(?:cca|lca)\s*\(\s*{_X}\s*,\s*{_X}\s*\)", _CLOSEST),
    (rf"{_X}{_IS}above{_SAME}{_X}", "{} is above {} or the same"),
    (rf"{_X}{_IS}below{_SAME}{_X}", "{} is below {} or the same"),
    (rf"{_X}{_IS}(?:above|inboard\s+of|an?\s+ancestor\s+of|ancestor\s+of)\s+{_X}", "{} is above {}"),
    (rf"{_X}{_IS}(?:below|outboard\s+of|a\s+descendant\s+of|descendant\s+of)\s+{_X}", "{} is below {}"),
    (rf"{_AND}\s+(?:are\s+)?not\s+on\s+(?:one|the\s+same|a)\s+path(?:\s+to\s+the\s+base)?", "{} and {} are not on one path to the base"),
    (rf"{_AND}\s+(?:are\s+)?on\s+different\s+(?:paths|branches)", "{} and {} are not on one path to the base"),
    (rf"{_AND}\s+(?:are\s+)?on\s+(?:one|the\s+same|a)\s+path(?:\s+to\s+the\s+base)?", "{} and {} are on one path to the base"),
    (rf"{_X}{_IS}(?:the\s+)?parent\s*(?:of\s*)?\(?\s*{_X}\s*\)?", "{} is the parent of {}"),
    (rf"{_X}\s*=\s*[𝒫℘P]\s*\(\s*{_X}\s*\)", "{} is the parent of {}"),
    (rf"{_X}\s*(?:is|∈|in)?\s*(?:a\s+)?child(?:ren)?\s*(?:of\s*)?\(?\s*{_X}\s*\)?", "{} is a child of {}"),
    (rf"{_X}\s*∈\s*[C𝒞]\s*\(\s*{_X}\s*\)", "{} is a child of {}"),
    (rf"{_X}{_IS}(?:a|the)?\s*root(?:\s+body)?(?!\w)", "{} is a root"),
    (rf"{_X}{_IS}(?:the\s+)?last\s+body(?!\w)", "{} is the last body"),
    (rf"{_X}\s*(?:≠|!=)\s*{_X}", "{} ≠ {}"),
    (rf"{_X}\s*=\s*{_X}", "{} = {}"),
]


@lru_cache(maxsize=1)
def _patterns() -> list[tuple[re.Pattern[str], str]]:
    return [(re.compile(pattern), says) for pattern, says in _PHRASES]


_BETWEEN = re.compile(rf"\s*(?:,|;|and\b|where\b|for\b|if\b|with\b|(?:all|every|any)\s+{_X}(?:\s*,\s*{_X})*|$)\s*")


_WORDS_IN_LATEX = re.compile(r"\\(?:text|mathrm|textrm)\s*\{([^{}]*)\}|\\q?quad(?![A-Za-z])|\\[,;: ]")


def relations(text: str, letters: Sequence[str], begin: int = 0) -> Iterator[Relation]:
    """What is said behind a statement, which begins at a character of the typed text. Raises Misread."""
    at = 0
    text = _WORDS_IN_LATEX.sub(lambda m: (" " * m[0].index(m[1]) + m[1]).ljust(len(m[0])) if m[1] else " " * len(m[0]), text)
    while text[at:].strip():
        for pattern, says in _patterns():
            found = pattern.match(text, at)
            if found is not None:
                named = tuple(found.groups())
                unknown = next((x for x in named if x not in letters), None)
                if unknown is not None:
                    raise Misread(f"no body of the statement is called {unknown}; there are {', '.join(letters)}", begin + found.start())
                yield Relation(says, named)
                at = found.end()
                break
        else:
            found = _BETWEEN.match(text, at)
            if found is None or found.end() == at:
                raise Misread(
                    f"not understood at {text[at : at + 24].strip()!r}; what may be said is, for one, 'i above j', "
                    "'i and j not on one path', 'p parent of k', 'c the closest common ancestor of i and j'",
                    begin + at,
                )
            at = found.end()


def choices(letters: Sequence[str], parents: Sequence[int], said: Iterable[Relation], fixed: dict[str, int]) -> Iterator[dict[str, int]]:
    """The bodies that the letters may stand for."""
    said = list(said)
    for bodies in product(range(len(parents)), repeat=len(letters)):
        chosen = {**fixed, **dict(zip(letters, bodies, strict=True))}
        if all(relation.holds(parents, chosen) for relation in said):
            yield chosen


def standard(letters: Sequence[str]) -> list[Relation]:
    """What may make a statement true that is not true of all bodies; the widest first."""
    pairs = [Relation(says, pair) for says in list(_TESTS)[:8] for pair in combinations(letters, 2)]
    closest = [Relation(_CLOSEST, (c, *[x for x in letters if x != c])) for c in letters if len(letters) == 3]
    return closest + sorted(pairs, key=lambda r: "same" not in r.says)
