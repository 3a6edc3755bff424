"""Missing files of an MJCF file: those for display or contact are omitted, those that determine a body's mass are an error."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from ... import _core


def without_missing_files(spec: Any, path: str) -> list[str]:
    """Remove meshes, height fields and textures with missing files from an `MjSpec`, if no inertia depends on them.

    A geom of a body with an `<inertial>`, or of the world, is removed with its mesh. Returns the removed items, each in words. ModelError
    for a missing mesh that determines a body's mass.
    """
    folder = Path(path).parent
    meshes = {mesh.name or Path(mesh.file).stem: mesh for mesh in spec.meshes if _missing(mesh.file, spec.meshdir, folder)}
    fields = {field.name or Path(field.file).stem: field for field in spec.hfields if _missing(field.file, spec.meshdir, folder)}
    textures = {
        texture.name or Path(texture.file).stem: texture for texture in spec.textures if _missing(texture.file, spec.texturedir, folder)
    }
    needed: dict[str, str] = {}
    left_out = []
    always = int(spec.compiler.inertiafromgeom) == 1  # mjINERTIAFROMGEOM_TRUE
    users: dict[str, list[Any]] = {}
    for body in spec.bodies:
        for geom in body.geoms:
            if (name := geom.meshname or geom.hfieldname) in meshes or name in fields:
                users.setdefault(name, []).append(geom)
                if body.parent is not None and (always or not body.explicitinertial):
                    needed.setdefault(name, body.name)
    for named, what in ((meshes, "mesh"), (fields, "height field")):
        for name, asset in named.items():
            if name in needed:
                remedy = "add the file, or give the body an <inertial>"
                raise _core.ModelError(
                    f"{path}: {what} {asset.file!r} is not there, and body {needed[name]!r} takes its mass from it; {remedy}"
                )
            for geom in users.get(name, ()):
                spec.delete(geom)
            spec.delete(asset)
            left_out.append(f"{what} {asset.file!r}")
    for name, texture in textures.items():
        left_out.append(f"texture {texture.file!r}")
        for material in spec.materials:
            material.textures = ["" if other == name else other for other in material.textures]
        spec.delete(texture)
    return left_out


def _missing(file: str, directory: str, folder: Path) -> bool:
    return bool(file) and not os.path.exists(folder / directory / file) and not os.path.exists(folder / file)
