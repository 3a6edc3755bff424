"""Models from files: `load` looks into the file and hands it to the reader of its format."""

from __future__ import annotations

import os
from collections.abc import Sequence

from .. import _core
from . import urdf
from .multibody import Multibody
from .warning import warn
from .xml_file import XmlFile

_OPTIONS = {"root": ("fixed", "free"), "mimic": ("refuse", "lock", "free"), "welds": ("lump", "keep")}


def load(
    path: str | os.PathLike[str],
    root: str = "fixed",
    mimic: str = "refuse",
    welds: str = "lump",
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    strict: bool = False,
) -> Multibody:
    """The model of a URDF or MJCF file (which of the two, its root element says).

    Hinges carry the file's joint names, bodies its link names, the model the robot's name. Children come in the order of
    their joint elements, depth first. Gravity is zero until it is set, also where the file gives it; damping, friction,
    motors and contacts are effects and are not read.

    Parameters
    ----------
    path : path of the file
    root : {"fixed", "free"}
        What carries the root link: the base, or a free hinge called "root" whose body has the root link's name. An MJCF
        file says so itself; for it there is only "fixed".
    mimic : {"refuse", "lock", "free"}
        A joint that follows another: an error that names it; a weld where it stands when the other joint is at zero; a
        joint that moves on its own.
    welds : {"lump", "keep"}
        A link on a fixed joint becomes part of the body that moves it and a node with its name (a fixed root link becomes
        a node of the base), or stays a body with no coordinates. Both give the same mass matrix.
    package_dirs : folders
        Where packages of "package://" names lie. No mesh is opened to load a URDF file: see
        `pycraft.models.urdf.resolve_package`.
    strict : bool
        An inertia that violates the triangle inequality is an error instead of a warning.

    Warns
    -----
    ModelWarning
        Once each, with file and line: inertias that violate the triangle inequality, massless bodies on hinges, limits
        that are the wrong way round; constraints of an MJCF file that are left out.

    Raises
    ------
    ModelError
        Whatever the file gets wrong, with file, line, element and remedy; in an MJCF file what MuJoCo refuses.
    MissingPackageError
        An MJCF file without the package mujoco (extra `mjcf`).

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.load("arm.urdf")  # doctest: +SKIP
    """
    model, words = read(path, root=root, mimic=mimic, welds=welds, package_dirs=package_dirs, strict=strict)
    for text in words:
        warn(text)
    return model


def read(
    path: str | os.PathLike[str],
    *,
    root: str = "fixed",
    mimic: str = "refuse",
    welds: str = "lump",
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    strict: bool = False,
) -> tuple[Multibody, list[str]]:
    """The model of a file and what `load` warns of, for callers that know the file and decide themselves what to say."""
    for option, value in (("root", root), ("mimic", mimic), ("welds", welds)):
        if value not in _OPTIONS[option]:
            raise _core.ModelError(f"{option}={value!r}: there are {', '.join(map(repr, _OPTIONS[option]))}")
    file = XmlFile(path)
    if file.root_name == "robot":
        return urdf.read(file, root=root, mimic=mimic, welds=welds, strict=strict)
    if file.root_name == "mujoco":
        from . import mjcf  # its package is an extra

        return mjcf.read(file, root=root, welds=welds, strict=strict)
    text = f"<{file.root_name}> is the root element of no format that is read; there are <robot> (URDF) and <mujoco> (MJCF)"
    raise file.error(file.root, text)
