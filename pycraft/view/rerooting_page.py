"""One motion seen from every base body in turn: which quantities are invariant, and which depend on the chosen base.

invariant  poses, velocities and accelerations of bodies, energy, momentum; ln det ℳ, as coordinates change by a matrix of determinant ±1;
           Υ(k) = J_k ℳ⁻¹ J_k*, the acceleration of body k by a force on body k; the shares tr(Υ(k)M(k))
dependent  the order of the bodies and the depth of the tree, the coordinates' velocities, the condition of ℳ, P(k) and what is inboard of k

The inertia felt at a body of a free tree is Υ(k)⁻¹ = P(k) + S⁺(k): P(k) of the outboard bodies, S⁺(k) of the inboard ones. If k is the
base, it equals P(k). [The two-filter form, in the catalogue of theorems "two-filter form"; A. Jain, Robot and Multibody Dynamics, Springer
2011]
"""

from __future__ import annotations

import copy
from functools import cached_property
from typing import Any

import numpy as np

from .. import _core
from ..state import at_state
from .figure_data import figure_data, number_text, pose_rows
from .page import Page
from .shares import share_values
from .skeleton import Skeleton
from .web_page import web_page

MOST = 60
"""Largest number of bodies: for each, the page has a tree and a pair of values per body."""


class RerootingPage(Page):
    """`Multibody.rerootings`: a page with a slider for the base body.

    Attributes
    ----------
    bases : list of str, bodies that can be the base: bodies of free-flying trees
    stays, changes : dict
        One value for each of `bases`, by name. For vectors and quantities of all bodies, `stays` gives the distance from the value with the
        first of `bases`.
    inverse_of_Upsilon, P : (bases, bodies of `bases`), kg
        A third of the trace of the linear block of Υ(k)⁻¹, the mean mass felt over all directions, and of P(k), the outboard
        part. The rest is S⁺(k).
    """

    HEIGHT = 600

    def __init__(self, model: Any, q: Any = None, v: Any = None):
        self.model = copy.copy(model)
        q, v = at_state(model, q, v)
        model.check_q(q)
        self.model.q, self.model.v = q, v
        if len(model.bodies) > MOST:
            raise _core.EvaluationError(
                f"{len(model.bodies)} bodies: at most {MOST} can be drawn with each as the base; model.subgraph(...) gives a part"
            )
        self.models = self._rerooted()
        self.bases = list(self.models)
        self._read()

    def _rerooted(self) -> dict[str, Any]:
        """Return copies with every body in turn as the base. Raises ModelError, with the remedy, if no body can be."""
        made, refused = {}, None
        for name in self.model.bodies:
            other = copy.copy(self.model)
            try:
                other.reroot(name)
            except _core.ModelError as error:
                refused = refused or error
            else:
                made[str(name)] = other
        if not made:
            raise refused or _core.ModelError(f"{self.model.name!r} has no bodies to choose a base from")
        return made

    def _read(self) -> None:
        seen = [_seen(model, list(self.model.bodies), self.bases) for model in self.models.values()]
        first = seen[0]
        self.stays: dict[str, list[float]] = {
            "kinetic energy, J": [s["kinetic"] for s in seen],
            "momentum, N s": [float(np.linalg.norm(s["momentum"][3:])) for s in seen],
            "angular momentum about the centre of mass, N m s": [float(np.linalg.norm(s["momentum"][:3])) for s in seen],
            "ln det ℳ": [s["log determinant"] for s in seen],
            "Σ tr Υ(k)M(k)": [float(s["shares"].sum()) for s in seen],
        }
        for what, unit in (("poses", "m"), ("velocities", "m/s"), ("accelerations", "m/s²"), ("shares", "1")):
            text = f"largest difference of {what} from the first, {unit}".removesuffix(", 1")
            self.stays[text] = [float(np.abs(s[what] - first[what]).max(initial=0.0)) for s in seen]
        self.changes: dict[str, list[float]] = {
            "bodies on the longest path": [float(s["depth"]) for s in seen],
            "condition of ℳ": [s["condition"] for s in seen],
            "speed of the base, m/s": [s["speed"] for s in seen],
            "rate of turn of the base, rad/s": [s["turn"] for s in seen],
        }
        self.inverse_of_Upsilon = np.array([s["felt"] for s in seen])
        self.P = np.array([s["outboard"] for s in seen])
        self._parents = [s["parents"] for s in seen]

    @cached_property
    def html(self) -> str:
        model, skeleton = self.model, Skeleton(self.model)
        places = [list(model.pose(name)[:3, :3] @ model.bodies[name].com + model.pose(name)[:3, 3]) for name in model.bodies]
        numbers = {"felt": self.inverse_of_Upsilon, "outboard": self.P}
        data = {
            "figure": figure_data(skeleton, np.asarray(model.q)), "poses": number_text(pose_rows(skeleton, np.asarray(model.q))),
            "bases": [list(model.bodies).index(name) for name in self.bases], "parents": self._parents, "places": places,
            "stays": self.stays, "changes": self.changes, **{name: x.tolist() for name, x in numbers.items()},
        }  # fmt: skip
        said = "one motion, seen from each base body; arrows go from parent to child"
        return web_page("bases", model.name, data, {"said": said})

    def __repr__(self) -> str:
        rows = [("base", self.bases)] + [(name, [f"{x:.4g}" for x in row]) for name, row in (self.stays | self.changes).items()]
        return "\n".join([f"<{self.model.name!r} seen from {len(self.bases)} bases>"] + [f"  {n}: {', '.join(row[:6])}" for n, row in rows])


def _seen(model: Any, bodies: list[str], bases: list[str]) -> dict[str, Any]:
    """Return quantities of one motion, with bodies in the order of `bodies` for every tree."""
    soa, q = model.soa, np.asarray(model.q)
    order = [list(model.bodies).index(name) for name in bodies]
    model.frames.vdot = model.forward_dynamics(tau=np.zeros(model.nv))
    twists = np.array([model.frame(name).velocity() for name in bodies])
    H, phi, M, J, P, Upsilon = (letter.at(q) for letter in soa("H phi M J P Upsilon"))
    MM = H @ phi @ M @ phi.T @ H.T + J if model.has_rotor_inertia else H @ phi @ M @ phi.T @ H.T
    blocks, inertias = Upsilon.blocks(), P.blocks()
    parents = {name: model.bodies[name].parent for name in bodies}
    named = [None if parent is None else getattr(parent, "name", parent) for parent in parents.values()]
    root = next((k for k, parent in enumerate(named) if parent not in bodies and bodies[k] in bases), 0)
    return {
        "kinetic": float(model.kinetic_energy()), "momentum": model.centroidal_momentum().value, "shares": share_values(model, q)[order],
        "log determinant": float(MM.logdet()), "condition": float(np.linalg.cond(model.mass_matrix())),
        "poses": np.array([model.pose(name) for name in bodies]), "velocities": twists,
        "accelerations": np.array([model.frame(name).acceleration() for name in bodies]),
        "parents": [bodies.index(parent) if parent in bodies else -1 for parent in named], "depth": _depth(named, bodies),
        "speed": float(np.linalg.norm(twists[root][3:])), "turn": float(np.linalg.norm(twists[root][:3])),
        "felt": [float(np.trace(np.linalg.inv(blocks[name, name])[3:, 3:])) / 3 for name in bases],
        "outboard": [float(np.trace(inertias[name, name][3:, 3:])) / 3 for name in bases],
    }  # fmt: skip


def _depth(parents: list[Any], bodies: list[str]) -> int:
    """Return the number of bodies on the longest path from a root."""
    carried = dict(zip(bodies, parents, strict=True))

    def level(name: Any) -> int:
        count = 0
        while name in carried:
            name, count = carried[name], count + 1
        return count

    return max(map(level, bodies), default=0)
