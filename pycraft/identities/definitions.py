"""Letters of one's own around a statement: `x ∈ Θ; A := I + HφK; statement`, or behind it: `statement, where ν = D⁻¹ε`.

A definition is `name := expression`, `name ∈ Θ` for a vector of which nothing else is known, or `name : Θ → V` for such an operator; W is
the space between M^½ and M^½*. Names are letters of any alphabet, with subscripts and accents. They hold for the statement and for the
definitions that follow; of those behind it each holds for the ones before it, as one says them: ν = D⁻¹(T - Hz), z = ψ(KT + Pa + b).
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _core
from .spelling import GREEK, spelled
from .standard_letters import STANDARD
from .vocabulary import ParseError, is_known

_SPACE = r"Θ|Theta|\\Theta|\\mathcal\s*\{?\s*V\s*\}?|𝒱|V|F|R\^?\d*"
_MAP = re.compile(rf"({_SPACE}|W)\s*(?:→|->|\\to|\\rightarrow)\s*({_SPACE}|W)$")
_VECTOR = re.compile(rf"({_SPACE})$")
_SIGNS = (":=", "≜", "≝", "\\triangleq", "\\coloneqq", "∈", "\\in ", " in ", ":")
_BEHIND = re.compile(r"(?:\b(?:where|with|and)\b|(?<!\\)[,;]|\\q?quad(?![A-Za-z])|\\text\s*\{\s*(?:where|with|and)\s*\}|\s)*")


@dataclass(frozen=True)
class Definition:
    """A letter: its name in the grammar's spelling, what it stands for, and both as they were typed.

    `others` are further meanings, where the spaces choose one; `of_the_book` says that it is defined by letters of the book alone.
    """

    name: str
    what: str
    typed: str
    others: tuple[str, ...] = ()
    of_the_book: bool = False


def letter_name(typed: str) -> str:
    """A name in the grammar's spelling, "Gamma" for Γ; raises ParseError for what is none."""
    name = re.sub(r"\s*_\s*", "_", spelled(typed.strip()).text.strip())
    if not name.isidentifier():
        raise ParseError(f"{typed.strip()!r} is no name for a letter: a letter of any alphabet, with letters, digits and _ behind it")
    return name


def is_letter(typed: str) -> bool:
    """Whether a text is one letter, with subscripts and accents, and nothing else: HG is two."""
    try:
        base = letter_name(typed).partition("_")[0]
    except ParseError:
        return False
    return len(base) == 1 or base in GREEK or is_known(base)


def pieces(text: str, separators: str) -> list[str]:
    """The parts of a text between separators that stand outside of brackets; \\, and \\; are spaces of LaTeX."""
    found, begin, depth = [], 0, 0
    for i, c in enumerate(text):
        if i and text[i - 1] == "\\" and c in ",;:{}":
            continue
        depth += (c in "([{") - (c in ")]}")
        if depth <= 0 and c in separators:
            found.append(text[begin:i])
            begin = i + 1
    return [*found, text[begin:]]


def definition(text: str, signs: Iterable[str] = _SIGNS) -> Definition | None:
    """What a text defines; None where it is no definition."""
    for sign in signs:
        name, found, what = text.partition(sign)
        if found and what.strip() and (sign == ":=" or is_letter(name) and not what.startswith("=")):
            return Definition(letter_name(name), what.strip(), text.strip())
    return None


def parted(text: str, is_by_block: Callable[[str, Iterable[str]], bool] | None = None) -> tuple[list[Definition], str]:
    """(the definitions in front of and behind a statement, the statement).

    Behind a statement by block, of which `is_by_block` tells, stand relations of bodies, and definitions with := alone.

    Raises
    ------
    ParseError
        A part in front of the statement is no definition.
    """
    *before, claim = pieces(text, ";")
    found: list[Definition] = []
    while before:
        made = definition(before[0])
        if made is None:
            break
        found.append(made)
        del before[0]
    by_block = is_by_block is not None and is_by_block(";".join([*before, claim]), [d.name for d in found])
    if before and not by_block:
        behind = [_behind(part, (":=",)) for part in [*before[1:], claim]]
        if any(d is None for d in behind):
            raise ParseError(f"{before[0].strip()!r} is no definition: write name := expression, name : Θ → Θ, or name ∈ Θ")
        return found + [d for d in reversed(behind) if d is not None], before[0].strip()
    claim = ";".join([*before, claim])
    first, *rest = pieces(re.sub(r"(?<![\w\\])(?:where|with)(?!\w)|\\text\s*\{\s*(?:where|with)\s*\}", ",", claim), ",")
    made_behind = [_behind(part, (":=",) if by_block else (":=", "=", ":", "∈")) for part in rest]
    found += [d for d in reversed(made_behind) if d is not None] if by_block or None not in made_behind else []
    if by_block:
        relations = [part for part, d in zip(rest, made_behind, strict=True) if d is None]
        return found, ",".join([first, *relations]).strip() if any(made_behind) else claim.strip()
    return found, first.strip() if rest and None not in made_behind else claim.strip()


def _behind(part: str, signs: Iterable[str]) -> Definition | None:
    """What a part behind a statement defines: one letter on its left side; None where it is no definition."""
    begin = _BEHIND.match(part)
    part = part[begin.end() if begin else 0 :]
    for sign in signs:
        name, found, what = part.partition(sign)
        of_spaces = sign not in (":", "∈") or _MAP.match(what.strip()) or _VECTOR.match(what.strip())
        if found and what.strip() and "=" not in what and of_spaces and is_letter(name):
            return Definition(letter_name(name), what.strip(), f"{name.strip()} := {what.strip()}")
    return None


def shown_text(what: str) -> str:
    """The text of a definition as it is shown: the table's letters for the grammar's names."""
    text = re.sub(r"\s+", " ", re.sub(r"[A-Za-z_]+", lambda m: _SHOWN.get(m[0], m[0]), spelled(what).text)).strip()
    return re.sub(r" ?\^\*(?: (?=[)\]]))?", "*", text)


_SHOWN = {s.name: s.text for s in _core.symbols} | {n: known.text for n, known in STANDARD.items()} | {"MM": "ℳ", "vdot": "θ̈"}


def drawn(seed: int = 0) -> Callable[[str, Any], Any]:
    """Vectors of random numbers as operators that have them, by name and space: for what takes no vectors whose numbers are given later."""

    def vector(name: str, space: Any) -> Any:
        rng = np.random.default_rng([seed, *name.encode()])
        return _core.constant(rng.uniform(-1, 1, (space.dimension, 1)), _core.euclidean(1), space, name)

    return vector


def is_map(made: Definition) -> bool:
    """Whether a letter is an operator of which nothing is known but its spaces."""
    return _MAP.match(made.what) is not None


def meant(made: Definition, operators: Any, read: Callable[[str], Any], vector: Callable[[str, Any], Any] = _core.vector) -> Any:
    """What a letter stands for on a model; `read` makes an expression of text.

    Raises
    ------
    ParseError
        A space that the model has not; text that is no expression.
    """
    if (found := _VECTOR.match(made.what)) is not None:
        return vector(made.name, _space(found[1], operators))
    if (found := _MAP.match(made.what)) is not None:
        domain, codomain = _space(found[1], operators), _space(found[2], operators)
        rng = np.random.default_rng([*made.name.encode()])
        return _core.constant(rng.uniform(-1, 1, (codomain.dimension, domain.dimension)), domain, codomain, made.name)
    return read(made.what)


def _space(name: str, operators: Any) -> Any:
    name = re.sub(r"\\mathcal|[\s{}\\]", "", name).replace("𝒱", "V")
    if name.startswith("R"):
        return _core.euclidean(int(name.removeprefix("R").removeprefix("^") or 1))
    if name == "W":
        return operators.M.sqrt().domain
    return operators.Theta if name in ("Θ", "Theta") else getattr(operators, name)
