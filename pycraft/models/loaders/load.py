"""Models from files: `load` looks into the file and hands it to the reader of its format."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np

from ... import _core
from ..multibody import Multibody
from ..warning import warn
from . import toml_reader, urdf
from .left_aside import told
from .toml_file import TomlFile
from .xml_file import XmlFile

_OPTIONS = {"root": ("fixed", "free"), "mimic": ("refuse", "couple", "lock", "free"), "welds": ("lump", "keep", None)}


def load(
    path: str | os.PathLike[str],
    root: str = "fixed",
    mimic: str = "refuse",
    welds: str | None = None,
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    strict: bool = False,
    *,
    gravity: str | Sequence[float] | None = None,
) -> Multibody:
    """The model of a TOML file (`Multibody.save`), or of a URDF or MJCF file (which of the two, its root element says).

    A TOML file holds a model as it was saved, gravity and state with it. From the others hinges carry the file's joint names,
    bodies its link names, the model the robot's name. Children come in the order of their joint elements, depth first.
    Gravity is zero until it is set, also where the file gives it; damping, friction, springs and bounds on efforts and
    velocities are effects: a warning tells which of them the file has, and `Multibody.left_aside` has their numbers,
    `Multibody.actuators` those of actuators, and `pycraft.effects.from_model` makes effects of them. Contacts are not read.

    Parameters
    ----------
    path : path of the file
        One whose name ends in ".toml" is read as TOML.
    root : {"fixed", "free"}
        What carries the root link: the base, or a free hinge called "root" whose body has the root link's name. A link of no
        mass with a floating joint called "root" is free already. MJCF and TOML files say so themselves; for them there is
        only "fixed".
    mimic : {"refuse", "couple", "lock", "free"}
        A joint that follows another: an error that names it; a joint of its own with a coupling in `Multibody.loops`, called
        as the joint is; a weld where it stands when the other joint is at zero; a joint that moves on its own.
    welds : {"lump", "keep"}
        A link on a fixed joint becomes part of the body that moves it and a node with its name (a fixed root link becomes
        a node of the base), or stays a body with no coordinates. Both give the same mass matrix. Left out: what a TOML file
        says, "lump" of others.
    package_dirs : folders
        Where packages of "package://" names lie. No mesh is opened to load a URDF file; the viewer looks for those of `Multibody.shapes`
        there: see `pycraft.models.loaders.urdf.resolve_package`.
    strict : bool
        An inertia that violates the triangle inequality is an error instead of a warning.
    gravity : (3,) m/s², or "file"
        The model's gravity; "file": what an MJCF file says. Left out: what a TOML file says, zero of others.

    Warns
    -----
    ModelWarning
        Once each, with file and line: inertias that violate the triangle inequality, massless bodies on hinges, limits
        that are the wrong way round; constraints of an MJCF file that are left out. Once for a file: what is left aside.

    Raises
    ------
    ModelError
        Whatever the file gets wrong, with file, line, element or key, and remedy; in an MJCF file what MuJoCo refuses.
    MissingPackageError
        An MJCF file without the package mujoco (extra `mjcf`).

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.load("arm.urdf")  # doctest: +SKIP
    """
    model, words = read(path, root=root, mimic=mimic, welds=welds, package_dirs=package_dirs, strict=strict)
    _set_gravity(model, gravity, path)
    if text := told(model.left_aside, model):
        words = [*words, f"{os.fsdecode(path)}: {text}"]
    for text in words:
        warn(text)
    return model


def _set_gravity(model: Multibody, gravity: str | Sequence[float] | None, path: str | os.PathLike[str]) -> None:
    if isinstance(gravity, str):
        if gravity != "file":
            raise _core.ModelError(f"gravity={gravity!r}: three numbers in m/s², or 'file'")
        if model.gravity.any():  # of a TOML file
            return
        if "gravity" not in model.left_aside:
            text = "gravity='file', and the file says none; a URDF file never does: give three numbers"
            raise _core.ModelError(f"{os.fsdecode(path)}: {text}")
        model.gravity = model._left_aside.pop("gravity")
    elif gravity is not None:
        model.gravity = gravity
        model._left_aside.pop("gravity", None)


def read(
    path: str | os.PathLike[str],
    *,
    root: str = "fixed",
    mimic: str = "refuse",
    welds: str | None = None,
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    strict: bool = False,
) -> tuple[Multibody, list[str]]:
    """The model of a file and what `load` warns of, for callers that know the file and decide themselves what to say."""
    for option, value in (("root", root), ("mimic", mimic), ("welds", welds)):
        if value not in _OPTIONS[option]:
            raise _core.ModelError(f"{option}={value!r}: there are {', '.join(repr(known) for known in _OPTIONS[option] if known)}")
    with _no_collection():
        if is_toml(path):
            return toml_reader.read(TomlFile(path), root=root, welds=welds, strict=strict)
        return _read(XmlFile(path), root, mimic, welds or "lump", strict, package_dirs)


def is_toml(path: object) -> bool:
    """Whether a path is that of a TOML file: by how its name ends."""
    return isinstance(path, (str, bytes, os.PathLike)) and os.fsdecode(path).lower().endswith(".toml")


@contextmanager
def _no_collection() -> Iterator[None]:
    """No search for garbage meanwhile: a file of 10⁵ links makes objects by the million, all of which are in use."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()


def _read(
    file: XmlFile, root: str, mimic: str, welds: str, strict: bool, package_dirs: Sequence[str | os.PathLike[str]]
) -> tuple[Multibody, list[str]]:
    if file.root_name == "robot":
        with np.errstate(over="ignore", invalid="ignore"):  # what is not finite then is refused, with its line
            return urdf.read(file, root=root, mimic=mimic, welds=welds, strict=strict, package_dirs=package_dirs)
    if file.root_name == "mujoco":
        from . import mjcf  # its package is an extra

        with np.errstate(over="ignore", invalid="ignore"):
            return mjcf.read(file, root=root, welds=welds, strict=strict)
    text = f"<{file.root_name}> is the root element of no format that is read; there are <robot> (URDF) and <mujoco> (MJCF)"
    raise file.error(file.root, text)
