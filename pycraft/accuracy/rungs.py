"""Ways of computing, from cheap to accurate: form, refinement, precision and method, and the ladder of rungs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from .. import _core

FORMS = ("fast", "ud", "square-root")
"""Forms of the articulated-inertia sweep."""

OTHER_METHODS = ("cholesky", "ldl", "conjugate-gradients", "inverse", "divide-and-conquer", "realization")
"""Methods of forward dynamics other than the articulated-body algorithm; they have no forms."""

REFERENCE = "quad"
"""Precision of the reference; values of this or a wider precision are measured against the next wider one."""


RESIDUALS = ("same", "gather", "wider")
"""Precision of the residual of a refinement: the precision itself; forces gathered in the next wider; all in the next wider."""

RESIDUAL_TEXTS = {"same": "", "gather": ", wide gather", "wider": ", wider residual"}


@dataclass(frozen=True)
class Rung:
    """One way of computing: the keywords of `forward_dynamics`, `at` and the timings."""

    form: str = "fast"
    refine: int | str = 0
    residual: str = "same"
    precision: Any = "double"
    method: str = "articulated"

    @property
    def options(self) -> dict[str, Any]:
        """The keywords of `forward_dynamics`."""
        return {"form": self.form, "refine": self.refine, "residual": self.residual, "precision": self.precision, "method": self.method}

    @property
    def binding(self) -> dict[str, Any]:
        """The keywords of `expr.at`."""
        return {"form": self.form, "refine": self.refine, "residual": self.residual, "precision": self.precision}

    @property
    def way(self) -> str:
        """Form or method, and refinement: "fast + 1 refinement"."""
        text = self.form if self.method == "articulated" else self.method
        if self.refine == "auto":
            text += " + refinement"
        elif self.refine:
            text += f" + {self.refine} refinement" + ("s" if self.refine != 1 else "")
        return text + (RESIDUAL_TEXTS[self.residual] if self.refine else "")

    @property
    def label(self) -> str:
        """The way, and the precision if it is not double: "ud, extended"."""
        return self.way + ("" if self.precision == "double" else f", {precision_name(self.precision)}")


LADDER = (
    Rung("fast"),
    Rung("fast", refine=1),
    Rung("ud"),
    Rung("ud", refine=1),
    Rung("fast", precision="extended"),
    Rung("fast", precision="quad"),
)
"""The ladder for users: each step costs more than the one before it."""

WIDE_GATHER = Rung("fast", refine=1, residual="gather")
WIDER_RESIDUAL = Rung("fast", refine=1, residual="wider")

CLIMB = (*LADDER[:2], WIDE_GATHER, *LADDER[2:4], WIDER_RESIDUAL, *LADDER[4:])
"""The steps among which a certificate searches for a better one: if forces cancel, a wider residual lowers the floor."""


def precision_name(precision: Any) -> str:
    """ "double", "50 digits"."""
    text = str(precision)
    return f"{text} digits" if text.isdigit() else text


def epsilon(precision: Any) -> float:
    """Return epsilon of a precision: the distance from one to the next number."""
    known = _core.epsilons()
    key = int(precision) if str(precision).isdigit() else precision
    if key not in known:
        raise _core.EvaluationError(f"precision {precision!r} is not there; there are {', '.join(map(repr, known))}")
    return known[key]


def wider(precision: Any) -> Any:
    """Return the next wider precision, None above the widest."""
    return _core.wider(precision)


def reference_of(precision: Any) -> Any:
    """Return the reference precision for this precision: quad, or the next one that is wider by a factor of 100; None above the widest.

    (If long double has 113 bits, extended is as wide as quad.)
    """
    reference = REFERENCE if epsilon(precision) > epsilon(REFERENCE) else wider(precision)
    while reference is not None and 100 * epsilon(reference) > epsilon(precision):
        reference = wider(reference)
    return reference


def above(rung: Rung) -> list[Rung]:
    """Return the steps above a way of computing, lowest first. Raises EvaluationError for an unknown form."""
    check_form(rung.form)
    if epsilon(rung.precision) > epsilon("double"):
        return [replace(rung, precision="double"), *CLIMB[1:]]
    if rung.method != "articulated":
        return list(CLIMB)
    if epsilon(rung.precision) < epsilon("double"):
        wide = [step for step in CLIMB if epsilon(step.precision) < epsilon(rung.precision)]
        higher = wider(rung.precision) if not wide else None
        return wide + ([replace(rung, precision=higher, refine=0, residual="same")] if higher else [])
    if rung.refine and rung.residual == "wider":
        return list(CLIMB[CLIMB.index(WIDER_RESIDUAL) + 1 :])
    if rung.refine and rung.residual == "gather":
        return (
            [WIDER_RESIDUAL, *CLIMB[CLIMB.index(WIDER_RESIDUAL) + 1 :]]
            if rung.form != "fast"
            else list(CLIMB[CLIMB.index(WIDE_GATHER) + 1 :])
        )
    # The root-free and the square-root sweep are equivalent rungs; more than one step of refinement is still refinement.
    form = "ud" if rung.form == "square-root" else rung.form
    return list(CLIMB[CLIMB.index(Rung(form, refine=1 if rung.refine else 0)) + 1 :])


def check_form(form: Any) -> None:
    """Raise EvaluationError for an unknown form."""
    if form not in FORMS:
        known = "'fast', 'ud' and 'square-root'"
        raise _core.EvaluationError(f"no form of the articulated-inertia sweep is called {form!r}; there are {known}")
