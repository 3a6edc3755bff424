"""No hypothesis of a theorem is idle: for each there is a model that meets all the others, and on which the theorem fails."""

import numpy as np
import pytest

import pycraft as pc
from pycraft.identities.checker import check_theorem
from pycraft.identities.family import Spec
from pycraft.identities.judge import BoundState

BREAKING = {
    # hypothesis: models that do not meet it and, as far as there are such, meet all the others
    "J = 0": [
        Spec((-1, 0, 1, 2), ("pin", "screw", "pin", "slider"), True, 3),
        Spec((-1, 0, 1, 2), ("free", "pin", "ball", "pin"), True, 3),
        Spec((-1, 0, 0, 1), ("pin", "ball", "universal", "pin"), True, 3),
        Spec((-1, 0, 1), ("free", "free", "free"), True, 3),
    ],
    "serial chain": [Spec((-1, 0, 0, 1), ("pin", "slider", "pin", "pin"), False, 3)],
    "single-DOF hinges": [Spec((-1, 0, 1, 2), ("pin", "ball", "pin", "pin"), False, 3)],
    "constant H": [
        Spec((-1, 0, 1, 2), ("pin", "universal", "pin", "pin"), False, 3),
        Spec((-1, 0, 1, 2), ("pin", "custom", "pin", "pin"), False, 3),
    ],
    "free root": [Spec((-1, 0, 1), ("ball", "pin", "pin"), False, 3)],
    "blocks of one size": [],  # what a model of rigid bodies always meets
}
THEOREMS = [(t.name, h) for t in pc.chain(3).soa.theorems() for h in t.hypotheses]


@pytest.fixture(scope="module")
def models():
    """Each model with its theorems and states; of these none is at rest."""
    made = {}
    for specs in BREAKING.values():
        for spec in specs:
            if spec not in made:
                model = spec.model()
                states = [BoundState(model.soa, s) for s in spec.states(model, 1)]
                made[spec] = model, {t.name: t for t in model.soa.theorems()}, states
    return made


@pytest.mark.parametrize(("name", "hypothesis"), THEOREMS)
def test_the_hypothesis_is_needed(name, hypothesis, models):
    if hypothesis == "blocks of one size":
        pytest.skip("rigid bodies have blocks of one size: see test_sko_random")
    tried = []
    for spec in BREAKING[hypothesis]:
        model, theorems, states = models[spec]
        if name not in theorems:
            continue
        unmet = theorems[name].unmet(model.soa._source)
        if unmet != [hypothesis]:
            continue
        finding = check_theorem(theorems[name], unmet, states, np.random.default_rng(0))
        tried.append((str(spec), finding.verdict, finding.wide_residual))
        if finding.verdict == "expected to fail":
            return
    pytest.fail(f"{name} does not need {hypothesis}: {tried}")


def test_an_idle_hypothesis_would_be_seen():
    """Hypotheses are what the test above is given: it goes through all of them that the catalogue names."""
    assert {h for _, h in THEOREMS} == set(BREAKING) and len(THEOREMS) > 25
