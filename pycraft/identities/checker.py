"""Theorems checked numerically: every one on one model (`soa.check`), or a user's own statement (`pycraft.check`)."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Any

import numpy as np

from .. import _core
from ..arguments import whole
from ..operators.operator_set import OperatorSet
from ..progress_bar import StepProgress
from .block_check import check_by_block
from .block_reading import says_by_block
from .dialects import in_dialect
from .drawn_vectors import drawn_vectors
from .inequalities import judge_read
from .judge import FAILS, BoundState, Verdict, judge_states, ladder
from .on_loops import judged_on_loops, on_loops, said_of_loops
from .parse import Statement, Statements, check_has_space
from .report import UNDEFINED, CheckReport, Finding, Report
from .statement_text import statement_text, telling_of
from .vocabulary import is_operator


def check_model(operators: Any, *, states: int = 3, seed: int = 0, precision: str | int = "extended", progress: Any = True) -> Report:
    """Check every theorem on the model of `operators`, at the present state and at `states` random ones.

    A theorem holds if its residual falls with epsilon and is below a derived bound that decides (see `judge`): in a scalar wider than
    double, and in wider ones where that decides nothing, up to 100 digits. Outside its hypotheses it is evaluated all the same and
    reported as expected to fail, with how much and which hypothesis.

    Parameters
    ----------
    states : random states, drawn from `seed`
    precision : the first scalar beside double, "extended", "quad", 50 or 100 digits
    progress : True: a bar in a terminal or notebook if it takes more than a second; False: none; a function: called with each theorem's
        name
    """
    check_wider(precision)
    _check_seed(seed)
    if whole(states, "states") < 0:
        raise _core.EvaluationError(f"states is {states}: random states beside the present one, 0 or more")
    source = operators._source
    model = operators._model
    report = Report(source.name, dict(source.traits))
    begin = time.perf_counter()
    rng = np.random.default_rng(seed)
    drawn = [
        BoundState(operators, s)
        for s in ([None] if model is None else [_present(model), *(operators.random_state(rng) for _ in range(states))])
    ]
    theorems = operators.theorems()
    with StepProgress(len(theorems), "theorems", progress) as bar:
        for theorem in theorems:
            bar(theorem.name)
            report.findings.append(check_theorem(theorem, theorem.unmet(source), drawn, rng, precision))
    report.seconds = time.perf_counter() - begin
    return report


def _check_seed(seed: Any) -> None:
    if whole(seed, "seed") < 0:
        raise _core.EvaluationError(f"seed is {seed}: a whole number, 0 or more")


def check_wider(precision: str | int) -> None:
    """A residual must be seen to fall: double beside double shows nothing."""
    names = list(_core.epsilons())
    _core.wider(precision)  # raises where there is no such precision
    wide = names[names.index("double") + 1 :]
    if precision not in wide:
        raise _core.EvaluationError(f"precision {precision!r} is not wider than double, in which every residual is taken; name {wide}")


def _present(model: Any) -> Any:
    from ..state import State

    return State(np.array(model.q), np.array(model.v))


def check_theorem(
    theorem: _core.Theorem, unmet: list[str], states: list[BoundState], rng: np.random.Generator, precision: str | int = "extended"
) -> Finding:
    """One theorem at these states; `unmet` are those of its hypotheses that the model does not meet."""
    hypotheses = list(theorem.hypotheses)
    finding = Finding(theorem.name, theorem.group, theorem.text, theorem.latex, hypotheses, unmet, "waiting", note=theorem.waiting)
    if theorem.waiting:
        return finding
    begin = time.perf_counter()
    lhs, rhs = with_spaces(theorem.lhs, theorem.rhs)
    vectors = [drawn_vectors(rhs, rng, drawn_vectors(lhs, rng, {})) for _ in states]
    options: dict[str, Any] = dict(precisions=ladder(precision), on_one_path=theorem.on_one_path, at_most=theorem.at_most)
    try:
        found = judge_states(lhs, rhs, states, vectors, **options)
    except _core.SingularHingeError as error:
        finding.verdict, finding.note = UNDEFINED, str(error)
    except _core.SingularOperatorError as error:
        # Outside its hypotheses a theorem may ask for an inverse that is not there: one way to fail.
        finding.verdict, finding.note = "expected to fail" if unmet else UNDEFINED, str(error)
    else:
        finding.judged(found)
        if unmet:
            finding.verdict = {"fails": "expected to fail", "holds": "holds anyway"}.get(found.verdict, found.verdict)
    finding.seconds = time.perf_counter() - begin
    return finding


def with_spaces(lhs: Any, rhs: Any) -> tuple[Any, Any]:
    """An I on one side takes the other side's space."""
    if isinstance(lhs, _core.Operator) and isinstance(rhs, _core.Operator):
        check_has_space(lhs, rhs)
        if rhs.domain is None:
            rhs = rhs @ _core.identity(lhs.domain)
        if lhs.domain is None:
            lhs = lhs @ _core.identity(rhs.domain)
    return lhs, rhs


def _is_expression(side: Any) -> bool:
    return is_operator(side) or isinstance(side, _core.Scalar)


def check(
    statement: Any,
    model: Any = None,
    *,
    states: int = 20,
    seed: int = 0,
    search: bool = True,
    precision: str | int = "extended",
    budget: float = 5.0,
    dialect: str | None = None,
) -> CheckReport:
    """Check a statement numerically: on a model over many seeded states, or on random trees.

    Parameters
    ----------
    statement : str, or a pair (lhs, rhs) of expressions
        As text in Python's spelling, the book's (Unicode or ASCII) or LaTeX: ``"HψMψ*H* == D"``, ``"inv(psi) == inv(phi) + K*H"``. `MM`
        is the mass matrix HφMφ*H*, `N` the number of coordinates. Operators with bodies behind them make a statement by block,
        ``"Ω(i,j) = Υ(i)ψ(i,j), i above j"``: it is checked for every choice of bodies of which its relations hold. Letters of one's own
        stand before it, ``"A := I + HφK; MM + J = A D A*"``, and vectors, ``"x ∈ Θ; ..."``; those of the equations of motion
        (T, θ̈, 𝒞, α, f, z, ε, ν, ...) are known.
    model : Multibody, OperatorSet or None
        None: random trees that between them meet and break every standard hypothesis, deep and wide ones among them, moving and in
        gravity (text only; see `pycraft.truth` for where it is true and where not).
    states : how many states, drawn from `seed`
    search : when false, look for the standard hypotheses under which it is true, and for the smallest tree, hinge kinds and state that
        refute it; where no hypothesis saves it, for the smallest that meets all of them
    precision : the first scalar beside double in which residuals are taken, "extended", "quad", 50 or 100 digits. Where it does not decide,
        the wider ones are tried in turn: extended costs about twice a run in double, quad 20, 50 digits 60 and 100 digits 100 times.
        Numbers in the statement that are near each other, or near 0 or 1 (1e-40), ask for one that tells them apart.
    dialect : the school in whose letters the text is written: "Featherstone", "Khatib", "Mueller", "Park", "Saha" or "Wensing". The text
        may say so itself: ``"dialect Park; M = S^T G^T J G S"``.
    budget : CPU seconds for each part of that search: where it is true, and the smallest refutation. The report says where it ended one.

    Returns
    -------
    CheckReport
        True or false as a condition, with `.worst` and `.counterexample`. As a condition it raises UndecidedError where 100 digits do not
        tell.

    Notes
    -----
    Numbers are compared, at states that were drawn: a difference below the report's bound is not seen, unless the statement's own numbers
    say how small it may be. What holds at every state is shown by `pycraft.prove`.

    Examples
    --------
    >>> import pycraft as pc
    >>> bool(pc.check("HψMψ*H* == D", pc.chain(4)))
    True
    >>> bool(pc.check("phi == phi + 1e-40*phi", pc.chain(4)))
    False
    """
    from .search import named_vectors

    check_wider(precision)
    if whole(states, "states") < 1:
        raise _core.EvaluationError(f"states is {states}: a statement is checked at one state at least")
    _check_seed(seed)
    if isinstance(statement, (tuple, list)) and len(statement) == 2 and all(map(_is_expression, statement)):
        text = f"{statement[0].text()} == {statement[1].text()}"
    elif isinstance(statement, str):
        text = statement = in_dialect(statement, dialect)
    else:
        raise _core.EvaluationError(f"check takes a statement as text or a pair of expressions, not {statement!r:.80}")
    operators: Any = None if model is None else getattr(model, "soa", model)
    if model is not None and not isinstance(operators, OperatorSet):
        raise _core.EvaluationError(f"a statement is checked on a model or its operators (model.soa), not on {model!r:.80}")
    if isinstance(statement, str) and says_by_block(statement, [] if operators is None else [name for name, *_ in operators.V.blocks]):
        return check_by_block(statement, operators, states=states, seed=seed, precision=precision)
    if model is None:
        if not isinstance(statement, str):
            raise _core.EvaluationError("expressions belong to one model: give text to check a statement on random trees")
        if said_of_loops(text):
            return _check_on_loops(text, states, seed, precision)
        return _check_on_trees(text, states=states, seed=seed, search=search, precision=precision, budget=budget)
    if isinstance(statement, str):
        operators = on_loops(operators, statement)
        read = Statements(operators).read(statement, inequalities=True)
        if read.rhs is None:
            raise _core.EvaluationError(f"{statement!r} has one side; a statement is lhs == rhs")
    else:
        read = Statement(*with_spaces(*statement), text, "expressions")
    try:
        found = run(read, operators, states, seed, precision)
    except _core.SingularOperatorError as error:
        return _without_inverse(text, statement_text(read), operators, precision, error, named_vectors(read))
    report = CheckReport.of(text, found, [operators._source.name], read.understood if isinstance(statement, str) else "")
    if found.verdict == FAILS and search:
        known: dict[str, Any] = dict(traits=lambda: dict(operators._source.traits), vectors=named_vectors(read))
        _explain(report, statement_text(read), seed=seed, precision=precision, budget=budget, **known)
    return report


def _without_inverse(text: str, to_read: str, operators: Any, precision: str | int, error: Exception, vectors: Any) -> CheckReport:
    """The report of a statement with an inverse that does not exist here, if J > 0 is what it wants; else raises the error."""
    from .truth import TRUE, UNREAD, truth

    try:
        found = truth(to_read, smallest_case=False, precision=precision, vectors=vectors)
    except (_core.EvaluationError, _core.SpaceError, _core.ModelError):
        raise error from None
    if not found.needs_rotor_inertia:
        raise error
    report = CheckReport(text, UNDEFINED, 0.0, 0.0, 0, [operators._source.name])
    if all(c.verdict in (TRUE, UNREAD) for c in found):
        report.true_where = [frozenset({"J > 0"})]
    report.notes.append(f"{error}: it is said of models with rotor inertia at every hinge (hinge.rotor_inertia)")
    return report


def _check_on_trees(text: str, *, states: int, seed: int, search: bool, precision: str | int, budget: float) -> CheckReport:
    """A statement on the family of random trees, one state each: as many models as states are asked for, and one of each cell."""
    from .family import family
    from .search import Counterexample, judged, understood
    from .truth import depth_for

    whole, names, refuted = Verdict(), [], None
    passed_over: list[bool] = []
    with_rotors: list[bool] = []
    for spec in family(states, depth_for(text)):
        spec = replace(spec, seed=spec.seed + seed)
        found = judged(text, spec, 1, precision)
        if found is None:
            passed_over.append(spec.rotor_inertia)
            continue
        with_rotors.append(spec.rotor_inertia)
        names.append(str(spec))
        whole.judgements += found.judgements
        if found.verdict == FAILS and refuted is None:
            refuted = Counterexample(spec, found.shown.state, found.shown.decisive.residual)
    if not names:
        raise _core.EvaluationError(f"{text!r}: the inverses in it exist on none of the random trees")
    report = CheckReport.of(text, whole, names, understood(text))
    if passed_over and not any(passed_over) and all(with_rotors):
        report.notes.append("said where J > 0: on models without rotor inertia an inverse in it does not exist")
    if refuted is not None and search:
        _explain(report, text, seed=seed, precision=precision, budget=budget, found=refuted)
    return report


def _check_on_loops(text: str, states: int, seed: int, precision: str | int) -> CheckReport:
    """A statement about embedded loops, or rows of loops, on random models whose loops are closed."""
    found = list(judged_on_loops(text, states, seed, precision))
    whole, names = Verdict([judgement for _, judgement, _ in found]), [name for name, *_ in found]
    report = CheckReport.of(text, whole, [*dict.fromkeys(names)], found[0][2])
    if report.verdict == FAILS:
        report.notes.append(f"first refuted on {next(n for n, j in zip(names, whole.judgements, strict=True) if j.verdict == FAILS)}")
    return report


def _explain(report: CheckReport, text: str, **options: Any) -> None:
    """Under which hypotheses a false statement is true, and its most telling counterexample; nothing if it is of one model only."""
    from .truth import explained, saving

    try:
        found, report.counterexample = explained(text, **options)
    except (_core.EvaluationError, _core.SpaceError, _core.ModelError):
        report.notes.append("it cannot be read on random trees: no smaller counterexample was looked for")
    else:
        spent = f"after {options['budget']:g} s of CPU time (budget={options['budget']:g})"
        if found is None:
            report.untried = True
            report.notes.append(f"the search for hypotheses under which it is true ended {spent}: not all were tried")
        else:
            if found.partial:
                count = sum(cell.models for cell in found)
                report.notes.append(
                    f"every hypothesis was tried, on {count} models in all; the search ended {spent}, before the largest models"
                )
            report.true_where = saving(found, options.get("traits"))


def run(read: Statement, operators: Any, states: int, seed: int, precision: str | int) -> Verdict:
    """The verdict on a statement at random states of one model."""
    model = operators._model
    rng = np.random.default_rng(seed)
    drawn = [BoundState(operators, s) for s in ([None] if model is None else [operators.random_state(rng) for _ in range(states)])]
    vectors = [drawn_vectors(read.rhs, rng, drawn_vectors(read.lhs, rng, {})) for _ in drawn]
    options: dict[str, Any] = dict(precisions=ladder(precision), decides=telling_of(read))
    return Verdict([judge_read(read, at, values, **options) for at, values in zip(drawn, vectors, strict=True)])
