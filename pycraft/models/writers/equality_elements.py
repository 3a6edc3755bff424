"""Loops of a model as equality constraints of MJCF that `loaders.mjcf_equalities` reads, if MJCF has them.

loop                                                          equality
ball, or gimbal                                               connect, of two sites at its point
weld                                                          weld, of two sites
coupling of one or two joints of one coordinate, linear in
one of them and of degree four at most in the other           joint

Sites are at the ends: a node of that pose, or a new one, called "loop: a" and "loop: b".
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.polynomial import Polynomial

from ...interop.export import numbers_text
from ...interop.mujoco import _quaternion

if TYPE_CHECKING:
    from ..multibody import Multibody


def add_equalities(model: Multibody, described: dict[str, Any], root: Any, elements: list[Any], joints: dict[str, str]) -> list[str]:
    """Add `<equality>` to a file, and return loops without one. `joints`: those of one coordinate, by the coordinate's name."""
    from lxml import etree

    section, sites, unsaid = etree.Element("equality"), _Sites(described, root, elements), []
    for loop in described.get("loops", []):
        if loop["kind"] in ("ball", "gimbal", "weld"):
            weld = loop["kind"] == "weld"
            a, b = sites.of_ends(loop)
            etree.SubElement(section, "weld" if weld else "connect", name=loop["name"], site1=a, site2=b)
        elif (said := _joint(model, loop, joints)) is not None:
            etree.SubElement(section, "joint", {"name": loop["name"]} | said)
        else:
            unsaid.append(f"{loop['kind']} {loop['name']!r}" if loop["kind"] == "coupling" else f"loop {loop['name']!r} ({loop['kind']})")
    if len(section):
        root.append(section)
    return unsaid


def _joint(model: Multibody, loop: dict[str, Any], joints: dict[str, str]) -> dict[str, str] | None:
    """Return the attributes of q₁ = Σ a_k q₂^k; None if the coupling does not have this form."""
    if loop["kind"] != "coupling" or loop.get("function") is not None:
        return None
    names = [joints.get(model.coordinate_names[i]) for i in model.loops.coupled(loop["name"])]
    parts = [Polynomial(coefficients or [0.0]).trim() for *_, coefficients in loop["terms"]]
    if None in names or len(names) > 2:
        return None
    for first in range(len(parts)):
        other = Polynomial([0.0]) if len(parts) == 1 else parts[1 - first]
        if parts[first].degree() == 1 and other.degree() <= 4:
            constant, slope = parts[first].coef
            powers = -(other + constant + loop["constant"]) / slope
            said = {"joint1": str(names[first]), "polycoef": numbers_text(np.pad(powers.coef, (0, 5 - len(powers.coef))))}
            return said if len(parts) == 1 else said | {"joint2": str(names[1 - first])}
    return None


class _Sites:
    """Sites at poses on bodies, those of nodes, which exist, or new ones."""

    def __init__(self, described: dict[str, Any], root: Any, elements: list[Any]):
        self.carriers = [*elements, root.find("worldbody")]  # -1: the base
        self.poses = {"": (-1, np.eye(4))} | {body["name"]: (k, np.eye(4)) for k, body in enumerate(described["bodies"])}
        self.nodes = {node["name"] for node in described["nodes"]}
        self.taken = set(self.nodes)
        for node in described["nodes"]:
            self.poses[node["name"]] = (node["body"], _pose(node["rotation"], node["position"]))

    def of_ends(self, loop: dict[str, Any]) -> tuple[str, str]:
        """Return the names of the sites on a and on b that coincide when the loop is closed."""
        placement, at = _pose(loop["rotation"], loop["position"]), _pose(None, loop["point"])
        return self._site(loop["a"], placement @ at, f"{loop['name']}: a"), self._site(loop["b"], at, f"{loop['name']}: b")

    def _site(self, frame: str, X: np.ndarray, name: str) -> str:
        from lxml import etree

        if frame in self.nodes and np.array_equal(X, np.eye(4)):
            return frame
        number, pose = self.poses[frame]
        while name in self.taken:
            name += "'"
        self.taken.add(name)
        pose = pose @ X
        etree.SubElement(
            self.carriers[number], "site", name=name, pos=numbers_text(pose[:3, 3]), quat=numbers_text(_quaternion(pose[:3, :3]))
        )
        return name


def _pose(rotation: Any, position: Any) -> np.ndarray:
    X = np.eye(4)
    if rotation is not None:
        X[:3, :3] = rotation
    if position is not None:
        X[:3, 3] = position
    return X
