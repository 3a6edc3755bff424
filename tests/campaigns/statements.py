"""Statements against the oracle: true formulas of the field with one to three random changes, judged by `pc.check` and by dense NumPy.

A formula is drawn, changed as a slip of the pen changes it (`pycraft.identities.edits`), and evaluated at two random states of two random
models with the operators of `pycraft.reference`, which shares nothing with the core. Where both sides are apart by more than `APART` of
the larger at a state, the checker must not say that it holds there; where they agree to `TOGETHER` at all of them, times the condition of
what is inverted, it must not say that it fails. What lies between decides nothing.

    python tests/campaigns/statements.py --seeds 2000
"""

import sys
from itertools import islice
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
import pycraft as pc
from campaigns.command_line import seeds, tallied
from pycraft.identities.edits import changed
from pycraft.identities.formula import written_statement
from pycraft.identities.formula_reading import read_formula
from pycraft.identities.formula_values import Misfit, Value, evaluate
from pycraft.identities.judge import BoundState, judge_states
from pycraft.identities.parse import Statements
from pycraft.state import State
from support.descriptions import random_description, random_state
from support.mechanisms import build
from support.oracle import reference
from support.wrong_formulas import TRUE

APART, TOGETHER = 1e-6, 1e-10
"""Dense double on trees of up to six bodies is good to 1e-12 or so; a change makes 1e-3 and more."""
KINDS = ("pin", "slider", "screw", "universal", "ball", "free", "cylindrical", "custom")
_ATTRIBUTES = {"MM": "mass_matrix", "velocity": "V"}


class Oracle:
    """The letters of a description at a state, from the dense reference."""

    dual = {"V": "F", "F": "V", "Θ": "Θ", "R^1": "R^1", None: None, "any": "any"}
    spaces = {s.name: (s.codomain, s.domain) for s in pc._core.symbols} | {"MM": ("Θ", "Θ")}

    def __init__(self, description, state):
        self._operators = reference.operators(description, *state)

    def of(self, letter):
        if letter.name == "I":
            return Value(np.eye(1), "any", "any")
        if letter.name == "N":
            return Value(np.array(float(len(self._operators.H))), None, None)
        if letter.arguments or letter.name in ("X_world", "gravity_field", "gravity_base", "a"):
            raise Misfit  # the reference has gravity in its a, and no world axes
        if letter.name == "theta_dot":
            array = self._operators.v
        else:
            array = getattr(self._operators, _ATTRIBUTES.get(letter.name, letter.name))
        array = np.asarray(array, float)
        return Value(array if array.ndim == 2 else array[:, None], *self.spaces[letter.name])


def apart(formula, oracle):
    """How far both sides are apart relative to the larger; None where that is not known: an inverse is singular, or both are rounding."""
    left, right = evaluate(formula[0], oracle), evaluate(formula[1], oracle)
    sides = []
    for one, other in ((left, right), (right, left)):
        array = one.array
        if one.domain == "any" and other.domain not in ("any", None):
            array = array[0, 0] * np.eye(len(other.array))
        sides.append(array)
    if (left.domain is None) != (right.domain is None) or sides[0].shape != sides[1].shape:
        if not any(np.array_equal(side, 0.0) for side in sides):
            raise Misfit
    spaces = {(v.codomain, v.domain) for v in (left, right) if v.domain not in ("any", None)}
    if len(spaces) > 1:
        raise Misfit
    size = max(np.abs(side).max(initial=0.0) for side in sides)
    if not 1e-6 < size < 1e6:
        return None
    return float(np.abs(sides[0] - sides[1]).max(initial=0.0) / size)


def drawn_formula(rng):
    """A true formula with none to three changes."""
    formula = read_formula(TRUE[rng.integers(len(TRUE))])
    for _ in range(rng.integers(0, 4)):
        options = [new for new, _ in islice(changed(formula), 4000)]
        formula = options[rng.integers(len(options))] if options else formula
    return formula


def model_of(seed):
    """(description, model, states) of one random tree that moves."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 7))
    parents = [-1, *(int(rng.integers(-1, k)) for k in range(1, n))]
    description = random_description(parents, [str(k) for k in rng.choice(KINDS, n)], seed, rotor_inertia=bool(rng.integers(2)))
    for hinge in (body["hinge"] for body in description["bodies"]):
        for subhinge in hinge["subhinges"]:
            if subhinge["kind"] == "free":
                subhinge["point"] = np.zeros(3)
    states = [random_state(description, seed + i) for i in range(2)]
    return description, build(description), [(np.asarray(q), np.asarray(v)) for q, v in states]


def run(seed, models=None):
    """(what was judged, complaints) of one seed: one formula on two models."""
    rng = np.random.default_rng([11, seed])
    formula = drawn_formula(rng)
    text = written_statement(formula)
    judged, complaints = 0, []
    for made in models or [model_of(int(rng.integers(1000))) for _ in range(2)]:
        description, model, states = made
        try:
            distances = [apart(formula, Oracle(description, state)) for state in states]
        except (Misfit, ArithmeticError):
            continue
        if any(d is None or not np.isfinite(d) for d in distances):
            continue
        try:
            read = Statements(model.soa).read(text)
        except pc.Error as error:
            complaints.append(f"seed {seed}: {text} does not read: {error}")
            continue
        bound = [BoundState(model.soa, State(q, v)) for q, v in states]
        try:
            verdict = judge_states(read.lhs, read.rhs, bound, [{}] * len(bound)).verdict
        except ArithmeticError:
            continue
        judged += 1
        if max(distances) > APART and verdict == "holds":
            complaints.append(f"seed {seed}: {text} is off by {max(distances):.1e} and holds")
        if max(distances) < TOGETHER and verdict == "fails":
            complaints.append(f"seed {seed}: {text} agrees to {max(distances):.1e} and fails")
        if verdict == "undecided":
            complaints.append(f"seed {seed}: {text} is undecided")
    return judged, complaints


if __name__ == "__main__":
    sys.exit(tallied(seeds(__doc__, 500), run, "verdicts"))
