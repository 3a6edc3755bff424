"""Rotations as files give them, made into matrices: roll-pitch-yaw, quaternions, angles about an axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np


@lru_cache(maxsize=1 << 12)  # most of a large file's are few different ones
def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Rz(yaw) Ry(pitch) Rx(roll), (3, 3), read-only: turns about the fixed axes x, y, z in that order, angles in radians."""
    (cr, cp, cy), (sr, sp, sy) = map(math.cos, (roll, pitch, yaw)), map(math.sin, (roll, pitch, yaw))
    rotation = np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )
    rotation.setflags(write=False)
    return rotation


def rotation_from_quaternion(quaternion: Sequence[float] | np.ndarray) -> np.ndarray:
    """R(q), (3, 3), of the quaternion (w, x, y, z), which is used as q/|q|; the caller sees to it that |q| is not zero."""
    w, x, y, z = np.asarray(quaternion, float) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_about(axis: Sequence[float] | np.ndarray, angle: float) -> np.ndarray:
    """exp(ã angle), (3, 3), by Rodrigues' formula, for a unit axis a and an angle in radians."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * cross @ cross


def turned_inertia(rotation: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """R 𝓘 R*, (3, 3), symmetric to the last bit: one rounding off it costs the accurate forms all their accuracy."""
    turned = rotation @ inertia @ rotation.T
    return (turned + turned.T) / 2
