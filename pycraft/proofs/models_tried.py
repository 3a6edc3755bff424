"""Models on which statements are read and proofs are evaluated: the given model, or small random ones that meet the hypotheses."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from .. import _core
from ..models.generators import tree
from ..models.multibody import Multibody
from ..operators.operator_set import OperatorSet


def operators_of(model: Any) -> OperatorSet:
    """Return the operators of a model; an operator set is returned unchanged."""
    return model if isinstance(model, OperatorSet) else model.soa


def operators_of_sources(sources: Iterable[_core.SkoSource]) -> OperatorSet | None:
    """Return the operators of the model of the first source, None without sources. They have states if the model is a Multibody."""
    for source in sources:
        made = source.derived_from
        source = made[1] if made is not None and made[0] == "loops" else source  # rows belong to a tree, and are not one
        model = source.model if isinstance(source, _core.MultibodyOperators) else None
        return OperatorSet(source, model if isinstance(model, Multibody) else None)
    return None


def example(hypotheses: Sequence[str] = ()) -> Any:
    """Return a small random model that meets these hypotheses and fails the others."""
    kinds = ["universal", "ball", "pin", "slider"]
    if "constant H" in hypotheses:
        kinds = ["free", "ball", "pin", "slider"]
    if "single-DOF hinges" in hypotheses:
        kinds = ["pin", "slider", "pin", "screw"]
    parents = [-1, 0, 1, 2] if "serial chain" in hypotheses else [-1, 0, 0, 1]
    model = tree(parents, kinds, seed=3, rotor_inertia="J = 0" not in hypotheses)
    for k in range(len(parents)):  # with the nodes of the random trees that statements are checked on
        model.add_node(f"node{k}", f"body{k}", position=(0.3 * k + 0.1, 0.2, -0.1))
    return model


def examples(hypotheses: Sequence[str] = ()) -> list[Any]:
    """Return small random models that meet these hypotheses: `example`; a path of at least six bodies, to see powers of E_φ that vanish on
    a short path; a model with free hinges only, where H, Υ and compliances of several nodes are regular."""
    kinds = ["universal", "ball", "pin", "slider", "pin", "ball", "pin"]
    if "constant H" in hypotheses:
        kinds[0] = "free"
    if "single-DOF hinges" in hypotheses:
        kinds = ["pin", "slider", "pin", "screw", "pin", "slider", "pin"]
    chain, rotors = "serial chain" in hypotheses, "J = 0" not in hypotheses
    made = [example(hypotheses), tree([-1, 0, 1, 2, 3, 4, 5 if chain else 1], kinds, seed=5, rotor_inertia=rotors)]
    if "single-DOF hinges" not in hypotheses:
        made.append(tree([-1, 0, 1 if chain else 0, 2 if chain else 1], ["free"] * 4, seed=7, rotor_inertia=rotors))
    return made
