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
    """Check every theorem on the model of `operators`, at the present state and at `states` random states.

    A theorem holds if its residual falls with epsilon and is below a derived, decisive bound (see `judge`): in a scalar wider than
    double, and in still wider ones if that is not decisive, up to 100 digits. Outside its hypotheses a theorem is also evaluated, and
    reported as expected to fail, with its residual and the violated hypothesis.

    Parameters
    ----------
    states : number of random states, drawn from `seed`
    precision : the first scalar after double, "extended", "quad", 50 or 100 digits
    progress : True shows a bar in a terminal or notebook after a second; False shows none; a function is called with each theorem's
        name
    """
    check_wider(precision)
    _check_seed(seed)
    if whole(states, "states") < 0:
        raise _core.EvaluationError(f"states={states}: give the number of random states besides the present one, 0 or more")
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
        raise _core.EvaluationError(f"seed={seed}: give a whole number, 0 or more")


def check_wider(precision: str | int) -> None:
    """Check that the precision is wider than double: otherwise a residual cannot be seen to fall."""
    names = list(_core.epsilons())
    _core.wider(precision)  # raises for an unknown precision
    wide = names[names.index("double") + 1 :]
    if precision not in wide:
        raise _core.EvaluationError(f"precision {precision!r} is not wider than double, the first scalar of every residual; choose {wide}")


def _present(model: Any) -> Any:
    from ..state import State

    return State(np.array(model.q), np.array(model.v))


def check_theorem(
    theorem: _core.Theorem, unmet: list[str], states: list[BoundState], rng: np.random.Generator, precision: str | int = "extended"
) -> Finding:
    """Check one theorem at these states; `unmet` are its hypotheses that the model does not meet."""
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
        # Outside its hypotheses a theorem may need an inverse that does not exist: one way to fail.
        finding.verdict, finding.note = "expected to fail" if unmet else UNDEFINED, str(error)
    else:
        finding.judged(found)
        if unmet:
            finding.verdict = {"fails": "expected to fail", "holds": "holds anyway"}.get(found.verdict, found.verdict)
    finding.seconds = time.perf_counter() - begin
    return finding


def with_spaces(lhs: Any, rhs: Any) -> tuple[Any, Any]:
    """Give an I on one side the other side's space."""
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
        is the mass matrix HφMφ*H*, `N` the number of coordinates. Operators followed by bodies form a statement by block,
        ``"Ω(i,j) = Υ(i)ψ(i,j), i above j"``: it is checked for every choice of bodies that satisfies its relations. Own letters
        are defined before it, ``"A := I + HφK; MM + J = A D A*"``, as are vectors, ``"x ∈ Θ; ..."``; vectors of the equations of motion
        (T, θ̈, 𝒞, α, f, z, ε, ν, ...) are known.
    model : Multibody, OperatorSet or None
        None: random trees that together meet and violate every standard hypothesis, including deep and wide ones, moving and in
        gravity (text only; `pycraft.truth` shows where the statement is true).
    states : number of states, drawn from `seed`
    search : for a false statement, search the standard hypotheses under which it is true, and the smallest tree, hinge kinds and state that
        refute it; if no hypothesis makes it true, the smallest that meets all hypotheses
    precision : the first scalar after double for residuals, "extended", "quad", 50 or 100 digits. If it does not decide,
        wider ones are tried in turn: extended costs about twice a run in double, quad 20, 50 digits 60 and 100 digits 100 times.
        Numbers in the statement that are close to each other, or to 0 or 1 (1e-40), require a scalar that distinguishes them.
    dialect : notation of the text: "Featherstone", "Khatib", "Mueller", "Park", "Saha" or "Wensing". The text
        may also name it: ``"dialect Park; M = S^T G^T J G S"``.
    budget : CPU seconds for each part of the search: hypotheses, and the smallest refutation. The report states which part it ended.

    Returns
    -------
    CheckReport
        True or false as a condition, with `.worst` and `.counterexample`. As a condition it raises UndecidedError if 100 digits do not
        decide.

    Notes
    -----
    Values are compared at random states: a difference below the report's bound is not detected, unless the statement's own numbers
    imply how small it may be. `pycraft.prove` proves statements for every state.

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
        raise _core.EvaluationError(f"states={states}: a statement needs at least one state")
    _check_seed(seed)
    if isinstance(statement, (tuple, list)) and len(statement) == 2 and all(map(_is_expression, statement)):
        text = f"{statement[0].text()} == {statement[1].text()}"
    elif isinstance(statement, str):
        text = statement = in_dialect(statement, dialect)
    else:
        raise _core.EvaluationError(f"check takes a statement as text or a pair of expressions, not {statement!r:.80}")
    operators: Any = None if model is None else getattr(model, "soa", model)
    if model is not None and not isinstance(operators, OperatorSet):
        raise _core.EvaluationError(f"check takes a model or its operators (model.soa), not {model!r:.80}")
    if isinstance(statement, str) and says_by_block(statement, [] if operators is None else [name for name, *_ in operators.V.blocks]):
        return check_by_block(statement, operators, states=states, seed=seed, precision=precision)
    if model is None:
        if not isinstance(statement, str):
            raise _core.EvaluationError("expressions belong to one model; give text to check a statement on random trees")
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
    """Return the report of a statement with an inverse that exists only if J > 0; otherwise raise the error."""
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
    report.notes.append(f"{error}: the statement needs rotor inertia at every hinge (hinge.rotor_inertia)")
    return report


def _check_on_trees(text: str, *, states: int, seed: int, search: bool, precision: str | int, budget: float) -> CheckReport:
    """Check a statement on the family of random trees, one state each: as many models as states, and at least one of each cell."""
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
        report.notes.append("checked where J > 0: without rotor inertia an inverse in it does not exist")
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
    """Add the hypotheses under which a false statement is true, and its best counterexample; nothing if it applies only to one model."""
    from .truth import explained, saving

    try:
        found, report.counterexample = explained(text, **options)
    except (_core.EvaluationError, _core.SpaceError, _core.ModelError):
        report.notes.append("it cannot be read on random trees, so no smaller counterexample was searched for")
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
    """Return the verdict on a statement at random states of one model."""
    model = operators._model
    rng = np.random.default_rng(seed)
    drawn = [BoundState(operators, s) for s in ([None] if model is None else [operators.random_state(rng) for _ in range(states)])]
    vectors = [drawn_vectors(read.rhs, rng, drawn_vectors(read.lhs, rng, {})) for _ in drawn]
    options: dict[str, Any] = dict(precisions=ladder(precision), decides=telling_of(read))
    return Verdict([judge_read(read, at, values, **options) for at, values in zip(drawn, vectors, strict=True)])
