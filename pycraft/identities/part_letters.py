"""Letters of parts of a model and of trees made of it, told by their subscripts.

    f, p    the coordinates that are free, and those that are prescribed: every third hinge, or those of `soa.free(...)`
    w       all bodies in world axes about the world's origin
    c       the tree cut at a hinge, halfway on the way from the base to the last body
    n       the last body made the root, where the root is free
    2       bodies grouped in pairs
    r, g    loops embedded on independent coordinates, and the groups of bodies that they are made of

Beside them Q and A are rows of loops, Q_s rows of Q that are independent, B_e the pick-off of the loops' ends; e_i and e_j the unit vectors
of the coordinates i and j; b_J and C_J what rotors add to the Coriolis forces and their matrix.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from .. import _core
from ..operators.rotor_letters import NAMES as OF_ROTORS
from .directions import COORDINATES, coordinates_meant

_TREE = (
    "E", "phi", "phi_tilde", "H", "M", "J", "P", "P_plus", "D", "G", "K", "tau", "tau_bar", "E_psi", "psi", "psi_tilde", "R", "Upsilon",
    "Omega",
)  # fmt: skip
_OF_PARTS = ("H", "J", "P", "P_plus", "D", "G", "K", "tau", "tau_bar", "E_psi", "psi", "psi_tilde", "Upsilon", "Omega")
_MOVED = "(M phi^* (H_f^* vdot_f + H_p^* vdot_p + a) + b)"
_MADE = {
    **{f"MM_{a}{b}": f"H_{a} phi M phi^* H_{b}^*" for a in "fp" for b in "fp"},
    **{f"Jacobian_{a}": f"phi^* H_{a}^*" for a in "fp"},
    "T_f": f"H_f phi {_MOVED} + J_f vdot_f",
    "T_p": f"H_p phi {_MOVED}",
    "z_f": "psi_f (K_f T_f + P_f (a + H_p^* vdot_p) + b)",
    "nu_f": "D_f^-1 (T_f - H_f z_f)",
    **{f"MM_{x}": f"H_{x} phi_{x} M_{x} phi_{x}^* H_{x}^*" for x in "wn2rg"},
    "C_force_g": "H_g phi_g (M_g phi_g^* a_g + b_g)",
    "C_force_r": "H_r phi_r (M_r phi_r^* a_r + b_g) + X_r^* J_g X_r_dot theta_dot_r",
    "phi_tilde_S": "phi_S - I",
}
_VECTORS = ("vdot_f", "vdot_p", "vdot_r")
HYBRID = frozenset({f"{x}_{of}" for x in _OF_PARTS for of in "fp"} | {n for n in _MADE if n[-1] in "fp"} | {"vdot_f", "vdot_p"})
"""Names of hybrid parts."""
OF_TREES = frozenset({f"{x}_{of}" for x in _TREE for of in "wcn2"} | {f"MM_{x}" for x in "wn2"})
"""Names of trees that are made of any model."""
ON_LOOPS = frozenset(
    {f"{x}_r" for x in (*_TREE, "MM", "X", "a", "theta_dot", "vdot", "C_force")}
    | {f"{x}_g" for x in ("phi", "H", "M", "J", "MM", "a", "b", "C_force")}
    | {"X_r_dot", "phi_S", "H_S", "phi_tilde_S", "Delta_X"}
)
"""Names of embedded loops."""
OF_ROWS = frozenset({"Q", "A", "Q_s", "B_e"})
"""Names of rows of loops."""
UNITS = tuple(f"e_{x}" for x in COORDINATES)
PARTS = frozenset({*HYBRID, *OF_TREES, *ON_LOOPS, *OF_ROWS, *UNITS, *OF_ROTORS})
"""All names of parts, whichever of them a model has."""
VECTORS = frozenset(_VECTORS)
"""Of them the vectors whose values are drawn."""


def text_of_part(name: str) -> str | None:
    """What a part is made of, in the grammar's spelling; None where it is a letter of its own."""
    return _MADE.get(name)


def part(operators: Any, name: str) -> Any:
    """The operator of a part.

    Raises
    ------
    ModelError
        The model has no such part.
    """
    if name in UNITS:
        return _unit(operators, coordinates_meant(operators)[UNITS.index(name)], name)
    if name in OF_ROTORS:
        return _letter(operators, name)
    if name in OF_ROWS:
        return _of_rows(operators, name)
    if name in ON_LOOPS:
        return _on_loops(operators, name)
    if name in OF_TREES:
        letter, _, of = name.rpartition("_")
        return _kept(operators, f"tree {of}", lambda: _TREES[of](operators)).symbol(letter)
    free = operators if hasattr(operators, "of_prescribed") else _with_every_third_prescribed(operators)
    letter, of = name.rsplit("_", 1)
    own = free if of == "f" else free.of_prescribed
    return _core.vector(name, own.Theta) if name in _VECTORS else getattr(own, letter)


def _letter(operators: Any, name: str) -> Any:
    try:
        return getattr(operators, name)
    except AttributeError as error:
        raise _core.ModelError(str(error)) from None


def _kept(operators: Any, key: str, make: Callable[[], Any]) -> Any:
    """What was made once for these operators."""
    made: Any = operators._made
    if key not in made:
        made[key] = make()
    return made[key]


def _unit(operators: Any, i: int, name: str) -> Any:
    return _core.constant(np.eye(operators.Theta.dimension)[:, [i]], _core.euclidean(1), operators.Theta, name)


def _with_every_third_prescribed(operators: Any) -> Any:
    model, dof = operators._model, operators._source.dof
    if model is None or not isinstance(operators._source, _core.MultibodyOperators):
        raise _core.ModelError(f"{operators._source.name!r} has no hinges that could be prescribed: it is no multibody model of its own")
    named = [name for k, name in enumerate(model.hinges) if k % 3 == 1 and dof[k]]
    return _kept(operators, "every third", lambda: operators.free(named))


# ---------------------------------------------------------------------- trees made of the model
def _whole(operators: Any, what: str) -> Any:
    if not isinstance(operators._source, _core.MultibodyOperators):
        raise _core.ModelError(f"{what} is made of a multibody model's own operators, not of {operators._source.name!r}")
    return operators._source


def _cut(operators: Any) -> Any:
    source = _whole(operators, "the tree cut at a hinge")
    way, k = [], len(source.parents) - 1
    while k >= 0:
        way.append(k)
        k = source.parents[k]
    return _core._derived_operators(source, ("cut", way[(len(way) - 1) // 2]))


_TREES: dict[str, Callable[[Any], Any]] = {
    "w": lambda o: _core._derived_operators(_whole(o, "the tree in world axes"), "world frame"),
    "c": _cut,
    "n": lambda o: _core._derived_operators(_whole(o, "the tree with another root"), ("root", len(o._source.parents) - 1)),
    "2": lambda o: _core._derived_operators(o._source, "bodies in pairs"),
}


# ---------------------------------------------------------------------- loops
def speaks_of_loops(names: set[str]) -> bool:
    """Whether letters of embedded loops, or of rows of loops, are among these names."""
    return bool({name.removesuffix("_dot") for name in names} & (ON_LOOPS | OF_ROWS))


def embedded_of(operators: Any) -> Any:
    """The embedded loops of a model's operators, or these themselves.

    Raises
    ------
    ModelError
        The model has no loops, or is off them.
    """
    if hasattr(operators, "X_r"):
        return operators
    loops = getattr(operators._model, "loops", ())
    if not len(loops) or not isinstance(operators._source, _core.MultibodyOperators):
        raise _core.ModelError(f"{operators._source.name!r} has no loops; model.add_loop(...) adds one")
    made: Any = operators._made
    if "embedded" not in made or not made["embedded"].is_current():
        made["embedded"] = operators.embedded()
    return made["embedded"]


def _of_rows(operators: Any, name: str) -> Any:
    whole = getattr(operators, "_whole", operators)
    if not len(getattr(whole._model, "loops", ())):
        raise _core.ModelError(
            f"{name} is a letter of models with loops, and {whole._source.name!r} has none; model.add_loop(...) adds one"
        )
    Q = _letter(whole, "Q")
    if name == "Q_s":
        rows = independent_rows(np.asarray(Q.dense(), float))
        return _core.constant(np.eye(Q.shape[0])[rows], Q.codomain, _core.euclidean(len(rows)), "S") @ Q
    if name == "B_e":
        reach = _core._rows_by_ends(whole._made["loops"])
        found = None if reach is None else next(_letters_called("B", reach))
        if found is None:
            raise _core.ModelError(f"B_e is the pick-off of the ends of loops, and not every loop of {whole._source.name!r} has two ends")
        return found
    return _letter(whole, name)


def _letters_called(name: str, e: _core.Operator) -> Iterator[_core.Operator]:
    if e.kind == "symbol" and e.name == name:
        yield e
    for child in e.children:
        yield from _letters_called(name, child)


def independent_rows(Q: np.ndarray) -> list[int]:
    """Rows that are independent, found by orthogonalization with pivoting; in order."""
    rest, found = Q.copy(), list[int]()
    longest = np.linalg.norm(Q, axis=1).max(initial=0.0)
    while len(found) < len(Q):
        lengths = np.linalg.norm(rest, axis=1)
        k = int(np.argmax(lengths))
        if lengths[k] <= RANK * longest:
            break
        direction = rest[k] / lengths[k]
        rest = rest - np.outer(rest @ direction, direction)
        found.append(k)
    return sorted(found)


RANK = 1e-8
"""Of the longest row, as mobility has it."""


def _on_loops(operators: Any, name: str) -> Any:
    embedded = embedded_of(operators)
    if name == "vdot_r":
        return _core.vector(name, embedded.Theta)
    if name in ("X_r", "X_r_dot"):
        return getattr(embedded, name)
    groups = embedded.unconstrained
    if name in ("phi_S", "H_S"):
        return getattr(groups, name)
    if name == "Delta_X":
        e = _unit(embedded, independent_coordinate(embedded), "e_i")
        unbound: Any = None
        return _core._function(groups._source, "crf", unbound, groups.H_S.T @ embedded.X_r @ e)
    letter, _, of = name.rpartition("_")
    return getattr(embedded if of == "r" else groups, letter)


def independent_coordinate(embedded: Any) -> int:
    """The coordinate i of embedded loops: the first of the first node that loops were embedded in."""
    looped = {k for bodies, *_ in embedded.sets for k in bodies}
    dof, first = embedded._source.dof, 0
    for own, group in zip(dof, embedded.unconstrained._source.groups, strict=True):
        if own and looped & {*group}:
            return first
        first += own
    return 0
