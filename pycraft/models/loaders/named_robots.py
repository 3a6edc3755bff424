"""Robots by name, from the package and from installed packages of robot descriptions."""

from __future__ import annotations

import importlib.util
import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

from ... import _core
from .toml_file import nearest

ENDINGS = (".toml", ".urdf", ".xml", ".mjcf", ".sdf", ".xacro")
"""Endings of names of model files."""


def is_name(path: object) -> bool:
    """Return whether a text is the name of a robot: no file has this name, and it has no ending of a model file."""
    if not isinstance(path, str) or not path.strip() or path.lstrip().startswith("<") or "/" in path or "\\" in path or "\0" in path:
        return False
    return not path.lower().endswith(ENDINGS) and not Path(path).exists()


def find(name: str) -> Path | Any:
    """Return the file of the robot of this name, or the function that makes the package's own.

    The package's own robots have priority, then files of example-robot-data (`ur5_robot`, `anymal`), then modules of robot_descriptions
    (`ur5_description`), which download their files on first use.

    Raises
    ------
    ModelError
        No robot has this name: names the nearest ones.
    """
    from .. import robots

    if name in robots.names():
        return getattr(robots, name)
    if name in (files := example_robots()):
        return files[name]
    if name in described_robots():
        return _described(name)
    known = list(dict.fromkeys([*robots.names(), *files, *described_robots()]))
    near = nearest(name, known) if len(known) < 40 else nearest_of_many(name, known, robots.names())
    remedy = f"no file and no robot is called {name!r}; {near}"
    more = "" if files else "; more robots come with example-robot-data and robot_descriptions"
    raise _core.ModelError(f"{remedy} (robots of the package: {', '.join(robots.names())}{more})")


def nearest_of_many(name: str, known: list[str], few: list[str]) -> str:
    """Return the nearest names out of many; if none is near, those of `few`."""
    from difflib import get_close_matches

    near = get_close_matches(name.lower(), known, 3) or [other for other in known if name.lower() in other.lower()][:3]
    return f"did you mean {' or '.join(map(repr, near))}?" if near else f"there are {', '.join(few)}, ... ({len(known)} in all)"


@lru_cache(maxsize=1)
def example_robots() -> dict[str, Path]:
    """Return the URDF and SDF files of the installed example-robot-data by the names of the files; empty if it is not installed."""
    for folder in example_folders():
        found: dict[str, Path] = {}
        for ending in ("urdf", "sdf"):
            for file in sorted(folder.rglob(f"*.{ending}")):
                found.setdefault(file.stem, file)
        return found
    return {}


def example_folders() -> Iterator[Path]:
    """Yield the folders of robots of installed example-robot-data packages."""
    spec = importlib.util.find_spec("example_robot_data")
    near = [parent for parent in Path(spec.origin).parents if parent.name == "cmeel.prefix"] if spec and spec.origin else []
    for prefix in [*near, *(Path(entry) / "cmeel.prefix" for entry in sys.path)]:
        if (folder := prefix / "share" / "example-robot-data" / "robots").is_dir():
            yield folder


@lru_cache(maxsize=1)
def described_robots() -> tuple[str, ...]:
    """Return the names of the modules of the installed robot_descriptions; empty if it is not installed."""
    spec = importlib.util.find_spec("robot_descriptions")
    if spec is None or not spec.submodule_search_locations:
        return ()
    return tuple(sorted(file.stem for folder in spec.submodule_search_locations for file in Path(folder).glob("*_description.py")))


def _described(name: str) -> Path:
    try:
        module = importlib.import_module(f"robot_descriptions.{name}")
    except Exception as error:  # it clones a repository, which may fail in many ways
        raise _core.ModelError(f"robot_descriptions.{name} does not give its files: {type(error).__name__}: {error}") from error
    for attribute in ("URDF_PATH", "MJCF_PATH"):
        if path := getattr(module, attribute, None):
            return Path(path)
    raise _core.ModelError(f"robot_descriptions.{name} has neither a URDF_PATH nor an MJCF_PATH")
