"""Break long formulas in LaTeX as books do: at relations, then at sums, then between factors, then inside brackets.

The result has no environment except `aligned`, with lines that contain whole pairs of \\left and \\right: MathJax and KaTeX both accept it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import accumulate

WIDTH = 64
"""Letters per line: some 40 em, the width of a notebook's cell and of a page of text."""
DEEPEST = 60
"""Depth of brackets beyond which a formula is left unchanged."""
LONGEST = 20_000
"""Number of characters beyond which a formula is left unchanged."""
_TOKEN = re.compile(r"\\(?:left|right)(?![A-Za-z])\s*(?:\\[A-Za-z]+|\\.|.)|\\[A-Za-z]+\s*|\\.|\s+|.", re.S)
_OPENS, _CLOSES = re.compile(r"[(\[]|\\\{|\\left(?![A-Za-z])."), re.compile(r"[)\]]|\\\}|\\right(?![A-Za-z]).")
_RELATIONS = {"=", "<", ">", "\\le", "\\ge", "\\leq", "\\geq", "\\ne", "\\to", "\\approx", "\\equiv"}
_SIGNS = {"+", "-"}
_NO_WIDTH = {
    "\\,",
    "\\;",
    "\\:",
    "\\!",
    "\\ ",
    "{",
    "}",
    "^",
    "_",
    "\\displaystyle",
    "\\text",
    "\\mathrm",
    "\\mathcal",
    "\\mathfrak",
    "\\mathbf",
}
_ACCENTS = {"\\tilde", "\\bar", "\\dot", "\\ddot", "\\hat", "\\operatorname", "\\frac", "\\small", "\\quad", "\\qquad"}
_PREFIXES = {*_ACCENTS, "\\text", "\\mathrm", "\\mathcal", "\\mathfrak", "\\mathbf", "\\ln", "\\det", "\\partial"}
"""Commands that stay with the piece after them."""
_WORDS = {"\\ln": 2, "\\det": 3, "\\operatorname": 0, "\\left": 0, "\\right": 0, "\\quad": 2, "\\qquad": 4}


@dataclass
class _Piece:
    """A factor, a sign between two, a relation, a comma, or a prefix, with everything attached to it; for a bracket also its contents."""

    kind: str
    text: str
    before: str = ""
    inside: list[_Piece] = field(default_factory=list)
    after: str = ""

    @property
    def width(self) -> float:
        return formula_width(self.text)


def in_lines(latex: str, width: int = WIDTH) -> str:
    """Return a formula with lines of at most some `width` letters: unchanged if it is short enough, else an aligned environment.

    Without line ends and alignment marks it is the same formula, piece by piece. Formulas with an environment of their own, or with more
    than 20 000 characters or 60 nested brackets, are left unchanged. Time and memory are proportional to the formula's length times the
    depth of its brackets.

    Examples
    --------
    >>> from pycraft.operators.latex_lines import in_lines
    >>> in_lines("A = B + C")
    'A = B + C'
    >>> print(in_lines("A = B + C", width=3))
    \\begin{aligned}& A\\\\
    & {}= B\\\\
    & \\quad {}+ C\\end{aligned}
    """
    rows = lines_of(latex, width)
    return latex if len(rows) == 1 else aligned(rows)


def lines_of(latex: str, width: int = WIDTH) -> list[str]:
    """Return the lines of `in_lines`, for the caller's own environment."""
    if len(latex) > LONGEST or "\\begin" in latex or formula_width(latex) <= width:
        return [latex]
    tokens = _TOKEN.findall(latex)
    steps = [bool(bare == "{" or _OPENS.match(bare)) - bool(bare == "}" or _CLOSES.match(bare)) for bare in map(str.strip, tokens)]
    if max(accumulate(steps), default=0) > DEEPEST:
        return [latex]
    return _rows(_pieces(iter(tokens))[0], width)


def formula_width(latex: str) -> float:
    """Return the estimated width of a formula in letters: a letter one, an exponent or an index two thirds."""
    total, scale, raised, next_raised = 0.0, [1.0], 1.0, False
    for token in map(str.strip, _TOKEN.findall(latex)):
        if not token:
            continue
        if token in ("^", "_"):
            next_raised = True
            continue
        raised = scale[-1] * (2 / 3 if next_raised else 1)
        next_raised = False
        if token == "{":
            scale.append(raised)
        elif token == "}":
            scale = scale[:-1] or [1.0]
        elif token in _NO_WIDTH or token in _ACCENTS and token not in _WORDS:
            continue
        else:
            total += raised * (_WORDS.get(token, 2) if token in _RELATIONS or token in _WORDS else 2 if token in _SIGNS else 1)
    return total


# ---------------------------------------------------------------------- reading
def _pieces(tokens: Iterator[str]) -> tuple[list[_Piece], str]:
    """Return the pieces up to the bracket that closes them, and that bracket."""
    made: list[_Piece] = []
    script = False  # the next token belongs to the previous piece: an exponent, an index
    for token in tokens:
        bare = token.strip()
        if not bare:
            _add(made, token)
        elif bare in ("^", "_"):
            _add(made, bare)
            script = True
        elif script or bare == "'":
            _add(made, "{" + _group(tokens) if bare == "{" else token)
            script = False
        elif _CLOSES.match(bare):
            return made, token
        elif _OPENS.match(bare):
            made.append(_bracket(token, tokens))
        elif bare == "{":
            made.append(_braced(tokens))
        elif bare in _RELATIONS:
            made.append(_Piece("relation", token))
        elif bare in _SIGNS:
            made.append(_Piece("sign" if made and made[-1].kind == "factor" else "prefix", token))
        elif bare == ",":
            made.append(_Piece("comma", token))
        elif bare in _PREFIXES:
            made.append(_Piece("prefix", token))
        else:
            made.append(_Piece("factor", token))
    return made, ""


def _add(made: list[_Piece], text: str) -> None:
    """Attach a text to the piece before it."""
    if not made:
        made.append(_Piece("factor", ""))
    made[-1].text += text
    if made[-1].inside:
        made[-1].after += text


def _group(tokens: Iterator[str]) -> str:
    """Return the text of a group in braces, with its end."""
    text, depth = "", 1
    for token in tokens:
        text += token
        depth += {"{": 1, "}": -1}.get(token, 0)
        if not depth:
            break
    return text


def _bracket(opening: str, tokens: Iterator[str]) -> _Piece:
    inside, closing = _pieces(tokens)
    text = opening + "".join(p.text for p in inside) + closing
    return _Piece("factor", text, opening, inside, closing)


def _braced(tokens: Iterator[str]) -> _Piece:
    """Return a group in braces; if it is one bracket, its contents may be broken."""
    whole = _group(tokens)
    inner = _pieces(iter(_TOKEN.findall(whole[:-1])))[0] if whole.endswith("}") else []
    if len(inner) == 1 and inner[0].inside:
        one = inner[0]
        return _Piece("factor", "{" + whole, "{" + one.before, one.inside, one.after + "}")
    return _Piece("factor", "{" + whole)


# ---------------------------------------------------------------------- breaking
def aligned(rows: list[str]) -> str:
    """Return the lines as one environment, flush left."""
    return "\\begin{aligned}& " + "\\\\\n& ".join(re.sub(r"(?<!\\)\s+$", "", row) for row in rows) + "\\end{aligned}"


def _rows(pieces: list[_Piece], width: float) -> list[str]:
    """Return the lines of a formula: each relation begins one, and parts between them that are too long continue indented."""
    rows: list[str] = []
    for clause in _split(pieces, "relation", "comma"):
        if _width(clause) <= width:
            rows.append(_begun(clause))
            continue
        for i, line in enumerate(_filled(_split(clause, "sign"), width)):
            rows.append(("\\quad " if i else "") + line)
    return rows


def _filled(terms: list[list[_Piece]], width: float) -> list[str]:
    """Return the lines of a sum, as many terms per line as fit; a term that is too long is broken between its factors."""
    lines: list[str] = []
    room = 0.0
    for term in terms:
        size = _width(term)
        if lines and size <= room:
            lines[-1] += _text(term)
            room -= size
        elif size <= width or len(terms) == 1 and len(term) == 1 and not term[0].inside:
            lines.append(_begun(term))
            room = width - size
        else:
            lines += _factors(term, width)
            room = 0.0
    return lines


def _factors(term: list[_Piece], width: float) -> list[str]:
    """Return the lines of a product; a bracket that is too long for one line is broken inside."""
    lines: list[str] = []
    room = 0.0
    for unit in _units(term):
        size, text = _width(unit), _text(unit)
        *prefixes, bracket = unit
        room_inside = max(width - 6, 12)
        if size > width and _width(bracket.inside) > room_inside:
            text = _text(prefixes) + bracket.before + aligned(_rows(bracket.inside, room_inside)) + bracket.after
            size = width
        if lines and size <= room:
            lines[-1] += text
            room -= size
        else:
            lines.append(("\\quad " if lines else "") + ("{}" if unit[0].kind in ("sign", "relation") else "") + text)
            room = width - size
    return lines


def _units(term: list[_Piece]) -> list[list[_Piece]]:
    """Return factors with the signs and prefixes before them."""
    units: list[list[_Piece]] = []
    waiting = False
    for piece in term:
        if waiting:
            units[-1].append(piece)
        else:
            units.append([piece])
        waiting = piece.kind != "factor"
    return units


def _split(pieces: list[_Piece], *kinds: str) -> list[list[_Piece]]:
    """Return parts that begin with a piece of these kinds; a comma ends a part."""
    parts: list[list[_Piece]] = [[]]
    for piece in pieces:
        if piece.kind in kinds and piece.kind != "comma" and parts[-1]:
            parts.append([])
        parts[-1].append(piece)
        if piece.kind == "comma" and piece.kind in kinds:
            parts.append([])
    return [part for part in parts if part]


def _begun(pieces: list[_Piece]) -> str:
    """Return a line that may begin with a sign or a relation: set as one between two operands."""
    return ("{}" if pieces[0].kind in ("sign", "relation") else "") + _text(pieces)


def _text(pieces: list[_Piece]) -> str:
    return "".join(piece.text for piece in pieces)


def _width(pieces: list[_Piece]) -> float:
    return sum(piece.width for piece in pieces)
