"""Traces: equations of operators hold inside a trace, at any rotation of its word or of its transpose.

tr X = tr blockdiag(X),    tr(blockdiag(X) B) = tr(X B) for B block diagonal,    tr(Υ B) = tr(Ω B).
"""

from __future__ import annotations

import functools
from collections.abc import Iterator

from .axioms import theory
from .blocks import diagonal_blocks
from .equations import Equation, Step, Use
from .local_rules import LocalRules
from .normal_form import Rule, weight
from .scalar_steps import ScalarStep, TraceUse, fact
from .scalar_words import rotations, space_of, trace_of, trace_word
from .words import NUMBER, ONE, Alphabet, Polynomial, Word, add_to, monomial, of_model, plain, split


class Traces:
    """An attempt's rules inside traces, and facts on a trace from its diagonal blocks."""

    def __init__(self, local: LocalRules):
        self.local, self.problem, self.alphabet = local, local.problem, local.alphabet
        # X⁻* = X⁻¹, by X⁻*: a trace equals its transpose's, so a rule for one of the two would never end
        self._symmetric = {
            letter: e
            for e in local.equations
            for (letter, *more) in e.lhs
            if not more and e.kind == "lemma" and e.rhs == monomial(self.alphabet.star(letter))
        }

    def turned(self, p: Polynomial) -> Step | None:
        """Write each trace by the first rotation of its word or its transpose with symmetric inverses without a star."""
        a, after, uses = self.alphabet, dict(p), []
        for word in [w for w in p if w[0] == "tr" and any(x in self._symmetric or a.star(x) in self._symmetric for x in w[1:])]:
            best, turned = min((tuple(a.star(x) if x in self._symmetric else x for x in w), w) for w in rotations(word[1:], self.alphabet))
            made, c = trace_word(best, a, ""), p[word]
            if made == word:
                continue
            space = space_of(turned, a)
            for i, letter in enumerate(turned):
                if letter in self._symmetric:
                    uses.append(TraceUse(c, best[:i], self._symmetric[letter], turned[i + 1 :], (letter,), True, space))
            after.pop(word)
            add_to(after, made, c)
        return ScalarStep(p, after, list(uses), a) if uses or after != p else None

    def inside(self, p: Polynomial) -> Step | None:
        """Apply one equation of operators in every trace where it fits."""
        fitting = {word: found for word in p if word[0] == "tr" and (found := min(self._places(word), key=lambda f: f[0], default=None))}
        if not fitting:
            return None
        group = min(found[0] for found in fitting.values())
        chosen = {word: found for word, found in fitting.items() if found[0] == group}
        after = {word: c for word, c in p.items() if word not in chosen}
        uses: list[Use] = []
        for word, (_, left, rule, right) in chosen.items():
            c = p[word]
            space = space_of(left + rule.word, self.alphabet)
            uses.append(TraceUse(c * rule.factor, left, rule.equation, right, rule.word, rule.factor > 0, space))
            for w, x in trace_of({left + w + right: x for w, x in rule.to}, self.alphabet, space).items():
                add_to(after, w, c * x)
        return ScalarStep(p, after, uses, self.alphabet)

    def _places(self, word: Word) -> Iterator[tuple[int, Word, Rule, Word]]:
        """Yield (rank, left, rule, right) of rules that fit a rotation of tr(word) or of its transpose."""
        if word[1].startswith("I["):
            return
        for turned in rotations(word[1:], self.alphabet):
            for rule in self.local.rules.beginning(turned[0]):
                if rule.word[0] in self._symmetric and len(rule.word) == 1:
                    continue
                if turned[: len(rule.word)] == rule.word and (rule.group < 0 or all(weight(w) < weight(rule.word) for w, _ in rule.to)):
                    yield rule.group, (), rule, turned[len(rule.word) :]

    # ------------------------------------------------------------------ equations between numbers
    def equations(self, word: Word) -> Iterator[Equation]:
        """Yield the known facts on this trace."""
        return self._dimension(word) if word[1].startswith("I[") else self._diagonal(word)

    def _dimension(self, word: Word) -> Iterator[Equation]:
        """tr I is the number of coordinates, if the statement belongs to one model."""
        source = self.problem.contexts[0][0] if self.problem.of_one_model and self.problem.contexts else None
        space = getattr(source, {"Θ": "Theta", "F": "F"}.get(word[1][2:-1], ""), None)
        if space is not None:
            yield fact(self.alphabet, word, {NUMBER: space.dimension}, "the coordinates of this model", lambda: True)

    def _diagonal(self, word: Word) -> Iterator[Equation]:
        a = self.alphabet
        for w in rotations(word[1:], self.alphabet):
            value = diagonal_blocks(w, a)
            if value != {w: ONE} and not any(a.letters[split(x)[0]].word for v in value for x in v):
                by = trace_of(value, a, space_of(w, a))
                note = "only diagonal blocks count, and the shapes of the letters determine them"
                yield fact(a, word, by, note, functools.partial(_has_diagonal, w, value, a))
        for w in rotations(word[1:], self.alphabet):
            name, mark = split(w[0])
            rest = w[1:]
            if mark not in ("", "*") or not _is_diagonal(rest, a):
                continue
            if plain(name) == "Υ":
                added = name[len("Υ") :]
                whole = tuple(of_model(x, added) for x in ("ψ*", "H*", "D⁻¹", "H", "ψ"))
                lemma = theory()("ψ* H* D⁻¹ H ψ = ψ* Υ + Υ ψ − Υ + ψ* S ψ")
                note, uses = "Υ = blockdiag(Ω), and with B block diagonal only these blocks count", [lemma]
            elif a.letters[name].word:
                whole, note, uses = a.letters[name].word, "with B block diagonal only diagonal blocks count", []
                whole = a.star_word(whole) if mark == "*" else whole
            else:
                continue
            by = trace_of({whole + rest: ONE}, a, space_of(w, a))
            yield fact(a, word, by, note, functools.partial(_is_diagonal, rest, a), uses=uses)


def _is_diagonal(word: Word, alphabet: Alphabet) -> bool:
    return not word or diagonal_blocks(word, alphabet) == {word: ONE}


def _has_diagonal(word: Word, value: Polynomial, alphabet: Alphabet) -> bool:
    return diagonal_blocks(word, alphabet) == value
