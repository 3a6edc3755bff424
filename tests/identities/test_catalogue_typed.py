"""What the catalogue prints can be typed: every text is read, and has the verdict of its theorem."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.checker import check_theorem
from pycraft.identities.judge import BoundState
from pycraft.identities.on_loops import OnLoops, closed_models
from pycraft.identities.spelling import spelled


def _tree(parents, kinds, rotors):
    model = pc.tree(parents, kinds, seed=1, rotor_inertia=rotors)
    model.gravity = (1.0, -2.0, 9.0)
    return model


MODELS = {
    "branches": lambda: _tree([-1, 0, 0, 1, 1], ["pin", "universal", "ball", "slider", "ball"], True),
    "free chain": lambda: _tree([-1, 0, 1, 2], ["free", "ball", "pin", "slider"], False),
    "single": lambda: _tree([-1, 0, 1, 1], ["pin", "slider", "pin", "screw"], True),
    "loops": lambda: closed_models(0)[1],
}
OF_A_COORDINATE = {"∂"}
"""Said of any coordinate: where a hypothesis is not met, it may hold along the one that a text is checked along."""
MADE = {}


def _model(name):
    if name not in MADE:
        MADE[name] = MODELS[name]()
    return MADE[name]


def _theorems(name):
    return [t for t in _model(name).soa.theorems() if not t.waiting]


CASES = [(name, t.name) for name in MODELS for t in _theorems(name) if name != "loops" or t.group.startswith("Loops")]
OF_EMBEDDED = [t.name for t in _model("loops").soa.embedded().theorems() if t.group.startswith("Loops")]


def _agrees(text, theorem, source, operators, given):
    unmet = theorem.unmet(source)
    try:
        typed = pc.check(text, given, states=2, search=False).verdict
    except (pc.SingularOperatorError, pc.EvaluationError) as error:
        assert unmet and ("singular" in str(error) or "no bodies" in str(error) or "free" in str(error)), (text, str(error))
        return
    if not unmet:
        assert typed == "holds", text
    elif not OF_A_COORDINATE & {*spelled(text).text}:
        rng = np.random.default_rng(0)
        states = [BoundState(operators, operators.random_state(rng)) for _ in range(2)]
        found = check_theorem(theorem, unmet, states, rng).verdict
        assert (typed == "holds") == (found in ("holds", "holds anyway")) or found == "undefined", (text, typed, found)


@pytest.mark.parametrize("how", ["text", "latex"])
@pytest.mark.parametrize(("model", "name"), CASES, ids=[f"{m}: {n}" for m, n in CASES])
def test_a_printed_theorem_is_read_with_its_verdict(model, name, how):
    on = _model(model)
    theorem = next(t for t in _theorems(model) if t.name == name)
    _agrees(getattr(theorem, how), theorem, on.soa._source, on.soa, on)


@pytest.mark.parametrize("how", ["text", "latex"])
@pytest.mark.parametrize("name", OF_EMBEDDED)
def test_a_printed_theorem_of_embedded_loops_is_read_with_its_verdict(name, how):
    embedded = _model("loops").soa.embedded()
    theorem = next(t for t in embedded.theorems() if t.name == name and t.group.startswith("Loops"))
    _agrees(getattr(theorem, how), theorem, embedded._source, OnLoops(embedded), embedded)
