r"""Notations of other authors: `dialect Park; M = S^T G^T J G S`, or `pycraft.check(statement, dialect="Park")`.

A dialect is a table of definitions in the book's letters, a TOML file in `schools/`:

    about = "who uses it"
    subscripts = "v S I"            letters whose subscript is a body: v_i is v(i), v_{\lambda(i)} the parent's
    [letters]
    S = "H^*"                       a list where a letter has several meanings, of which the spaces choose
    [spellings]
    '\mathrm{ad}_{S\dot q}' = "ad_Sq"    spellings that no rule of letters, subscripts and accents reads

Letters that a dialect does not define have the book's meaning.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files

from ..models.loaders.toml_lines import tomllib
from .definitions import Definition, letter_name, parted
from .vocabulary import ParseError

_DIRECTIVE = re.compile(r"\s*dialect\s+([^\W\d]\w*)\s*;")
_UP = r"(?:\\lambda|λ|\\wp|℘|p)\s*\(\s*([c-z])\s*\)"
_DOWN = r"(?:\\mathrm\s*\{\s*([A-Za-z])\s*\}|([A-Za-z]))"


@dataclass(frozen=True)
class Dialect:
    """The letters of one notation."""

    name: str
    about: str
    definitions: tuple[Definition, ...]
    respell: Callable[[str], str]


@lru_cache(maxsize=1)
def dialects() -> dict[str, Dialect]:
    """Return all dialects by name."""
    found = [path for path in files(__package__).joinpath("schools").iterdir() if path.name.endswith(".toml")]
    return {path.name.removesuffix(".toml"): _read(path.name.removesuffix(".toml"), path.read_text(encoding="utf-8")) for path in found}


def _read(name: str, text: str) -> Dialect:
    data = tomllib.loads(text)
    made = []
    for letter, what in data["letters"].items():
        first, *others = [what] if isinstance(what, str) else what
        made.append(Definition(letter_name(letter), first, f"{letter} := {first}", tuple(others), True))
    rules = [(re.compile(r"\s*".join(map(re.escape, _tokens(typed)))), f" {new} ") for typed, new in data.get("spellings", {}).items()]
    of_bodies = _subscripted(data.get("subscripts", "").split())

    def respell(said: str) -> str:
        for pattern, form in (*rules, *of_bodies, *rules):  # I^A, and I_i^A, which is I^A(i)
            said = pattern.sub(form, said)
        return said

    return Dialect(name, data["about"], tuple(made), respell)


def _tokens(typed: str) -> list[str]:
    return re.findall(r"\\[A-Za-z]+|\S", typed)


def _subscripted(letters: list[str]) -> list[tuple[re.Pattern[str], str]]:
    """Return letters with bodies as subscripts, v_i, I_i^A, v_{λ(i)}, as letters of bodies, and the transforms of a body to its parent."""
    if not letters:
        return []
    dotted = "|".join(re.escape(x) for x in sorted(letters, key=len, reverse=True))
    letter = rf"(?<![A-Za-z\\])((?:\\dd?ot\s*\{{?\s*)?(?:{dotted})\}}?\u0307?\u0308?)"
    raised = r"((?:\s*\^\s*(?:\{[^{}]*\}|\\top|[A-Za-z*]))*)"
    return [
        (re.compile(r"\{\}\s*\^\s*\{?\s*([c-z])\s*\}?\s*X\s*_\s*\{\s*" + _UP + r"\s*\}"), r" φ^*(℘(\1),\1) "),
        (re.compile(r"\{\}\s*\^\s*\{\s*" + _UP + r"\s*\}\s*X\s*_\s*\{?\s*([c-z])\s*\}?\s*\^\s*\{?\s*\*\s*\}?"), r" φ(℘(\2),\2) "),
        (re.compile(letter + r"\s*_\s*\{\s*" + _UP + r"\s*\}" + raised), r"\1\3(℘(\2))"),
        (re.compile(letter + r"\s*_\s*\{?\s*([c-z])(?![A-Za-z(])\s*\}?" + raised), r"\1\3(\2)"),
    ]


def in_dialect(text: str, dialect: str | None) -> str:
    """Return a statement as text that names its dialect."""
    if dialect is None:
        return text
    _named(dialect)
    return f"dialect {dialect}; {text}"


def of_dialect(text: str) -> tuple[Dialect | None, str]:
    """Return the dialect named in a text, and the rest in known spellings. Raises ParseError."""
    said = _DIRECTIVE.match(text)
    if said is None:
        return None, text
    found = _named(said[1])
    return found, found.respell(text[said.end() :]).strip()


def divided(text: str, is_by_block: Callable[[str, Iterable[str]], bool] | None = None) -> tuple[list[Definition], str]:
    """Return `definitions.parted`, with the letters of the dialect named in the text."""
    dialect, rest = of_dialect(text)
    own = [d.name for d in dialect.definitions] if dialect is not None else []
    found, claim = parted(rest, None if is_by_block is None else lambda said, more: is_by_block(said, [*own, *more]))
    return [*(dialect.definitions if dialect is not None else ()), *found], claim


def _named(name: str) -> Dialect:
    if name not in dialects():
        raise ParseError(f"no dialect is called {name!r}; there are {', '.join(sorted(dialects()))}")
    return dialects()[name]
