"""Diagonal blocks of words, by what is known of their letters.

A body's block row and column say where a letter leads on the tree: E_φ, E_ψ and K from a body to its children, φ and ψ to all outboard
bodies and the body itself (with I there), their transposes back. So the diagonal blocks of a word are known without a number: all of it,
where it leads from every body to itself alone, as ERE* does; nothing, where it never leads back, as φ̃R; the rest without φ and ψ, where
these are all that moves.
"""

from __future__ import annotations

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


def diagonal_blocks(word: Word, alphabet: Alphabet) -> Polynomial:
    """blockdiag(word), where the letters say what it is; else with a letter of its own for what they do not."""
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
    return {(*left, _own_letter(_join(inner), alphabet), *right): ONE}


def _closed(parts: list[tuple[Word, str]]) -> list[tuple[Word, str]]:
    """A step to the children, blocks, and the step back lead from every body to itself alone."""
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


def diagonal_part(p: Polynomial, alphabet: Alphabet) -> Polynomial:
    """The diagonal blocks of a polynomial."""
    total: Polynomial = {}
    for word, c in p.items():
        for w, x in diagonal_blocks(word, alphabet).items():
            add_to(total, w, c * x)
    return total
