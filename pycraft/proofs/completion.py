"""Completion: where two rules overlap on a word, it can be rewritten in two ways; if these differ, their equality is a new rule.

Only overlaps with a statement's own rules are examined: all overlaps of the rules of `normal_form` are resolved. The search is bounded in
rules and rewrites; each new rule is a lemma with its own proof.
"""

from __future__ import annotations

from collections.abc import Iterator

from .attempt import Attempt
from .axioms import theory
from .equations import Equation, Step, Use, numbered
from .normal_form import Budget, Rule, overlaps, weight
from .walk import GaveUp
from .words import ONE, Polynomial, Word, add_to, combine, ratio, split

RULES, LENGTH, REWRITES = 24, 14, 1500
"""Limits on added rules, length of their words, and rewrites."""


def complete(attempt: Attempt) -> int:
    """Add rules from overlaps of the attempt's own rules; return their number.

    Returns None if a new rule holds only letters of the table: the axioms do not imply it, so the presuppositions are inconsistent.
    """
    own = {id(e) for e in attempt.equations} | {id(e.transposed(attempt.alphabet)) for e in attempt.equations}
    queue = [rule for rule in attempt.rules.all() if id(rule.equation) in own]
    budget, added = Budget(REWRITES), 0
    while queue:
        for lemma, word in _new(attempt, queue.pop(0), budget):
            if added == RULES or budget.rewrites <= 0:
                return added
            if not attempt.setting.compliance and _on_base(lemma):
                return 0
            attempt.add(lemma, word, blocks=False)
            added += 1
            queue += [r for r in attempt.rules.all() if r.equation is lemma]
    return added


def _on_base(lemma: Equation) -> bool:
    """Return True if an equation holds only letters of the table."""
    return all(split(x)[0] in theory().alphabet.letters for w in [*lemma.lhs, *lemma.rhs] for x in w)


def _new(attempt: Attempt, rule: Rule, budget: Budget) -> Iterator[tuple[Equation, Word]]:
    """Yield the lemmas from the overlaps of a rule with all others."""
    for other in attempt.rules.all():
        for first, second in ((rule, other), (other, rule)):
            for k in overlaps(first.word, second.word):
                try:
                    found = _critical(attempt, first, second, k, budget)
                except GaveUp:
                    continue
                if found is not None:
                    yield found


def _critical(attempt: Attempt, first: Rule, second: Rule, k: int, budget: Budget) -> tuple[Equation, Word] | None:
    """Return the lemma of one overlap, with the word that it replaces; None if it is not new, or its word is too long."""
    a = attempt.alphabet
    whole = first.word + second.word[k:]
    sides = []
    for rule, left, right in ((first, (), second.word[k:]), (second, first.word[:-k], ())):
        p: Polynomial = {}
        for w, c in rule.to:
            add_to(p, left + w + right, c)
        step = Step({whole: ONE}, p, [Use(rule.factor, left, rule.equation, right, rule.word, rule.factor > 0)], a)
        form, steps = attempt.rules.reduce(p, a, budget)
        sides.append((form, [step, *steps]))
    (p, way), (q, other_way) = sides
    difference = combine((1, p), (-1, q))
    lead = max(difference, key=weight, default=())
    if not lead or len(lead) > LENGTH:
        return None
    chain = numbered([s.reversed() for s in reversed(way)] + other_way)
    note = f"two ways to write {a.word_text(whole)}"
    equal = Equation("lemma", f"{a.text(p)} = {a.text(q)}", p, q, steps=chain, note=note)
    c = difference[lead]
    rest = {w: ratio(-x, c) for w, x in difference.items() if w != lead}
    solve = Step({lead: ONE}, rest, [Use(ratio(1, c), (), equal, (), lead)], a)
    return Equation("lemma", f"{a.word_text(lead)} = {a.text(rest)}", {lead: ONE}, rest, steps=numbered([solve])), lead
