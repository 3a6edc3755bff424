"""Convert rotations of files to matrices: roll-pitch-yaw, quaternions, angles about an axis."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Return Rz(yaw) Ry(pitch) Rx(roll), (3, 3), read-only: rotations about the fixed axes x, y, z in that order, angles in radians."""
    return _rotation_from_rpy(roll + 0.0, pitch + 0.0, yaw + 0.0)  # -0.0 equals 0.0 as a cache key, but not in sines


@lru_cache(maxsize=1 << 12)  # most rotations of a large file repeat
def _rotation_from_rpy(roll: float, pitch: float, yaw: float) -> np.ndarray:
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
    """Return R(q), (3, 3), of the quaternion (w, x, y, z), normalised to q/|q|; the caller checks that |q| is not zero."""
    w, x, y, z = np.asarray(quaternion, float) / np.linalg.norm(quaternion)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rotation_about(axis: Sequence[float] | np.ndarray, angle: float) -> np.ndarray:
    """Return exp(ã angle), (3, 3), by Rodrigues' formula, for a unit axis a and an angle in radians."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + 2 * np.sin(angle / 2) ** 2 * cross @ cross


def turned_inertia(rotation: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """Return R 𝓘 R*, (3, 3), symmetric to the last bit: an error of one rounding costs the accurate forms all their accuracy."""
    turned = rotation @ inertia @ rotation.T
    return (turned + turned.T) / 2


def nearest_rpy(rotation: np.ndarray) -> tuple[float, float, float]:
    """Return roll, pitch and yaw (rad) with `rotation_from_rpy` equal to the rotation to rounding, pitch within ±π/2.

    Roll is computed from the remainder after yaw and pitch, so that it keeps its digits where pitch is ±π/2 and yaw is undetermined.
    """
    R = np.asarray(rotation, float)
    yaw = math.atan2(R[1, 0], R[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    pitch = math.atan2(-R[2, 0], c * R[0, 0] + s * R[1, 0])
    roll = math.atan2(s * R[0, 2] - c * R[1, 2], c * R[1, 1] - s * R[0, 1])
    return roll, pitch, yaw


def rpy_of_rotation(rotation: np.ndarray) -> tuple[float, float, float] | None:
    """Return roll, pitch and yaw (rad) that give this rotation to the last bit, as a file's angles did; None if none are found."""
    bits, made = np.asarray(rotation, float).tobytes(), _rotation_from_rpy.__wrapped__
    found = nearest_rpy(rotation)
    roll, pitch, yaw = found
    for angles in (
        found,
        (roll + math.copysign(math.pi, -roll), math.copysign(math.pi, pitch) - pitch, yaw + math.copysign(math.pi, -yaw)),
    ):
        for digits in (15, 16, 17, 14, 12):  # angles in files have few digits, fewer than rounding adds
            rounded = round(angles[0], digits) + 0.0, round(angles[1], digits) + 0.0, round(angles[2], digits) + 0.0
            if made(*rounded).tobytes() == bits:
                return rounded
    return None
