"""Methods of a scene for files and plain data."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .. import _core
from ..models.loaders.toml_file import nearest


class Filed:
    """Conversion of a scene to plain data and TOML, and back."""

    _run_options: Mapping[str, Any] = {}

    @property
    def run_options(self) -> dict[str, Any]:
        """Defaults of `pycraft run` for this scene, stored in a file's [run]: "T" (s), "integrator", "rtol", "atol",
        "step" (s), "every" (s between kept states). `simulate` uses only its own arguments. Can be set.
        """
        return dict(self._run_options)

    @run_options.setter
    def run_options(self, options: Mapping[str, Any]) -> None:
        from .file_format import RUN

        if not isinstance(options, Mapping):
            raise _core.ModelError(f"run_options must be a dictionary with some of {', '.join(RUN)}, not {options!r:.80}")
        if unknown := [key for key in options if key not in RUN]:
            raise _core.ModelError(f"run_options has no {unknown[0]!r}; {nearest(str(unknown[0]), RUN)}")
        self._run_options = dict(options)

    def to_dict(self, model: Any = None) -> dict[str, Any]:
        """Return the scene as plain data: numbers, texts, lists and dictionaries, with the keys of its file.

        Parameters
        ----------
        model : path of the model's file or name of a robot of the package, or a dictionary of either with options
            Reference to the model, which must equal the scene's; by default the data contain the model itself.

        Raises
        ------
        ModelError
            Effects with a Python function, by name; a `model` that differs from the scene's.

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
        """Return the scene described by `to_dict`. ModelError names the wrong part of the data, and the remedy."""
        from .file_reader import PlainData, read_scene

        return read_scene(PlainData(), data, Path(), "model")

    def save(self, path: str | os.PathLike[str], *, model: Any = None) -> None:
        """Write the scene to a readable TOML file, which `pycraft.load_scene` reads back bit for bit.

        Parameters
        ----------
        path : path of the file, ending in ".toml"; an existing file is replaced
        model : as in `to_dict`; a path is relative to the folder of the scene's file

        Raises
        ------
        ModelError
            As for `to_dict`; another ending; a file that cannot be written.
        """
        from .file_writer import save

        save(self, path, model)
