"""Exercises: a derivation with a line left out, and a judge of answers that accepts only proofs.

An answer is accepted if it is proved equal to the line before, from the axioms and under no hypotheses except the theorem's. Numerical
values can only refute: they give the error of a false line, and show that a hypothesis under which it would hold is necessary.
"""

from __future__ import annotations

import difflib
from collections.abc import Sequence
from typing import Any

from .. import _core
from ..identities.parse import Statement, Statements
from .grading import Exercise, Judgement
from .models_tried import example, operators_of
from .prove import prove

__all__ = ["Exercise", "Judgement", "exercise"]


def exercise(theorem: Any, model: Any = None, blank: int | Sequence[int] | None = None, seed: int = 0) -> Exercise:
    """Return an exercise: a proof with one or several lines left out.

    Parameters
    ----------
    theorem : a name of the catalogue (`soa.theorems()`), a statement as text, or a pair (lhs, rhs) of expressions
    model : Multibody or OperatorSet on which text is read and evaluated; default: a small random tree
    blank : the number of the line to leave out, from 1, or several numbers; default: a random line
    seed : seed of the random choice

    Returns
    -------
    Exercise
        Prints the derivation with the gaps; has `.answer(line)`, `.hint(level)`, `.solution()`. With several gaps, `.answer({2: ...,
        4: ...})` judges each, and `.gap(4)` is the exercise at one of them.

    Raises
    ------
    EvaluationError
        The theorem has no proof, or the theorem or the line does not exist.
    ParseError
        The text is not a statement.

    Examples
    --------
    >>> from pycraft.proofs import exercise
    >>> task = exercise("HψMψ*H* == D", blank=2)
    >>> print(task)
    H ψ M ψ* H* = D, where J = 0
          H ψ M ψ* H*
       1. = H ψ P H* + H P ψ* H* − H P H*   [ψ M ψ* = ψ P + P ψ* − P]
       2. = ?
       3. = H ψ G D + D G* ψ* H* − D        [G D = P H*, at 2 places]
       4. = H G D + D G* H* − D             [ψ G = G, at 2 places]
       5. = D                               [H G = I, at 2 places]
    >>> bool(task.answer("HψPH* + HPψ*H* - D"))
    True
    """
    if isinstance(theorem, str):
        read, name = _read_theorem(theorem, model)
    else:
        if not isinstance(theorem, Sequence) or len(theorem) != 2:
            what = "a theorem's name, a statement as text or a pair (lhs, rhs)"
            raise _core.EvaluationError(f"an exercise is made of {what}, not of {theorem!r}")
        lhs, rhs = theorem
        read, name = Statement(lhs, rhs, "", "expressions"), ""
    proof = prove(read.lhs, read.rhs, model)
    if not isinstance(read.lhs, _core.Operator):
        raise _core.EvaluationError(f"there is no proof to leave a line out of: {name or proof.statement} is a statement between scalars")
    if not proof:
        said = f"{name}: {proof.statement}" if name else proof.statement
        raise _core.EvaluationError(f"there is no proof to leave a line out of: {said}\n  {str(proof).partition(chr(10))[2].strip()}")
    return Exercise(proof, model, blank, seed)


def _read_theorem(text: str, model: Any) -> tuple[Any, str]:
    """(the statement, its name in the catalogue)."""
    operators = operators_of(model if model is not None else example())
    theorems = {t.name: t for t in operators.theorems()}
    found = theorems.get(text) or next((t for t in theorems.values() if t.name.lower() == text.lower()), None)
    if found is not None:
        reason = "it needs features that do not exist yet" if found.waiting else "it states blocks on one path" if found.on_one_path else ""
        reason = reason or ("it is a bound" if found.at_most else "")
        if reason:
            raise _core.EvaluationError(f"there is no proof of {found.name!r} to leave a line out of: {reason}")
        return Statement(found.lhs, found.rhs, "", "expressions"), found.name
    if "=" not in text:
        near = difflib.get_close_matches(text, theorems, 3, 0.4)
        hint = f"; near it: {', '.join(map(repr, near))}" if near else "; soa.theorems() lists them"
        raise _core.EvaluationError(f"no theorem is called {text!r}, and it is not a statement lhs == rhs{hint}")
    return Statements(operators).read(text), ""
