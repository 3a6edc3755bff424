"""Traces, ln|det| and norms: numbers as sums of words, and the steps that bring them to a normal form.

A number is a polynomial whose words are ("tr", X, Y, ...), the trace of XY... up to rotation and transposition, ("ln det", X),
("norm", X) and ("1",), their reciprocals ("1/", ...) and products ("×", ..., ";", ...). What holds of operators holds inside a trace, at
any rotation; besides,

    tr X = tr blockdiag(X),    tr(blockdiag(X) B) = tr(X B) for B block diagonal,    tr(Υ B) = tr(Ω B),
    ln|det XY| = ln|det X| + ln|det Y| for square factors,    ln|det X*| = ln|det X|,    ln|det c I + strictly triangular| = n ln|c|,
    ln|det(ℳ + J)| = ln det D,  by ℳ + J = [I+HφK] D [I+HφK]*.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from .. import _core
from .axioms import theory
from .blocks import diagonal_blocks
from .equations import Equation, Step, Use, chain_holds
from .expand import Opaque, Problem, Spelling, exact, square
from .inverses import LocalRules
from .normal_form import WORDS, Rule, weight
from .presuppositions import Void, is_triangular
from .walk import GaveUp
from .words import (
    NUMBER,
    ONE,
    Alphabet,
    Number,
    Polynomial,
    Word,
    add_to,
    combine,
    factors_of,
    inverse_of,
    inverted,
    monomial,
    of_model,
    plain,
    ratio,
    split,
    times,
    underived,
)

STEPS = 200
"""Steps at which a reduction gives up."""
_KINDS = ("number", "trace", "logdet", "norm", "sum", "scaled", "product", "reciprocal")
_DUALS = {"F": "V", "V": "F", "NodesF": "NodesV", "NodesV": "NodesF"}
_SPACES_OF = {ascii: (domain, codomain) for ascii, _, _, domain, codomain, *_ in _core.symbol_table()} | {"S": ("F", "V")}


# ---------------------------------------------------------------------- words of numbers
def trace_word(word: Word, alphabet: Alphabet, space: str) -> Word:
    """tr(word), by the first of its rotations and those of its transpose; tr I by its space."""
    if not word:
        return ("tr", f"I[{min(space, _DUALS.get(space, space))}]")
    turned = [w[i:] + w[:i] for w in (word, alphabet.star_word(word)) for i in range(len(w))]
    return ("tr", *min(turned))


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
    """The space that a word's values lie in."""
    name, mark = split(word[0])
    known = alphabet.letters[underived(name)]
    if known.word:
        return space_of(alphabet.star_word(known.word) if mark == "*" else known.word, alphabet)
    if getattr(known.expression, "domain", None) is not None:
        domain, codomain = known.expression.domain.name, known.expression.codomain.name
    else:
        domain, codomain = _SPACES_OF[known.ascii or known.name]
    return {"": codomain, "⁻¹": domain, "*": _DUALS.get(domain, domain), "⁻*": _DUALS.get(codomain, codomain)}[mark]


@dataclass
class TraceUse(Use):
    """c tr(left (lhs - rhs) right) of one equation; `space` is that of what the factors lead to."""

    space: str = ""

    def difference(self, alphabet: Alphabet) -> Polynomial:
        words = {self.left + w + self.right: c for w, c in self.equation.difference.items()}
        return trace_of(words, alphabet, self.space)


@dataclass
class ProductUse(Use):
    """c · others · (lhs - rhs) of one equation between numbers."""

    others: Word = NUMBER

    def difference(self) -> Polynomial:
        return product_of(self.equation.difference, {self.others: ONE})


class ScalarStep(Step):
    """A step between numbers: before - after is a sum of traces of equations and of equations between numbers, multiplied out exactly."""

    def holds(self) -> bool:
        left = combine((1, self.before), (-1, self.after))
        for use in self.uses:
            if isinstance(use, TraceUse):
                difference = use.difference(self.alphabet)
            else:
                difference = use.difference() if isinstance(use, ProductUse) else use.equation.difference
            for word, c in difference.items():
                add_to(left, word, -use.coefficient * c)
        return not left

    def reversed(self) -> Step:
        uses = [_negative(use) for use in self.uses]
        return ScalarStep(self.after, self.before, uses, self.alphabet, self.title)


def _negative(use: Use) -> Use:
    made: Any = type(use)
    more: dict[str, Any] = {}
    if isinstance(use, TraceUse):
        more = {"space": use.space}
    elif isinstance(use, ProductUse):
        more = {"others": use.others}
    return made(-use.coefficient, use.left, use.equation, use.right, use.word, not use.forward, **more)


class ScalarSpelling(Spelling):
    """The step from a scalar expression as it was typed to words."""

    def holds(self) -> bool:
        return scalar_words(self.problem, self.expression) == self.before

    def reversed(self) -> ScalarSpelling:
        return ScalarSpelling(self.problem, self.expression, self.before, self.definitions, not self.backwards)


def expand(problem: Problem, e: Any) -> ScalarSpelling:
    """A scalar expression in words, as the step that says so. Raises GaveUp."""
    problem._used = []
    p = scalar_words(problem, e)
    return ScalarSpelling(problem, e, p, list(dict.fromkeys(problem._used)))


def scalar_words(problem: Problem, e: Any) -> Polynomial:
    """The words of a scalar expression."""
    kind, value, operand, parts = e._parts()
    match _KINDS[kind] if kind < len(_KINDS) else "":
        case "number":
            return {NUMBER: exact(value)} if value else {}
        case "sum":
            return combine(*((1, scalar_words(problem, part)) for part in parts))
        case "scaled":
            return {w: exact(value) * c for w, c in scalar_words(problem, parts[0]).items()}
        case "product":
            return functools.reduce(product_of, (scalar_words(problem, part) for part in parts))
        case "reciprocal":
            p = scalar_words(problem, parts[0])
            if not p:
                raise Void(f"1/({parts[0].text()}) is a reciprocal of zero")
            return reciprocal_of(p) or {("1/", f"⟨{problem.alphabet.text(p)}⟩"): ONE}
        case "trace":
            return trace_of(problem.words(operand), problem.alphabet, operand.codomain.name)
        case "logdet":
            return _log_determinant(problem, operand)
        case "norm":
            return {("norm", problem.operand(operand)): ONE}
    raise GaveUp


def _log_determinant(problem: Problem, e: Any) -> Polynomial:
    """ln|det| of products by their factors, of inverses and transposes by what they are of."""
    match e.kind:
        case "identity":
            return {}
        case "transpose":
            return _log_determinant(problem, e.children[0])
        case "inverse":
            return combine((-1, _log_determinant(problem, e.children[0])))
        case "scaled" if e.coefficient:
            size = abs(exact(e.coefficient))
            space = trace_word((), problem.alphabet, e.codomain.name)[1]
            more = monomial("ln", str(size), space) if size != 1 else {}
            return combine((1, _log_determinant(problem, e.children[0])), (1, more))
        case "product" if all(map(square, e.children)):
            return combine(*((1, _log_determinant(problem, f)) for f in e.children))
        case "sqrt":
            return {w: ratio(c, 2) for w, c in _log_determinant(problem, e.children[0]).items()}
    name = problem.operand(e)
    problem.determinants.add(name)
    return {("ln det", name): ONE}


# ---------------------------------------------------------------------- the normal form
@dataclass
class ScalarRules:
    """What brings numbers to a normal form: an attempt's rules inside traces; what is known of diagonal blocks and determinants."""

    local: LocalRules

    def __post_init__(self) -> None:
        self.problem, self.alphabet = self.local.problem, self.local.alphabet
        # X⁻* = X⁻¹, by X⁻*: inside a trace, which is that of its transpose, no rule for one of the two would end
        self._symmetric = {
            letter: e
            for e in self.local.local
            for (letter, *more) in e.lhs
            if not more and e.kind == "lemma" and e.rhs == monomial(self.alphabet.star(letter))
        }
        self._forms: list[tuple[str, str, Polynomial, Polynomial, list[Step]]] = []
        self._reduced: dict[Word, tuple[Polynomial, list[Step]]] = {}

    def reduce(self, p: Polynomial) -> tuple[Polynomial, list[Step]]:
        """(the normal form, the steps to it). Raises GaveUp."""
        steps: list[Step] = []
        while (step := self._turned(p) or self._inside(p) or self._between(p) or self._factors_reduced(p)) is not None:
            steps.append(step)
            p = step.after
            if len(steps) > STEPS:
                raise GaveUp
        return p, steps

    # ------------------------------------------------------------------ products
    def _factors_reduced(self, p: Polynomial) -> Step | None:
        """One factor of products by its normal form, wherever it stands; a reciprocal by that of what it is of."""
        for factor in sorted({f for word in p if word[0] in ("×", "1/") for f in factors_of(word)}):
            inverse = factor[0] == "1/"
            inner = factor[1:] if inverse else factor
            if inverse and inner[0].startswith("⟨"):
                continue
            if inner not in self._reduced:
                self._reduced[inner] = self.reduce({inner: ONE})
            form, steps = self._reduced[inner]
            if form == {inner: ONE}:
                continue
            if inverse and not form:
                raise Void(f"1/({self.alphabet.word_text(inner)}) is a reciprocal of zero")
            by = reciprocal_of(form) if inverse else form
            if by is None:
                continue
            note = "a factor, reduced by itself"
            equation = self._fact(factor, by, note, functools.partial(_factor_holds, factor, inner, by, form, steps), steps)
            after, uses = dict(p), []
            for word, c in p.items():
                every = factors_of(word)
                if factor in every:
                    every.remove(factor)
                    use = ProductUse(c, (), equation, (), factor, others=product_word(every))
                    uses.append(use)
                    after = combine((1, after), (-c, use.difference()))
            return ScalarStep(p, after, list(uses), self.alphabet)
        return None

    # ------------------------------------------------------------------ inside a trace
    def _turned(self, p: Polynomial) -> Step | None:
        """Each trace by the first of its rotations and its transpose's in which symmetric inverses are written without a star."""
        a, after, uses = self.alphabet, dict(p), []
        for word in [w for w in p if w[0] == "tr" and any(x in self._symmetric or a.star(x) in self._symmetric for x in w[1:])]:
            best, turned = min((tuple(a.star(x) if x in self._symmetric else x for x in w), w) for w in self._rotations(word))
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

    def _inside(self, p: Polynomial) -> Step | None:
        """One equation of operators, in every trace where it fits."""
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
        """(rank, left, rule, right) of what fits in a rotation of tr(word) or of its transpose."""
        if word[1].startswith("I["):
            return
        for turned in self._rotations(word):
            for rule in self.local.rules.beginning(turned[0]):
                if rule.word[0] in self._symmetric and len(rule.word) == 1:
                    continue
                if turned[: len(rule.word)] == rule.word and (rule.group < 0 or all(weight(w) < weight(rule.word) for w, _ in rule.to)):
                    yield rule.group, (), rule, turned[len(rule.word) :]

    def _rotations(self, word: Word) -> Iterator[Word]:
        for w in (word[1:], self.alphabet.star_word(word[1:])):
            yield from (w[i:] + w[:i] for i in range(len(w)))

    # ------------------------------------------------------------------ equations between numbers
    def _between(self, p: Polynomial) -> Step | None:
        """One equation between numbers, for one of the words."""
        for word in p:
            for equation in self._equations(word):
                after = combine((1, p), (-p[word], equation.difference))
                return ScalarStep(p, after, [Use(p[word], (), equation, (), word)], self.alphabet)
        return None

    def _equations(self, word: Word) -> Iterator[Equation]:
        if word[0] == "tr":
            yield from self._dimension(word) if word[1].startswith("I[") else self._diagonal(word)
        elif word[0] == "ln det":
            yield from self._determinant(word)
        elif word[0] == "norm":
            yield from self._same("norm", word[1])

    def _fact(
        self, word: Word, by: Polynomial, note: str, check: Callable[[], bool], steps: Sequence[Step] = (), uses: Sequence[Equation] = ()
    ) -> Equation:
        text = f"{self.alphabet.word_text(word)} = {self.alphabet.text(by)}"
        made = Equation("structure", text, {word: ONE}, by, steps=list(steps), uses=list(uses), note=note)
        made.check = check
        return made

    def _dimension(self, word: Word) -> Iterator[Equation]:
        """tr I is the number of coordinates, where the statement is one of a model."""
        source = self.problem.contexts[0][0] if self.problem.of_one_model and self.problem.contexts else None
        space = getattr(source, {"Θ": "Theta", "F": "F"}.get(word[1][2:-1], ""), None)
        if space is not None:
            yield self._fact(word, {NUMBER: space.dimension}, "the coordinates of this model", lambda: True)

    def _diagonal(self, word: Word) -> Iterator[Equation]:
        a = self.alphabet
        for w in self._rotations(word):
            value = diagonal_blocks(w, a)
            if value != {w: ONE} and not any(a.letters[split(x)[0]].word for v in value for x in v):
                by = trace_of(value, a, space_of(w, a))
                yield self._fact(
                    word,
                    by,
                    "only diagonal blocks count, and the letters say which there are",
                    functools.partial(_has_diagonal, w, value, a),
                )
        for w in self._rotations(word):
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
            yield self._fact(word, by, note, functools.partial(_is_diagonal, rest, a), uses=uses)

    def _determinant(self, word: Word) -> Iterator[Equation]:
        """ln|det| of what is triangular, of a product, of ℳ + J; else of the first operand that is equal to it."""
        a, name = self.alphabet, word[1]
        opaque = next((o for o in self.problem.opaque if o.name == name), None)
        inner: Polynomial = {(name,): ONE} if opaque is None else opaque.inner
        form, steps = self.local.reduce(inner)
        space = trace_word((), a, self._space(name))[1]
        for q, way in ((inner, []), (form, steps)):
            if is_triangular(q, a):
                c = abs(sum(c for w, c in q.items() if is_triangular({w: ONE}, a)))
                by: Polynomial = {("ln", str(c), space): ONE} if c != 1 else {}
                yield self._fact(
                    word,
                    by,
                    "the determinant of a triangular operator is that of its diagonal",
                    functools.partial(_is_triangular, inner, q, way, a),
                    way,
                )
            if len(q) == 1:
                ((letters, c),) = q.items()
                if (len(letters) > 1 or letters != (name,)) and all(self._is_square(x) for x in letters):
                    by = {("ln", str(abs(c)), space): ONE} if abs(c) != 1 else {}
                    for x in letters:
                        add_to(by, ("ln det", split(x)[0]), -ONE if inverted(x) else ONE)
                    yield self._fact(
                        word, by, "the determinant of a product of square factors", functools.partial(chain_holds, way, inner, q), way
                    )
        yield from self._partitioned(word, inner)
        found = self.local.factored(name, form, opaque.definition) if opaque is not None and form else None
        if found is not None:
            product, factor, mark, c = found
            by = {("ln det", factor.name): 2 * ONE, ("ln det", of_model("D", mark)): ONE}
            by |= {("ln", str(abs(c)), space): ONE} if abs(c) != 1 else {}
            yield self._fact(word, by, "the determinant of a product of square factors", product.holds, uses=[product])
        for factor in filter(None, self.local._factors.values()):
            if factor.name == name:
                words = factor.definition.rhs
                note = "the determinant of a triangular operator is that of its diagonal"
                yield self._fact(word, {}, note, functools.partial(is_triangular, words, a), uses=[factor.definition])
        yield from self._same("ln det", name)

    def _partitioned(self, word: Word, inner: Polynomial) -> Iterator[Equation]:
        """ln|det H X H*| by two sets of hinges that are all of them together: that of one set's block and of its Schur complement."""
        for first, second, base in self._halves():
            H, H_star = of_model("H", base), of_model("H*", base)
            if not inner or any(len(w) < 2 or w[0] != H or w[-1] != H_star for w in inner):
                continue
            rows = {mark: (of_model("H", mark), of_model("H*", mark)) for mark in (first, second)}
            block = lambda i, j, r=rows: {(r[i][0], *w[1:-1], r[j][1]): c for w, c in inner.items()}
            form = self.local.reduce(block(first, first))[0]
            inverted_by = [o for o in self.problem.opaque if o.kind == "inverse" and self.local.reduce(o.inner)[0] == form]
            blocks = [o for o in self.problem.opaque if o.kind == "operand" and self.local.reduce(o.inner)[0] == form]
            for z in inverted_by[:1] if blocks else ():
                coupling = times(times(block(second, first), monomial(inverse_of(z.name))), block(first, second))
                schur = self.local.reduce(combine((1, block(second, second)), (-1, coupling)))[0]
                for o in self.problem.opaque:
                    if o.kind == "operand" and self.local.reduce(o.inner)[0] == schur:
                        by = monomial("ln det", blocks[0].name) | monomial("ln det", o.name)
                        uses = [z.definition, o.definition, blocks[0].definition]
                        premises = [theory()("J = 0")] if "J = 0" in self.local.setting.hypotheses else []
                        note = "the determinant of a partitioned operator: of one block, and of the other's Schur complement"
                        complement = combine((1, block(second, second)), (-1, coupling))
                        parts = [(block(first, first), z), (block(first, first), blocks[0]), (complement, o)]
                        yield self._fact(word, by, note, functools.partial(self._equal, parts), uses=[*uses, *premises])

    def _equal(self, pairs: Sequence[tuple[Polynomial, Opaque]]) -> bool:
        """Whether operands have the normal forms of these words."""
        return all(self.local.reduce(p)[0] == self.local.reduce(o.inner)[0] for p, o in pairs)

    def _halves(self) -> Iterator[tuple[str, str, str]]:
        """(mark, mark, the mark of their model) of two trees with hinges locked, each hinge in one of them."""
        names = {mark: source.coordinate_names for mark, (source, _) in zip(self.problem.marks, self.problem.contexts, strict=False)}
        for first, base in self.local.locked:
            for second, other in self.local.locked:
                if base == other and sorted([*names[first], *names[second]]) == sorted(names.get(base, [])):
                    yield first, second, base

    def _is_square(self, letter: str) -> bool:
        e = self.alphabet.letters[split(letter)[0]].expression
        return plain(letter) in ("φ", "ψ", "D", "M", "P", "R", "J", "Υ", "X") or e is not None and hasattr(e, "kind") and square(e)

    def _space(self, name: str) -> str:
        return space_of((name,), self.alphabet)

    def _same(self, kind: str, name: str) -> Iterator[Equation]:
        """The number of an operand by that of an earlier one that is equal to it, up to the sign or the star."""
        a = self.alphabet
        inner: Polynomial = next((o.inner for o in self.problem.opaque if o.name == name), {(name,): ONE})
        form, steps = self.local.reduce(inner)
        if kind == "norm" and not form:
            yield self._fact((kind, name), {}, "the norm of zero", lambda: chain_holds(steps, inner, {}), steps)
        for its_kind, other, its_inner, its_form, its_steps in self._forms:
            if its_kind != kind or other == name:
                continue
            for p in (its_form, a.star_of(its_form)):
                if form and p and p.keys() == form.keys():
                    check = lambda i=its_inner, f=its_form, s=its_steps: chain_holds(steps, inner, form) and chain_holds(s, i, f)
                    ratios: set[Number] = {ratio(c, p[w]) for w, c in form.items()}
                    size = max(c if c > 0 else -c for c in ratios)
                    if len(ratios) == 1 and (kind == "norm" or size == 1):
                        yield self._fact(
                            (kind, name),
                            monomial(kind, other, c=size),
                            "operators that are equal up to a factor and a star",
                            check,
                            [*steps, *its_steps],
                        )
                        return
        if (kind, name) not in [(k, n) for k, n, *_ in self._forms]:
            self._forms.append((kind, name, inner, form, steps))


def _factor_holds(factor: Word, inner: Word, by: Polynomial, form: Polynomial, steps: Sequence[Step]) -> bool:
    """Whether a factor is what it is said to be: its steps lead there; of a reciprocal, those of what it is of."""
    wanted = form if factor == inner else reciprocal_of(form)
    return by == wanted and chain_holds(steps, {inner: ONE}, form)


def _is_diagonal(word: Word, alphabet: Alphabet) -> bool:
    return not word or diagonal_blocks(word, alphabet) == {word: ONE}


def _has_diagonal(word: Word, value: Polynomial, alphabet: Alphabet) -> bool:
    return diagonal_blocks(word, alphabet) == value


def _is_triangular(inner: Polynomial, form: Polynomial, steps: Sequence[Step], alphabet: Alphabet) -> bool:
    return is_triangular(form, alphabet) and chain_holds(steps, inner, form)
