"""`prove`: one side of a statement derived from the other, from the definitions of the operators.

Both sides are brought to a normal form by rules that are axioms or proved from them (`axioms`), and one chain of steps leads from side to
side: first without hypotheses, then under relevant hypotheses, fewest first. Every step is checked by multiplying it out
(`equations`), independent of the search. If the normal forms differ, no proof was found, which does not refute the statement.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from .. import _core
from ..identities.checker import with_spaces
from ..identities.dialects import in_dialect
from ..identities.parse import Statement
from ..identities.vocabulary import is_number, is_operator
from . import mechanics, scalar_spelling
from .attempt import Attempt, Outcome
from .axioms import theory
from .cases import by_cases
from .completion import complete
from .definite import prove_inequality
from .derivation import DerivativeProblem
from .derivative import TIME, Formula, derivative
from .equations import Equation, Step, joined, numbered, opened
from .models_tried import example, examples, operators_of, operators_of_sources
from .nesting import within_reach
from .normal_form import Setting, generous
from .presuppositions import Void, inverses_used, presupposed
from .proof import Proof
from .reading import Assumption, assumptions, reading
from .values import Values
from .walk import GaveUp
from .words import ONE, Alphabet, Polynomial, Word, combine, inverted, plain, split, underived


@within_reach("prove")
def prove(
    lhs: Any,
    rhs: Any = None,
    model: Any = None,
    *,
    assume: Iterable[str] = (),
    define: Mapping[str, Any] | None = None,
    dialect: str | None = None,
) -> Proof:
    """Derive one side of a statement from the other, from the definitions of the operators.

    Parameters
    ----------
    lhs, rhs : expressions of one model; or a statement as text and, in the second place, its model
    model : Multibody or OperatorSet on which text is read and steps are evaluated. Text without a model is read on a small tree.
    assume : assumptions as text: equations of operators ("G X = 0", "C = C*"), "X > 0" (symmetric and positive definite,
        hence with an inverse), or hypotheses by name ("J = 0", "serial chain", ...). The proof's hypotheses include the ones it uses.
        "J > 0 or J = 0" is proved case by case.
    define : own letters for the text, by name: expressions, text of an expression, "Θ", "V" or "F" for a vector in that space, "Θ → V"
        for an unknown operator. They may also be written in the text, before the statement:
        `x ∈ Θ; C : Θ → Θ; A := I + HφK; statement`.
    dialect : notation of the text, see `pycraft.check`

    Returns
    -------
    Proof
        True if a derivation was found, with its steps, hypotheses, lemmas and residuals. Otherwise false, with both normal forms; this does
        not refute the statement: `pycraft.check` and `Proof.search_counterexample` examine it numerically.

    Raises
    ------
    ParseError, SpaceError
        The text is not a statement; the sides do not act between the same spaces.
    EvaluationError
        There is only one side.

    Notes
    -----
    Cost: milliseconds to a few tenths of a second, for any size of the model; no decision is numerical.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.proofs import prove
    >>> arm = pc.chain(3)
    >>> H, phi, psi, K, M, D, I = arm.soa("H phi psi K M D I")
    >>> MM, S = H @ phi @ M @ phi.T @ H.T, I - H @ psi @ K
    >>> proof = prove(MM.inv(), S.T @ D.inv() @ S)
    >>> bool(proof), proof.hypotheses
    (True, ['J = 0'])
    """
    texts = isinstance(lhs, str)
    if texts and isinstance(rhs, str):
        lhs, rhs = f"{lhs} == {rhs}", None
    if not texts and rhs is None:
        raise _core.EvaluationError("a statement has two sides: prove(lhs, rhs), or prove(text, model)")
    if texts and rhs is not None and model is None:
        model = rhs
    lhs = in_dialect(lhs, dialect) if texts else lhs
    if texts:
        read_on = reading(operators_of(model if model is not None else example()), define)
        read = read_on.statement(lhs)
        if read.rhs is None:
            raise _core.EvaluationError(f"{lhs!r} has only one side; write lhs == rhs")
    else:
        read = Statement(*_sides(lhs, rhs), "", "expressions")
        read_on = reading(operators_of(model) if model is not None else _letters_of(read), define)
    if read.relation != "=":
        return by_cases(assume, lambda case: prove_inequality(read, model, assumptions(read_on, case)))
    proof = by_cases(assume, lambda case: _prove(read, model, assumptions(read_on, case), read_on.unknown))
    if texts and not proof and not proof.note and _has_rates(read):  # a longer route with other rules
        longer = reading(read_on.operators, define, written_out=True)
        again = longer.statement(lhs)
        found = by_cases(assume, lambda case: _prove(again, model, assumptions(longer, case), longer.unknown))
        return found or proof
    return proof


def _has_rates(read: Statement) -> bool:
    """Return True if a statement has letters that are derivatives."""
    return any(isinstance(side, Formula) for side in (read.lhs, read.rhs))


@within_reach("prove")
def prove_derivative(expression: Any, rhs: Any, coordinate: int | str) -> Proof:
    """Derive ∂(expression)/∂θ_i = rhs from the product rule and ∂E_φ = E_φΔ_i.

    Parameters
    ----------
    expression : an operator expression
    rhs : an expression; it may hold `derivative(X, i)` of any operator X
    coordinate : the coordinate i, by number or name

    Returns
    -------
    Proof
        As from `prove`, with the hypotheses "constant H" and "single-DOF hinges" if a step uses them.

    Raises
    ------
    ModelError
        The coordinate does not exist.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.proofs import prove_derivative
    >>> soa = pc.chain(3).soa
    >>> bool(prove_derivative(soa.phi, soa.phi_tilde @ soa.Delta(1) @ soa.phi, 1))
    True
    """
    return prove(derivative(expression, coordinate), rhs)


# ---------------------------------------------------------------------- reading
def _sides(lhs: Any, rhs: Any) -> tuple[Any, Any]:
    """Return both sides with common spaces, which a 0 takes from the other side. Raises SpaceError if they differ."""
    sides = [lhs, rhs]
    for i, other in ((0, rhs), (1, lhs)):
        domain = other.domain if is_operator(other) else None
        if domain is not None and is_number(sides[i]) and sides[i] == 0:
            sides[i] = _core.zero(domain, other.codomain)
        elif domain is not None and isinstance(sides[i], _core.Operator) and sides[i].domain is None:
            sides[i] = sides[i] @ _core.identity(domain)
    if all(isinstance(s, _core.Operator) for s in sides):
        left, right = with_spaces(*sides)
        left - right  # raises if the spaces differ
        return sides[0], sides[1]
    spaces = [(s.domain, s.codomain) for s in sides if is_operator(s) and s.domain is not None]
    if len(spaces) == 2 and spaces[0] != spaces[1]:
        raise _core.SpaceError(f"{sides[0].text()} and {sides[1].text()} do not act between the same spaces")
    return sides[0], sides[1]


def _one_identity(side: Any) -> Any:
    """Return I for the product I I, which arises when an I is given its space."""
    if isinstance(side, _core.Operator) and side.kind == "product" and all(f.kind == "identity" for f in side.children):
        return _core.identity(side.domain)
    return side


# ---------------------------------------------------------------------- search
def _prove(read: Statement, model: Any, assumed: Sequence[Assumption] = (), unknown: Iterable[str] = ()) -> Proof:
    problem = DerivativeProblem()
    problem.unknown = {*unknown}
    read = Statement(_one_identity(read.lhs), _one_identity(read.rhs), read.text, read.reading)
    sides = [_core.scalar(side) if is_number(side) else side for side in (read.lhs, read.rhs)]
    read = Statement(sides[0], sides[1], read.text, read.reading)
    problem.scalars = all(isinstance(side, _core.Scalar) for side in sides)
    problem.of_one_model = read.reading == "expressions"
    expand = problem.expand if not problem.scalars else functools.partial(scalar_spelling.expand, problem)
    try:
        left, right = expand(read.lhs), expand(read.rhs)
    except Void as zero:
        return Proof.of_statement(read, problem, [], [], ({}, {}), str(zero))
    except GaveUp:
        return Proof.of_statement(read, problem, [], [], ({}, {}), "the statement is too large: too many words, inverses or nodes")
    p, q = problem.sides = [left.before, right.before]
    problem.numbers = not problem.scalars and all(
        space is not None and space.name == "R^1" for space in (read.lhs.domain, read.lhs.codomain)
    )
    nearest: tuple[Polynomial, Polynomial] | None = None
    own = operators_of(model) if model is not None else operators_of_sources(source for source, _ in problem.contexts)
    void = ""
    problem.assumed = [_assumed(problem, a) for a in assumed if a.lhs is not None]
    if impossible := _impossible(problem):
        return Proof.of_statement(read, problem, [left, right], [], (p, q), impossible)
    for attempt, outcome in _attempts(problem, p, q):
        if attempt is None or isinstance(outcome, Void):
            void = void or str(outcome)
            continue
        if not outcome.closed:
            nearest = nearest or (outcome.lhs, outcome.rhs)
            continue
        steps = joined(outcome.left, outcome.right, p, q, problem.alphabet) or []
        steps = _without_the_claim(steps, combine((1, p), (-1, q)), problem.alphabet)
        typed = ([left] if left.says_something else []), ([right.reversed()] if right.says_something else [])
        proof = Proof.of_statement(read, problem, [left, right], [*typed[0], *steps, *typed[1]], (outcome.lhs, outcome.rhs))
        proof.takes_for_granted(_presupposed(attempt, proof), problem.assumed)
        if impossible := proof.void_where(proof.hypotheses, own):
            void = void or impossible
            continue
        proof.verify_where_possible(own)
        if model is None and read.reading != "expressions":  # no model was given
            proof.unmet = []
        return proof
    return Proof.of_statement(read, problem, [left, right], [], nearest or (p, q), void)


def _assumed(problem: DerivativeProblem, a: Assumption) -> tuple[Equation, str]:
    """Return the hypothesis, and the letter that it declares symmetric and regular, if any."""
    if not a.regular:
        return Equation("hypothesis", a.text, problem.words(a.lhs), problem.words(a.rhs), hypothesis=a.text), ""
    ((letter,),) = problem.words(a.lhs.inv())
    name = split(letter)[0]
    return Equation("hypothesis", a.text, {(problem.alphabet.star(name),): ONE}, {(name,): ONE}, hypothesis=a.text), name


def _impossible(problem: DerivativeProblem) -> str:
    """Return an assumption on letters of the table that holds on no tried model; empty if all may hold."""
    table = theory().alphabet.letters
    for equation, _ in problem.assumed:
        words = [*equation.lhs, *equation.rhs]
        if not all(split(x)[0] in table for word in words for x in word):
            continue
        step = Step(equation.lhs, equation.rhs, [], problem.alphabet)
        models = [m for h in ([], ["J = 0"], ["serial chain", "J = 0"], ["single-DOF hinges", "constant H"]) for m in examples(h)]
        if not any(_holds(step, problem, m) for m in models):
            return f"the assumption {equation.text} holds on no model that was tried"
    return ""


def _holds(step: Step, problem: DerivativeProblem, model: Any) -> bool:
    try:
        return Values(problem.alphabet, model.soa, model.random_state(1)).residual(step) < ASSUMED
    except ArithmeticError:
        return True


ASSUMED = 1e-9
"""Relative error at which an assumption counts as met on a model: rounding of small models."""


def _without_the_claim(steps: list[Step], claim: Polynomial, alphabet: Alphabet) -> list[Step]:
    """Return the chain with every lemma equal to the claim expanded: a proof must not cite its claim."""
    said = [claim, alphabet.star_of(claim)]
    said += [combine((-1, p)) for p in said]
    made: list[Step] = []
    for step in steps:
        itself = next((e for e in step.equations if e.kind == "lemma" and e.difference in said), None)
        made += [step] if itself is None else opened(step, itself)
    return numbered(made)


def _presupposed(attempt: Attempt, proof: Proof) -> list[str]:
    """Return the letters whose inverses the statement or its proof presupposes."""
    stated = {split(x)[0] for p in attempt.problem.polynomials() for w in p for x in w if inverted(x)}
    return presupposed(stated | inverses_used(proof.rests_on), attempt.regular, attempt.needs)


GENEROUS, AGAIN = 6, 2
"""Factor of the size of final reductions, and the number of settings, among those that gave up, that are tried again."""


def _attempts(problem: DerivativeProblem, p: Polynomial, q: Polynomial) -> Iterator[tuple[Attempt | None, Outcome | Void]]:
    """Yield attempts under more and more hypotheses; again with completed rules; then with larger limits. Inverting zero raises Void."""
    made: list[Attempt] = []
    given_up: list[tuple[Setting, list[tuple[Equation, Word]]]] = []
    for setting, extra in _settings(problem):
        try:
            made.append(Attempt(problem, setting, extra))
            outcome = made[-1].run(p, q)
        except Void as void:
            yield None, void
            continue
        except GaveUp:
            given_up.append((setting, extra))
            continue
        if outcome.closed:  # larger limits may need fewer hypotheses
            weaker = [tried for tried in given_up if tried[0].hypotheses < setting.hypotheses]
            yield from _again(problem, weaker, p, q)
            given_up = [tried for tried in given_up if tried not in weaker]
        yield made[-1], outcome
    for attempt in made:
        try:
            if attempt.equations and complete(attempt):
                yield attempt, attempt.run(p, q)
        except GaveUp:
            continue
    yield from _again(problem, given_up, p, q)


def _again(problem: DerivativeProblem, settings: list[Any], p: Polynomial, q: Polynomial) -> Iterator[tuple[Attempt, Outcome]]:
    """Yield attempts with larger limits."""
    for setting, extra in settings[:AGAIN]:
        try:
            with generous(GENEROUS):
                larger = Attempt(problem, setting, extra)
                found = larger.run(p, q)
            yield larger, found
        except GaveUp:
            continue


def _settings(problem: DerivativeProblem) -> Iterator[tuple[Setting, list[tuple[Equation, Word]]]]:
    """Yield settings by the number of hypotheses, with the rules that they add."""
    rules, constant = problem.derivative_rules()
    letters = {x for p in problem.polynomials() for word in p for x in word}
    names = {underived(plain(x)) for x in letters}
    expressions = {n: known.expression for n, known in problem.alphabet.letters.items()}
    deltas = [n for n, e in expressions.items() if isinstance(e, _core.Operator) and e.name in ("Delta", "Delta_theta_dot")]
    regular = {name for _, name in problem.assumed if name}
    possible = ["J = 0"] * ("J⁻¹" not in letters and "J" not in regular) + ["serial chain"] * ("Υ" in names)
    if names & {"Ḣ", "a"} or TIME in problem.alphabet.along.values():
        constant.append((Equation("hypothesis", "Ḣ = 0", {("Ḣ",): ONE}, {}, hypothesis="constant H"), ("Ḣ",)))
    possible += ["single-DOF hinges"] * bool(deltas) + ["constant H"] * bool(constant)
    composite, velocities = (
        "R" in names or bool(problem.relations),
        bool(names & mechanics.NAMES) or TIME in problem.alphabet.along.values(),
    )
    for size in range(len(possible) + 1):
        for chosen in itertools.combinations(possible, size):
            extra = list(rules) + constant * ("constant H" in chosen)
            extra += [_no_delta(problem, n) for n in deltas if "single-DOF hinges" in chosen]
            extra += problem.single_axis_rules() if "single-DOF hinges" in chosen else []
            yield Setting(frozenset(chosen), composite, "serial chain" in chosen, velocities), extra


def _no_delta(problem: DerivativeProblem, name: str) -> tuple[Equation, Word]:
    """HΔ = 0 if Δ's body has a single axis: h*crf(h) = 0."""
    word = ("H", name)
    text = f"{problem.alphabet.word_text(word)} = 0"
    return Equation("hypothesis", text, {word: ONE}, {}, hypothesis="single-DOF hinges"), word


def _letters_of(read: Statement) -> Any:
    """Return the operators of the expressions' model."""
    sides = [side for side in (read.lhs, read.rhs) if is_operator(side)]
    return operators_of_sources(source for side in sides for source in side.sources) or example().soa
