"""Statements about embedded loops and rows of loops: on models with loops, at states on these; without a model on random closed ones."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

from .. import _core
from ..models.generators import chain, tree
from ..operators.operator_set import OperatorSet
from .dialects import divided
from .drawn_vectors import drawn_vectors
from .inequalities import judge_read
from .judge import BoundState, Judgement, ladder
from .parse import Statements
from .part_letters import ON_LOOPS, embedded_of, independent_coordinate
from .spelling import spelled
from .statement_text import telling_of

_TOLD_BY = re.compile(
    r"(?<![a-z_\d\\])(?:" + "|".join(sorted(map(re.escape, {*ON_LOOPS, "Q_s", "B_e"}), key=len, reverse=True)) + r")(?![a-z\d])"
    r"|(?<![A-Za-z_\d\\])(?:Q|Q_dot)(?![A-Za-z_\d])"
)


class OnLoops(OperatorSet):
    """A model's operators whose states are on its loops; derivatives along coordinates i and j are along independent ones."""

    def __init__(self, embedded: Any):
        super().__init__(embedded._whole._source, embedded._model)
        self._loops_embedded = embedded
        made: Any = self._made
        made["embedded"] = embedded

    def independent_coordinate(self, which: int) -> int:
        """The coordinates i (0) and j (1) of statements: the first of a node of loops, and the next one where there is one."""
        i, count = independent_coordinate(self._loops_embedded), self._loops_embedded.Theta.dimension
        return i if which == 0 else (i + 1) % count

    def random_state(self, rng: Any) -> Any:
        return self._loops_embedded.random_state(rng)

    def __reduce__(self):
        return OnLoops, (self._loops_embedded,)


def said_of_loops(text: str) -> bool:
    """Whether letters of loops stand in a statement, other than such as it defines."""
    definitions, claim = divided(text)
    own = {d.name for d in definitions}
    whole = " ; ".join(spelled(part).text for part in (claim, *(d.what for d in definitions)))
    return any(found[0] not in own for found in _TOLD_BY.finditer(whole))


def on_loops(operators: Any, text: str) -> Any:
    """These operators, or for a statement about loops those of the whole model at states on its loops.

    Raises
    ------
    ModelError
        The model has no loops, or is off them.
    """
    return OnLoops(embedded_of(operators)) if said_of_loops(text) else operators


_CLOSED = (  # parents, kinds, rotors, the bodies that a ball holds where they are
    ((-1, 0, 1, 2), ("pin", "ball", "universal", "pin"), True, (3,)),
    ((-1, 0, 0, 1, 2), ("free", "pin", "ball", "pin", "universal"), False, (4,)),
    ((-1, 0, 1, 2, 3, 1), ("universal", "ball", "slider", "pin", "ball", "pin"), True, (4,)),
    ((-1, 0, 1, 2, 0, 4), ("ball", "pin", "ball", "pin", "ball", "universal"), False, (3, 5)),
)


@cache
def closed_models(seed: int) -> list[Any]:
    """Random models with loops, at states on these: a four-bar linkage, and trees of which bodies are held by balls where they are."""
    bars = chain(3, name="a four-bar linkage")
    bars.add_loop("body2", hinge="pin", point=(1, 0, 0), name="closure")
    bars.q = bars.assemble([1.0, -1.4, -1.5], fix="hinge0").q
    made = [bars]
    for number, (parents, kinds, rotors, held) in enumerate(_CLOSED):
        model = tree(
            list(parents),
            list(kinds),
            seed=31 * seed + number,
            rotor_inertia=rotors,
            name=f"a closed tree of {len(kinds)} bodies, {', '.join(kinds)}",
        )
        model.q = model.random_state(np.random.default_rng([seed, number])).q
        for body in held:
            model.add_loop(f"body{body}", hinge="ball", position=tuple(model.pose(f"body{body}")[:3, 3]), name=f"loop{body}")
        made.append(model)
    return made


def judged_on_loops(text: str, states: int, seed: int, precision: str | int) -> Iterator[tuple[str, Judgement, str]]:
    """(the name of a closed model, what was found at a state of it, how the text was read), for as many states as are asked for."""
    models, refusal = closed_models(seed), None
    count = 0
    for k in range(max(states, len(models))):
        model = models[k % len(models)]
        operators = OnLoops(model.soa.embedded())
        try:
            read = Statements(operators).read(text, inequalities=True)
        except (_core.EvaluationError, _core.SpaceError, _core.ModelError) as error:
            refusal = refusal or error
            continue
        rng = np.random.default_rng([seed, k])
        at = BoundState(operators, operators.random_state(rng))
        values = drawn_vectors(read.rhs, rng, drawn_vectors(read.lhs, rng, {}))
        found: Judgement = judge_read(read, at, values, precisions=ladder(precision), decides=telling_of(read))
        count += 1
        yield model.name, found, read.understood
    if not count:
        assert refusal is not None
        raise refusal
