"""Robots that come with the package: small models without meshes, with parameters from published sources (docs/robots.md)."""

from __future__ import annotations

from importlib.resources import as_file, files

from ..loaders.load import read
from ..multibody import Multibody


def names() -> list[str]:
    """Return the names of the robots: each is a function of this module.

    Examples
    --------
    >>> import pycraft as pc
    >>> pc.robots.names()
    ['puma560', 'panda', 'ur5', 'a1', 'g1']
    """
    return ["puma560", "panda", "ur5", "a1", "g1"]


def puma560(*, root: str = "fixed", welds: str = "lump") -> Multibody:
    """Unimation PUMA 560, arm of 6 hinges (nv 6), with rotor inertias.

    Source: Armstrong, Khatib and Burdick 1986, Corke and Armstrong-Hélouvry 1994, as tabulated in robotics-toolbox-python.
    Link 1 has an inertia about its axis only and link 3 violates the triangle inequality, both as published.
    """
    return _shipped("puma560", root, welds)


def panda(*, root: str = "fixed", welds: str = "lump") -> Multibody:
    """Franka Emika Panda without gripper, arm of 7 hinges (nv 7), no rotor inertias.

    Source: franka_ros, franka_description 0.10.1; inertias identified by Gaz et al. 2019.
    """
    return _shipped("panda", root, welds)


def ur5(*, root: str = "fixed", welds: str = "lump") -> Multibody:
    """Universal Robots UR5, arm of 6 hinges (nv 6), no rotor inertias.

    Source: Universal_Robots_ROS2_Description 2.4.5; its rotational inertias are those of cylinders.
    """
    return _shipped("ur5", root, welds)


def a1(*, root: str = "free", welds: str = "lump") -> Multibody:
    """Unitree A1, four-legged robot of 12 hinges on a free trunk (nv 18; nv 12 with root="fixed"), no rotor inertias.

    Source: unitree_ros, a1_description.
    """
    return _shipped("a1", root, welds)


def g1(*, root: str = "free", welds: str = "lump") -> Multibody:
    """Unitree G1, humanoid of 29 hinges on a free pelvis (nv 35; nv 29 with root="fixed"), no rotor inertias.

    Source: unitree_ros, g1_description, g1_29dof_rev_1_0.
    """
    return _shipped("g1", root, welds)


def _shipped(name: str, root: str, welds: str) -> Multibody:
    with as_file(files(__package__) / f"{name}.urdf") as path:
        # Warnings, about violations in the PUMA's published values, are suppressed on purpose; docs/robots.md explains them.
        model, _ = read(path, root=root, welds=welds)
    return model
