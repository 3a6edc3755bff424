"""Statements by block: `Ω(i,j) = ψ*(c,i)Υ(c)ψ(c,j), c the closest common ancestor of i and j`, as text.

An operator with bodies behind it is one of its blocks: X(i,j) leads from body j to body i, X(k) of a block-diagonal operator is X(k,k),
x(k) of a vector its entries of body k. As in the book X*(i,j) is the transpose of X(i,j); D⁻¹(k) is D(k)⁻¹. Bodies are small letters from c
to z, ℘(k), 𝒫(k) or parent(k), or a body's own name; on serial chains, numbered from the tip as in the book, k+1 is the parent of k and k-1
what it carries. Σ_{j∈C(k)} or Σ_{j∈children(k)} sums the product behind it over the children of k, Σ_{j∈path(k)} over k and the bodies
between it and the base, Σ_{j∈outboard(k)} over k and all that it carries, Σ_j over all bodies; ∏ multiplies numbers so. Behind a comma or
"where" stands which bodies are meant, see `block_relations`, and letters by block: S(k) = E(k), said of every k. [X](i,j) is a block of an
expression of operators.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

from ..formula_nodes import parts
from .block_relations import Relation, relations
from .definitions import Definition, letter_name, pieces, shown_text
from .dialects import divided
from .formula import INDEXED, Formula, Letter, Node, Power, rebuilt, starred, written
from .formula_reading import LETTERS, Book
from .spelling import Spelled, spelled
from .standard_letters import GUARDED
from .vocabulary import Misread, ParseError

VARIABLE = r"[c-z]\d?"
_PARENT = rf"(?:(?:parent|℘|P)\s*\(\s*(?P<of>{VARIABLE})\s*\)|(?P<at>{VARIABLE})\s*(?P<next>[+-])\s*1(?!\w))"
_GROUPS = {"C": "children", "C_force": "children", "child": "children", "path": "path", "outboard": "outboard", "children": "children"}
_SUFFIX = r"(?:\^\*|\^-1|\^T|'|\*)?"


@dataclass(frozen=True)
class SumOver(Node):
    """Σ inner, or ∏ inner, over the children of a body, its path to the base or all outboard of it; over all bodies where `of` is empty."""

    index: str
    of: str
    inner: Node
    among: str = "children"
    multiplied: bool = False

    @property
    def children(self) -> tuple[Node, ...]:
        return (self.inner,)


@dataclass(frozen=True)
class Entry(Node):
    """[X](i,j), a block of an expression of operators; [x](k) of a vector."""

    inner: Node
    arguments: tuple[str, ...]

    @property
    def children(self) -> tuple[Node, ...]:
        return (self.inner,)


@dataclass(frozen=True)
class BlockStatement:
    """Two sides, the letters that run over bodies, and which of them are meant."""

    text: str
    formula: Formula
    indices: tuple[str, ...]
    relations: tuple[Relation, ...]
    definitions: tuple[Definition, ...] = ()

    @property
    def understood(self) -> str:
        """How it was read."""
        meant = ", ".join(
            [*map(str, self.relations), *(f"{d.name} := {shown_text(d.what)}" for d in self.definitions if self._uses(d.name))]
        )
        return " = ".join(map(shown, self.formula)) + (f", {meant}" if meant else "")

    def _uses(self, name: str) -> bool:
        return any(isinstance(node, Letter) and node.name == name for side in self.formula for node in parts(side))

    def beside(self, what: str) -> set[str]:
        """The letters of bodies of which the parent, or the child, is spoken of: bodies that have one."""
        found = {a for side in self.formula for node in parts(side) if isinstance(node, (Letter, Entry)) for a in node.arguments}
        return {a[len(what) + 1 : -1] for a in found if a.startswith(f"{what}(")}

    @property
    def of_chains(self) -> bool:
        """Whether bodies are numbered along a serial chain: k+1 or k-1 stand in it."""
        return bool(re.search(rf"(?<![\w)]){VARIABLE}\s*[+-]\s*1(?!\w)", spelled(self.text).text)) and bool(
            self.beside("child") | self.beside("parent")
        )


def is_by_block(text: str, bodies: Iterable[str] = (), own: Iterable[str] = ()) -> bool:
    """Whether blocks of bodies stand in a text; `own` are letters that are defined for it, and bodies are none of them."""
    source = spelled(_divided(text)[0]).text
    found = _block(tuple(bodies), frozenset(own)).finditer(source)
    return _entry(tuple(bodies)).search(source) is not None or any(
        m["name"] and not {a.strip() for a in m["arguments"].split(",")} & {*own} for m in found
    )


def says_by_block(text: str, bodies: Iterable[str] = ()) -> bool:
    """`is_by_block`, of a statement with the definitions around it."""
    named = [*bodies]
    definitions, claim = divided(text, lambda said, own: is_by_block(said, named, own))
    return is_by_block(claim, named, [d.name for d in definitions])


def refuse_by_block(text: str, own: Iterable[str] = ()) -> None:
    """Raises ParseError for a statement by block: what reads operators alone says so."""
    if is_by_block(text, own=own):
        raise ParseError(
            f"{text!r} is a statement by block: pycraft.check evaluates it for every choice of bodies, pycraft.prove derives those of "
            "every body, its parent and its children; statements by block are not mapped or repaired"
        )


def read_by_block(text: str, bodies: Iterable[str] = (), before: Iterable[Definition] = ()) -> BlockStatement:
    """The statement; `before` are definitions that do not stand in the text.

    Raises
    ------
    ParseError
        It does not read as one; the place is shown.
    """
    definitions, claim = divided(text, lambda said, own: is_by_block(said, bodies, own))
    definitions = [*before, *definitions]
    own = frozenset(d.name for d in definitions)
    said, meant = _divided(claim)
    source = spelled(said)
    try:
        of_body, meant = _letters_of_bodies(meant)
        own |= {*of_body}
        if re.search(r"\.T|@", source.text) and re.search(r"\)\s*\*\s*\w", source.text):
            raise Misread("with .T and @ a * says two things: write @ to multiply", source.text.index("*"))
        sides = [(m.start(), m.end()) for m in re.finditer(r"==?", source.text)]
        if len(sides) != 1:
            raise ParseError(f"{'one side' if not sides else 'more than two sides'}; a statement is lhs = rhs")
        (at, behind) = sides[0]
        left = _BlockBook(source.text[:at], 0, tuple(bodies), own).whole()
        right = _BlockBook(source.text[behind:], behind, tuple(bodies), own).whole()
        for name, (index, what) in of_body.items():
            inner = _BlockBook(what, 0, tuple(bodies), own).whole()
            left, right = (_with_letter(side, name, index, inner) for side in (left, right))
        free = _free((left, right), {*bodies})
        return BlockStatement(claim, (left, right), free, tuple(relations(meant, free, len(said))), tuple(definitions))
    except Misread as error:
        place = (
            Spelled(claim, claim, list(range(len(claim) + 1))).place(error.at)
            if error.at >= len(said) and meant
            else source.place(error.at)
        )
        lines = "".join(f"\n    {line}" for line in place.split("\n"))
        raise ParseError(f"{text!r} does not read as a statement by block.\n  {error.message}{lines}") from None
    except ParseError as error:
        raise ParseError(f"{text!r} does not read as a statement by block.\n  {error}") from None


_OF_BODY = re.compile(
    rf"[\s,;]*(?:(?:where|with|and)\s+|\\q?quad\s*)*(?P<name>[^\s(),=]+)\s*\(\s*(?P<of>{VARIABLE})\s*\)\s*:?=(?P<what>[^=].*)$"
)


def _letters_of_bodies(meant: str) -> tuple[dict[str, tuple[str, str]], str]:
    """(letters that are defined by block behind a statement, their body and what they stand for; the rest of what stands there)."""
    found: dict[str, tuple[str, str]] = {}
    rest = []
    for part in pieces(meant, ",;"):
        made = _OF_BODY.match(part)
        if made is None:
            rest.append(part)
        else:
            found[letter_name(made["name"])] = made["of"], spelled(made["what"]).text
    return found, ",".join(rest) if found else meant


def _with_letter(node: Node, name: str, index: str, inner: Node) -> Node:
    """A side with the letter of a body as what it stands for."""
    if isinstance(node, Letter) and node.name == name:
        if len(node.arguments) != 1:
            raise ParseError(f"{name} is defined for one body, {name}({index})")
        return _renamed(inner, index, node.arguments[0])
    if not node.children:
        return node
    return _rebuilt(node, [_with_letter(child, name, index, inner) for child in node.children])


def _renamed(node: Node, index: str, body: str) -> Node:
    """What is said of one body, said of another."""
    arguments = getattr(node, "arguments", ())
    if any(index in a for a in arguments) and not re.fullmatch(VARIABLE, body) and any(a != index for a in arguments if index in a):
        raise ParseError(f"{written(node)} of {body}: bodies two hinges away have no names here")
    renamed = tuple(re.sub(rf"(?<!\w){index}(?!\w)", body, a) for a in arguments)
    if isinstance(node, Letter):
        return Letter(node.name, renamed)
    made = _rebuilt(node, [_renamed(child, index, body) for child in node.children]) if node.children else node
    return replace(made, arguments=renamed) if isinstance(made, Entry) else made


def _rebuilt(node: Node, children: list[Node]) -> Node:
    if isinstance(node, (Entry, SumOver)):
        return replace(node, inner=children[0])
    return rebuilt(node, children)


def shown(node: Node) -> str:
    """A side as the book prints it."""
    if isinstance(node, Entry):
        return f"[{shown(node.inner)}]({', '.join(node.arguments)})"
    if isinstance(node, SumOver):
        sign = "∏" if node.multiplied else "Σ"
        return f"{sign}_{{{node.index}{f' ∈ {node.among}({node.of})' if node.of else ''}}} {shown(node.inner)}"
    stands = {
        child: Letter(f"\0{i}")
        for i, child in enumerate(dict.fromkeys(node.children))
        if any(isinstance(p, (SumOver, Entry)) for p in parts(child))
    }
    if not stands:
        return written(node, shown=True)
    text = written(rebuilt(node, [stands.get(c, c) for c in node.children]), shown=True)
    for child, letter in stands.items():
        text = text.replace(letter.name, shown(child))
    return text


def _divided(text: str) -> tuple[str, str]:
    """The statement, and what is said behind its first comma outside of brackets, or behind "where"."""
    depth = 0
    for i, c in enumerate(text):
        if i and text[i - 1] == "\\" and c in ",;:{}":
            continue
        depth += (c in "([{") - (c in ")]}")
        if depth == 0 and (c in ",;" or re.match(r"\b(where|for|if|with)\b", text[i:]) and (i == 0 or not text[i - 1].isalnum())):
            return text[:i], text[i:]
    return text, ""


@lru_cache(maxsize=32)
def _entry(bodies: tuple[str, ...]) -> re.Pattern[str]:
    """The end of [X](i,j): two bodies behind a bracket."""
    return re.compile(rf"\s*\]\s*\(\s*(?P<arguments>(?:{_body(bodies)})\s*,\s*(?:{_body(bodies)}))\s*\)")


def _body(bodies: tuple[str, ...]) -> str:
    """A body: by a small letter, as a parent or child, or by its own name."""
    own = (rf"'?\"?{re.escape(name)}'?\"?(?!\w)" for name in sorted(bodies, key=len, reverse=True))
    return "|".join([re.sub(r"\?P<\w+>", "?:", _PARENT), rf"{VARIABLE}(?!\w)", *own])


@lru_cache(maxsize=32)
def _block(bodies: tuple[str, ...], defined: frozenset[str] = frozenset()) -> re.Pattern[str]:
    """A letter with bodies, an optional suffix between; functions and the letters that take other arguments are passed over."""
    from .vocabulary import FUNCTIONS

    body = _body(bodies)
    letters = LETTERS - {"I", "N"} | defined
    names = "|".join((r"(?<![A-Za-z])" if n in GUARDED else "") + re.escape(n) for n in sorted(letters, key=lambda n: (-len(n), n)))
    passed = "|".join(re.escape(n) for n in (*FUNCTIONS, *INDEXED))
    return re.compile(
        rf"(?:(?:{passed})\s*(?=\())|(?P<name>{names})\s*(?P<suffix>{_SUFFIX})\s*\(\s*(?P<arguments>(?:{body})(?:\s*,\s*(?:{body}))*)\s*\)"
    )


_SUM = re.compile(
    rf"\s*(?P<sign>Σ|∑|sum(?=_)|∏|Π|prod(?=_))\s*_?\s*(?P<open>[{{(])?\s*(?:\\?forall|∀)?\s*(?P<index>{VARIABLE})"
    rf"(?:\s*(?:∈|\\in|\bin\b)\s*(?P<among>C(?:_force)?|children|child|path|outboard)\s*\(\s*(?P<of>{VARIABLE})\s*\))?\s*(?(open)[}})])"
)


class _BlockBook(Book):
    """The book's reading, with blocks of bodies and sums over bodies among its factors."""

    def __init__(self, source: str, begin: int, bodies: tuple[str, ...], own: frozenset[str] = frozenset()):
        self._bodies, self._begin = bodies, begin
        super().__init__(source, own)

    def _token(self, source: str, at: int) -> tuple[str, str, int] | None:
        space = len(source[at:]) - len(source[at:].lstrip())
        block = _block(self._bodies, self._own).match(source, at + space)
        if block is not None and block["name"]:
            return "block", f"{block['name']};{block['suffix']};{block['arguments']}", block.end()
        entry = _entry(self._bodies).match(source, at)
        if entry is not None:
            return "entry", entry["arguments"], entry.end()
        summed = _SUM.match(source, at)
        if summed is not None:
            among = _GROUPS[summed["among"] or "children"]
            return "over", f"{summed['index']};{summed['of'] or ''};{among};{summed['sign'][0] in '∏Πp'}", summed.end()
        return super()._token(source, at)

    def _stumbled(self, message: str, at: int) -> ParseError:
        return Misread(message, at + self._begin)

    def _starts_factor(self, kind: str, text: str) -> bool:
        return kind in ("block", "over") or super()._starts_factor(kind, text)

    def _atom(self) -> Node:
        kind, text = self._next()
        if text == "[":
            self._take()
            node = self._sum()
            if self._next()[0] != "entry":
                self._close()
                return node
            return Entry(node, tuple(map(_bare, self._take()[1].split(","))))
        if kind == "over":
            self._take()
            index, of, among, multiplied = text.split(";")
            return SumOver(index, of, self._product(), among, multiplied == "True")
        if kind == "block":
            self._take()
            name, suffix, arguments = text.split(";")
            name = name if name in self._own else {"X": "X_world", "V": "velocity"}.get(name, name)
            named = Letter(name, tuple(map(_bare, arguments.split(","))))
            if suffix == "^-1" and len(named.arguments) > 1:
                raise self._stumbled(f"of the inverse of a block or a block of the inverse? write inv({name}({arguments}))", self._at)
            return starred(named) if suffix and suffix != "^-1" else Power(named, -1) if suffix else named
        return super()._atom()


def _bare(argument: str) -> str:
    argument = argument.strip().strip("'\"")
    found = re.fullmatch(_PARENT, argument)
    if found is None:
        return argument
    return f"parent({found['of']})" if found["of"] else f"{'parent' if found['next'] == '+' else 'child'}({found['at']})"


def _free(sides: Iterable[Node], bodies: set[str]) -> tuple[str, ...]:
    """The letters of bodies that no sum runs over, in order."""

    def walk(node: Node, bound: frozenset[str]) -> Iterator[str]:
        if isinstance(node, SumOver):
            if node.of and node.of not in bound:
                yield node.of
            bound = bound | {node.index}
        if isinstance(node, (Letter, Entry)):
            for a in node.arguments:
                letter = re.sub(r"^(?:parent|child)\((.*)\)$", r"\1", a)
                if letter not in bound and letter not in bodies and not (isinstance(node, Letter) and node.name in INDEXED):
                    yield letter
        for child in node.children:
            yield from walk(child, bound)

    return tuple(dict.fromkeys(letter for side in sides for letter in walk(side, frozenset())))
