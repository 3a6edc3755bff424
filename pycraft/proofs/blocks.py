"""Diagonal blocks of words, from the shapes of their letters.

The block rows and columns of a letter determine where it leads on the tree: E_φ, E_ψ and K from a body to its children, φ and ψ to all
outboard bodies and the body itself (with I there), their transposes back. This determines the diagonal blocks of a word without evaluation:
all of the word, if it leads from every body only to itself, as ERE* does; zero, if it never leads back, as φ̃R; the word without φ and ψ, if
only these lead to other bodies.
"""

from __future__ import annotations

import math

from .words import ONE, Alphabet, Letter, Polynomial, Word, add_to, plain, split

_STEPS = {"E_φ", "E_ψ", "K"}


def moves(letter: str, alphabet: Alphabet) -> str:
    """diagonal, step, step*, down, down*, unit, unit*, siblings or full."""
    name, mark = split(letter)
    known = alphabet.letters.get(name)
    shape = known.shape if known is not None else "full"
    if shape in ("diagonal", "siblings", "full"):
        return shape if mark in ("", "*") or shape == "diagonal" else "full"
    if mark not in ("", "*"):
        return "full"
    if shape == "down" and known is not None and plain(name) in _STEPS:
        shape = "step"
    return shape + mark


def diagonal_blocks(word: Word, alphabet: Alphabet, chain: bool = False) -> Polynomial:
    """Return blockdiag(word) if the letters determine it, else with a new letter for the undetermined part.

    On a serial chain (`chain`), the distance that a letter leads decides: K*ψ̃*ΥK never leads back, K*ΥK always does.
    """
    parts: list[tuple[Word, str]] = [((letter,), moves(letter, alphabet)) for letter in word]
    parts = _closed(parts)
    head, tail = 0, len(parts)
    while head < tail and parts[head][1] == "diagonal":
        head += 1
    while tail > head and parts[tail - 1][1] == "diagonal":
        tail -= 1
    left, inner, right = _join(parts[:head]), parts[head:tail], _join(parts[tail:])
    if not inner:
        return {left + right: ONE}
    ways = [m for _, m in inner if m != "diagonal"]
    for star in ("", "*"):
        if all(m in ("step" + star, "down" + star, "unit" + star) for m in ways):
            if any(m != "unit" + star for m in ways):
                return {}
            return {left + _join([p for p in inner if p[1] == "diagonal"]) + right: ONE}
    if ways.count("siblings") == 1:
        at = ways.index("siblings")
        if all(m.endswith("*") for m in ways[:at]) and all(m in ("step", "down", "unit") for m in ways[at + 1 :]):
            return {}
    if chain and (found := _by_levels(inner)) is not None:
        return {left + w + right: c for w, c in found.items()}
    if (opened := _towards_the_base(inner, alphabet)) is not None:
        total: Polynomial = {}
        for w, c in opened.items():
            for v, x in diagonal_blocks(left + w + right, alphabet, chain).items():
                add_to(total, v, c * x)
        return total
    return {(*left, _own_letter(_join(inner), alphabet), *right): ONE}


def _by_levels(parts: list[tuple[Word, str]]) -> Polynomial | None:
    """Return diagonal blocks on a chain from the number of bodies that each letter leads outward; None if that does not decide."""
    low, high = 0.0, 0.0
    for _, way in parts:
        down, up = _LEVELS.get(way, (-math.inf, math.inf))
        low, high = low + down, high + up
    if low > 0 or high < 0:
        return {}
    if (low == 0 or high == 0) and not any(way in ("down", "down*") for _, way in parts):
        return {_join([p for p in parts if not p[1].startswith("unit")]): ONE}
    return None


_LEVELS = {
    **{"diagonal": (0, 0), "step": (1, 1), "step*": (-1, -1), "down": (1, math.inf), "down*": (-math.inf, -1)},
    **{"unit": (0, math.inf), "unit*": (-math.inf, 0)},
}


def _towards_the_base(parts: list[tuple[Word, str]], alphabet: Alphabet) -> Polynomial | None:
    """ψ*XK A, A leading down or nowhere, as ψ* blockdiag(E_ψ*XK) A, X block diagonal; and its transpose.

    ψ* = I + ψ*E_ψ*: XKA leads down, and of E_ψ*XK the blocks between siblings count for nothing between ψ* and A. The word begins with
    ψ*: of B*XKA, B* leading up, diagonal blocks may be left.
    """
    ways = [way for _, way in parts]
    steps = [i for i, way in enumerate(ways) if way != "diagonal"]
    if len(steps) < 2:
        return None
    j = steps[1]
    if ways[0] == "unit*" and ways[j] == "step" and {*ways[j + 1 :]} <= {"step", "down", "unit", "diagonal"}:
        inner, right = _join(parts[1 : j + 1]), _join(parts[j + 1 :])
        return {(*parts[0][0], *outer, _own_letter((*edge, *inner), alphabet), *right): c for outer, edge, c in _edge(parts[0][0], "*")}
    j = steps[-2]
    if ways[-1] == "unit" and ways[j] == "step*" and {*ways[:j]} <= {"step*", "down*", "unit*", "diagonal"}:
        left, inner = _join(parts[:j]), _join(parts[j:-1])
        return {(*left, _own_letter((*inner, *edge), alphabet), *outer, *parts[-1][0]): c for outer, edge, c in _edge(parts[-1][0], "")}
    return None


def _edge(letter: Word, star: str) -> list[tuple[Word, Word, int]]:
    """Return (H, K, ...) of the terms of E_ψ, or E_φ: the factors at its ends, the leading factor, and the sign."""
    name = letter[0].removesuffix("*")
    mark = name.removeprefix("ψ").removeprefix("φ")
    edge: list[tuple[Word, Word, int]] = [((), (f"E_φ{mark}{star}",), 1)]
    if name.startswith("ψ"):
        edge.append(((f"H{mark}{star}",), (f"K{mark}{star}",), -1))
    return edge


def _closed(parts: list[tuple[Word, str]]) -> list[tuple[Word, str]]:
    """Return True for a step to the children, blocks, and the step back: it leads from every body only to itself."""
    done: list[tuple[Word, str]] = []
    for part in parts:
        done.append(part)
        if part[1] != "step*":
            continue
        at = len(done) - 2
        while at >= 0 and done[at][1] == "diagonal":
            at -= 1
        if at >= 0 and done[at][1] == "step":
            done[at:] = [(_join(done[at:]), "diagonal")]
    return done


def _join(parts: list[tuple[Word, str]]) -> Word:
    return tuple(letter for word, _ in parts for letter in word)


def _own_letter(word: Word, alphabet: Alphabet) -> str:
    starred = alphabet.star_word(word)
    canonical = min(word, starred)
    name = f"⟨blockdiag({' '.join(canonical)})⟩"
    if name not in alphabet.letters:
        symmetric = word == starred
        text = f"blockdiag({alphabet.word_text(canonical)})"
        latex = f"\\operatorname{{blockdiag}}({' '.join(map(alphabet.letter_latex, canonical))})"
        alphabet.add(Letter(name, text, latex, symmetric, "diagonal", word=canonical))
    return name if word == canonical else alphabet.star(name)


def diagonal_part(p: Polynomial, alphabet: Alphabet, chain: bool = False) -> Polynomial:
    """The diagonal blocks of a polynomial; see `diagonal_blocks`."""
    total: Polynomial = {}
    for word, c in p.items():
        for w, x in diagonal_blocks(word, alphabet, chain).items():
            add_to(total, w, c * x)
    return total
