"""A run for playback in other engines: triangles fixed on bodies, and the bodies' poses at the times of frames."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..models.shapes import Shape
from ..view.figure_data import upright
from ..view.skeleton import Skeleton, placed
from ..view.solids import solids, triangles
from .run_animation import configurations, positive
from .run_page import frame_times

STICK, JOINT = 0.012, 0.022
"""Radii of the sticks and balls that show bodies without shapes, as fractions of the model's reach."""
GREY, BLUE = "#b9c2cc", "#1f4e79"


def linear_colour(colour: str) -> list[float]:
    """Return linear red, green and blue from 0 to 1 of "#rrggbb", which is sRGB. [IEC 61966-2-1]"""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    return [x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4 for x in parts]


@dataclass
class Solid:
    """Triangles on a body, -1 the base.

    vertices (n, 3) in its frame, m; faces (m, 3); colour "#rrggbb".
    """

    of: int
    vertices: np.ndarray
    faces: np.ndarray
    colour: str


class AnimatedBodies:
    """The visible bodies of a run over time.

    Parameters
    ----------
    run : Run
    fps : frames per second of the film
    speed : seconds of the run per second of the film

    Attributes
    ----------
    names : names of the bodies
    times : (K,) s, times in the film, from 0
    rotations, positions : (K, n, 3, 3), (K, n, 3), poses of the bodies in the world, m
    solids : list of Solid: shapes of the model's file, sticks for bodies without shapes
    missing : list of str, why shapes are missing
    up : 0, 1 or 2, the upright axis of the world
    """

    def __init__(self, run: Any, fps: Any, speed: Any):
        rate, faster = positive(fps, "fps"), positive(speed, "speed")
        times = frame_times(run, rate / faster)
        self.model = run._unedited_model()
        self.times = (times - times[0]) / faster
        skeleton = Skeleton(self.model)
        self.names = skeleton.bodies
        poses = skeleton.poses(configurations(run, times))[:, :-1]
        self.rotations, self.positions = poses[..., :3, :3], poses[..., :3, 3]
        found, self.missing = solids(self.model, None)
        clad = {solid["of"] for solid in found}
        self.solids = [Solid(solid["of"], solid["vertices"], solid["faces"], solid["colour"] or GREY) for solid in found]
        self.solids += [stick for stick in _sticks(skeleton) if stick.of not in clad]
        self.up = upright(self.model)[1]

    def quaternions(self) -> np.ndarray:
        """Return quaternions x, y, z, w (K, n, 4), each with the sign nearer to the frame before, because players interpolate."""
        from scipy.spatial.transform import Rotation

        frames, count = self.rotations.shape[:2]
        q = Rotation.from_matrix(self.rotations.reshape(-1, 3, 3)).as_quat().reshape(frames, count, 4)
        turned = np.einsum("kni,kni->kn", q[1:], q[:-1]) < 0
        return np.asarray(q * np.where(np.concatenate([np.zeros((1, count)), np.cumsum(turned, axis=0)]) % 2, -1.0, 1.0)[..., None])


def _sticks(skeleton: Skeleton) -> list[Solid]:
    """Return capsules along the bones of the stick figure, and balls at its hinges."""
    poses = skeleton.poses(skeleton.model.zero_q())
    owners, places = skeleton.lines["bone"]
    joints, at = skeleton.points["joint"]
    seen = np.concatenate([placed(poses, owners, places).reshape(-1, 3), placed(poses, joints, at)])
    if not len(seen):
        return []
    reach = float(np.ptp(seen, axis=0).max()) or 1.0
    found = [
        Solid(int(of), *_capsule(a, b, STICK * reach), GREY)
        for (of, other), (a, b) in zip(owners, places, strict=True)
        if of == other and np.linalg.norm(b - a) > 1e-9 * reach
    ]
    ball, faces = triangles(Shape("", "sphere", (JOINT * reach,), np.eye(4)))
    return found + [Solid(int(of), ball + place, faces, BLUE) for of, place in zip(joints, at, strict=True)]


def _capsule(a: np.ndarray, b: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a capsule from a to b."""
    length = float(np.linalg.norm(b - a))
    vertices, faces = triangles(Shape("", "capsule", (radius, length), np.eye(4)))
    z = (b - a) / length
    x = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x /= np.linalg.norm(x)
    return vertices @ np.array([x, np.cross(z, x), z]) + (a + b) / 2, faces
