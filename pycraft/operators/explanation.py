"""`Operator.explain`: a plan as text, and as a table with its sweeps in a notebook."""

from __future__ import annotations

from .. import _core


class Explanation(str):
    """A plan as text: prints as a table; in a notebook it is a table with the sweeps drawn on the tree."""

    expression: _core.Operator
    request: str

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        return str(_core._face["plan_html"](self))


def explain(operator: _core.Operator, request: str = "apply") -> Explanation:
    """Return the plan of an expression as a table of steps, tiers and costs; after a run, with the run's report."""
    made = Explanation(str(operator.plan(request)))
    made.expression, made.request = operator, request
    return made
