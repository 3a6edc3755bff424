"""Models from files: `load` detects the format of a file and calls its reader."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ... import _core
from ..multibody import Multibody
from ..warning import warn
from . import sdf, toml_reader, urdf
from .left_aside import told
from .named_robots import find, is_name
from .toml_file import TomlFile
from .xml_file import XmlFile

_OPTIONS = {"root": (None, "fixed", "free"), "mimic": ("couple", "refuse", "lock", "free"), "welds": ("lump", "keep", None)}


def load(
    path: str | os.PathLike[str],
    root: str | None = None,
    mimic: str = "couple",
    welds: str | None = None,
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    strict: bool = False,
    *,
    gravity: str | Sequence[float] | None = None,
) -> Multibody:
    """Load the model of a TOML, URDF, SDF or MJCF file, or a robot by its name.

    The root element of an XML file determines its format. A TOML file holds a model as `Multibody.save` wrote it, including gravity and
    state. From the other formats hinges take the file's joint names, bodies its link names, and the model the robot's name. Children are in
    the order of their joint elements, depth first. Gravity is zero until it is set, even if the file gives it. Damping, friction, springs,
    actuators and bounds on efforts and velocities are effects: a warning names the file's, and `pycraft.effects.from_model` makes
    effects of them. `Multibody.not_read` names elements that change motions elsewhere and are not read, such as contacts.

    Parameters
    ----------
    path : path of the file, or name of a robot
        A file name that ends in ".toml" is read as TOML. A name is one of `pycraft.robots.names()`, the name of a file of the installed
        example-robot-data ("anymal"), or a module of the installed robot_descriptions ("ur5_description").
    root : {"fixed", "free"}
        The carrier of the root link of a URDF or SDF file: the base, or a free hinge called "root" with a body that has the root link's
        name. By default the root is fixed, except for a package robot that flies, and a warning reports a root link with mass. A massless
        link with a floating joint called "root" is free already. MJCF and TOML files specify this themselves; for them the only value is
        "fixed".
    mimic : {"couple", "refuse", "lock", "free"}
        A joint that follows another becomes: a joint of its own with a coupling in `Multibody.loops` of the same name; an error; a weld at
        its position with the other joint at zero; an independent joint.
    welds : {"lump", "keep"}
        "lump": a link on a fixed joint becomes part of the body that moves it, and a node with its name (a fixed root link becomes a node
        of the base). "keep": it stays a body without coordinates. Both give the same mass matrix. Default: as a TOML file specifies, "lump"
        for the others.
    package_dirs : folders
        Locations of packages of "package://" names. Loading a URDF file opens no mesh; viewers look for the meshes of `Multibody.shapes`
        there: see `pycraft.models.loaders.urdf.resolve_package`.
    strict : bool
        Raise an error instead of a warning for an inertia that violates the triangle inequality.
    gravity : (3,) m/s², or "file"
        The model's gravity; "file" uses the gravity of an MJCF or SDF file. Default: the gravity of a TOML file, zero for the others.

    Warns
    -----
    ModelWarning
        Once each, with file and line: inertias that violate the triangle inequality, massless bodies on hinges, limits in the wrong order,
        elements that the reader ignores. Once for a file: a fixed root link with mass, data that are not part of the model, elements that
        are not read.

    Raises
    ------
    ModelError
        Any fault of the file, with file, line, element or key, and remedy; in an MJCF file anything that MuJoCo refuses; an unknown name.
    MissingPackageError
        An MJCF file without the package mujoco (extra `mjcf`).

    Examples
    --------
    >>> import pycraft as pc
    >>> arm = pc.load("arm.urdf")  # doctest: +SKIP
    >>> pc.load("ur5").nv
    6
    """
    _check_options(root, mimic, welds)
    if is_name(path):
        found = find(str(path))
        if callable(found):
            if strict:
                raise _core.ModelError(f"strict=True is for files; pycraft.robots.{path}() takes root and welds")
            return _package_robot(found, root, welds, gravity)
        path = found
    file = _opened(path)
    model, words = _read(file, root, mimic, welds, strict, package_dirs)
    _set_gravity(model, gravity, file)
    if said := told(model.left_aside, model):
        words = [*words, f"{file.path}: {said}"]
    for text in words:
        warn(text)
    return model


def _package_robot(make: object, root: str | None, welds: str | None, gravity: str | Sequence[float] | None) -> Multibody:
    options = {name: value for name, value in (("root", root), ("welds", welds)) if value is not None}
    model: Multibody = make(**options)  # type: ignore[operator]  # a function of pycraft.robots
    if isinstance(gravity, str):
        raise _core.ModelError(f"gravity={gravity!r}: the robots of the package have no gravity; give three numbers in m/s²")
    if gravity is not None:
        model.gravity = gravity
    return model


def _set_gravity(model: Multibody, gravity: str | Sequence[float] | None, file: TomlFile | XmlFile) -> None:
    if isinstance(gravity, str):
        if gravity != "file":
            raise _core.ModelError(f"gravity={gravity!r}: give three numbers in m/s², or 'file'")
        if model.gravity.any():  # of a TOML file
            return
        if "gravity" not in model.left_aside and getattr(file, "root_name", "robot") == "robot":
            text = "gravity='file', and the file gives none, as no URDF file does; give three numbers in m/s²"
            raise _core.ModelError(f"{file.path}: {text}")
        model.gravity = model._left_aside.pop("gravity", np.zeros(3))  # none if the file disables it
    elif gravity is not None:
        model.gravity = gravity
        model._left_aside.pop("gravity", None)


def read(
    path: str | os.PathLike[str],
    *,
    root: str | None = "fixed",
    mimic: str = "couple",
    welds: str | None = None,
    package_dirs: Sequence[str | os.PathLike[str]] = (),
    strict: bool = False,
) -> tuple[Multibody, list[str]]:
    """Return the model of a file and the warnings of `load`, for callers that decide themselves what to report."""
    _check_options(root, mimic, welds)
    return _read(_opened(path), root, mimic, welds, strict, package_dirs)


def _check_options(root: str | None, mimic: str, welds: str | None) -> None:
    for option, value in (("root", root), ("mimic", mimic), ("welds", welds)):
        if value not in _OPTIONS[option]:
            raise _core.ModelError(f"{option}={value!r}: there are {', '.join(repr(known) for known in _OPTIONS[option] if known)}")


def _opened(path: str | os.PathLike[str]) -> TomlFile | XmlFile:
    with _no_collection():
        return TomlFile(path) if is_toml(path) else XmlFile(path)


def is_toml(path: object) -> bool:
    """Check by its ending that a path is that of a TOML file."""
    return isinstance(path, (str, bytes, os.PathLike)) and os.fsdecode(path).lower().endswith(".toml")


@contextmanager
def _no_collection() -> Iterator[None]:
    """Suspend garbage collection: a file of 10⁵ links creates objects by the million, all of them in use."""
    searched = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if searched:
            gc.enable()


def _read(
    file: TomlFile | XmlFile,
    root: str | None,
    mimic: str,
    welds: str | None,
    strict: bool,
    package_dirs: Sequence[str | os.PathLike[str]],
) -> tuple[Multibody, list[str]]:
    with _no_collection(), np.errstate(over="ignore", invalid="ignore"):  # values that are not finite are refused, with their line
        if isinstance(file, TomlFile):
            return toml_reader.read(file, root=root or "fixed", welds=welds, strict=strict)
        try:
            model, words = _read_xml(file, root, mimic, welds or "lump", strict, package_dirs)
        except (_core.Error, MemoryError, RecursionError, ImportError):
            raise
        except Exception as error:  # of another package, or a case that no reader foresees
            text = f"the file cannot be read as a model ({type(error).__name__}: {error}); please report it together with the file"
            raise file.error(file.root, text) from error
        return model, [*file.warnings, *words]


def _read_xml(
    file: XmlFile, root: str | None, mimic: str, welds: str, strict: bool, package_dirs: Sequence[str | os.PathLike[str]]
) -> tuple[Multibody, list[str]]:
    if file.root_name == "robot":
        return urdf.read(file, root=root, mimic=mimic, welds=welds, strict=strict, package_dirs=package_dirs)
    if file.root_name == "sdf":
        return sdf.read(file, root=root, mimic=mimic, welds=welds, strict=strict, package_dirs=package_dirs)
    if file.root_name == "mujoco":
        from . import mjcf  # its package is an extra

        return mjcf.read(file, root=root or "fixed", welds=welds, strict=strict)
    if Path(file.path).suffix.lower() == ".xacro":
        text = "this is a part of a robot in xacro; expand the file that includes it: pip install xacro, then xacro file.xacro > file.urdf"
        raise file.error(file.root, text)
    formats = "there are <robot> (URDF), <sdf> (SDF) and <mujoco> (MJCF)"
    raise file.error(file.root, f"<{file.root_name}> is not the root element of a format that pycraft reads; {formats}")
