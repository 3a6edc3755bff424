"""The faces of a scene that lead to files and plain data."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import _core
from ..models.loaders.toml_file import nearest


class Filed:
    """A scene to plain data and TOML, and back."""

    _run_options: Mapping[str, Any] = {}

    @property
    def run_options(self) -> dict[str, Any]:
        """What `pycraft run` takes where its command line says nothing, and a file holds in [run]: "T" (s), "integrator", "rtol", "atol",
        "step" (s), "every" (s between the states that are kept). `simulate` takes its own arguments alone. Can be set.
        """
        return dict(self._run_options)

    @run_options.setter
    def run_options(self, options: Mapping[str, Any]) -> None:
        from .file_format import RUN

        if not isinstance(options, Mapping):
            raise _core.ModelError(f"run_options: a dictionary with some of {', '.join(RUN)}, not {options!r:.80}")
        if unknown := [key for key in options if key not in RUN]:
            raise _core.ModelError(f"run_options has no {unknown[0]!r}; {nearest(str(unknown[0]), RUN)}")
        self._run_options = dict(options)

    def to_dict(self, model: Any = None) -> dict[str, Any]:
        """The scene as plain data: numbers, texts, lists and dictionaries, with the keys of its file.

        Parameters
        ----------
        model : path of the model's file or name of a robot of the package, or a dictionary of either with options
            What names the model, which must be that of the scene; the model itself is in the data where left out.

        Raises
        ------
        ModelError
            Effects that hold a function of Python's, by name; a `model` that is another one.

        Examples
        --------
        >>> import pycraft as pc
        >>> scene = pc.Scene(pc.robots.panda()).add(pc.effects.Gravity(), pc.effects.Damping(0.1))
        >>> scene.to_dict(model="panda")["effects"]
        [{'effect': 'Gravity', 'name': 'gravity'}, {'effect': 'Damping', 'name': 'damping', 'coefficient': 0.1}]
        >>> pc.Scene.from_dict(scene.to_dict())
        <scene of 'panda': gravity, damping>
        """
        from .file_writer import scene_data

        return scene_data(self, model)

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Any:
        """The scene that `to_dict` describes. ModelError says which part of the data is wrong, and the remedy."""
        from .file_reader import PlainData, read_scene

        return read_scene(PlainData(), data, Path(), "model")

    def save(self, path: str | os.PathLike[str], *, model: Any = None) -> None:
        """Write the scene to a TOML file that a person reads and writes, and `pycraft.load_scene` reads back bit for bit.

        Parameters
        ----------
        path : path of the file, ending in ".toml"; a file that is there is replaced
        model : as in `to_dict`; a path is relative to the folder of the scene's file

        Raises
        ------
        ModelError
            As `to_dict`; another ending; a file that cannot be written.
        """
        from .file_writer import save

        save(self, path, model)
