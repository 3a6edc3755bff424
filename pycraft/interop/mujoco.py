"""MuJoCo's coordinates: the order and the axes of the state of free hinges. Only `compiled` needs MuJoCo itself.

                  here                                      MuJoCo
free, position    (w, x, y, z, x, y, z), in the parent      (x, y, z, w, x, y, z), in the world
free, velocity    twist in the body's axes: (ω; v)          (v; ω), v in world axes, ω in the body's axes
ball              (w, x, y, z); ω in the body's axes        the same
all others        one number per coordinate                 the same

Hinges must be in MuJoCo's order, as in a model loaded from an MJCF file. Free hinges are on the base, as MuJoCo requires.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from .. import _core
from .described import Described, described, theirs
from .packages import required


def compiled(path: str, prepare: Callable[[Any], None] | None = None) -> Any:
    """Return the MjModel that MuJoCo's compiler makes of an MJCF file.

    Parameters
    ----------
    path : path of the file
    prepare : function of the `MjSpec`, optional
        Modifies the parsed file before it is compiled.

    Raises
    ------
    MissingPackageError
        The mujoco package is not installed: names the extra.
    ModelError
        Anything that MuJoCo refuses, in its words.
    """
    if not isinstance(path, (str, Path)):
        raise _core.ModelError(f"an MJCF file is given by its path, not by {path!r:.60}")
    mujoco, path = required("mujoco", "mjcf", f"{path}: MJCF files are read by"), str(path)
    try:
        spec = mujoco.MjSpec.from_file(path)
        if prepare is not None:
            prepare(spec)
        return spec.compile()
    except (ValueError, IndexError, KeyError, TypeError, RuntimeError, mujoco.FatalError) as error:
        if isinstance(error, (_core.Error, UnicodeDecodeError)):
            raise
        said = " ".join(str(error).split())
        found = re.search(r", line (\d+)$", said)
        whole = found is not None and b"<include" not in Path(path).read_bytes()  # else the line may belong to another file
        raise _core.ModelError(f"{path}{f':{found[1]}' if found and whole else ''}: MuJoCo refuses the file: {said}") from None


def disabled(compiled_model: Any, feature: str) -> bool:
    """Return whether an MjModel disables a feature, by the name of its flag in MJCF: "gravity", "damper", ..."""
    mujoco = required("mujoco", "mjcf", "the flags of a MuJoCo model need")
    names = (feature, "passive") if feature in ("spring", "damper") else (feature,)  # one flag for both before MuJoCo 3.4
    return any(compiled_model.opt.disableflags & int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{name.upper()}", 0)) for name in names)


class _Free(NamedTuple):
    """The places of a free hinge in q and v, and the pose (4, 4) of its inboard frame in the world."""

    q: int
    v: int
    placement: np.ndarray


def _free_hinges(model: Described) -> Iterator[_Free]:
    for hinge in described(model, "a conversion of coordinates").hinges.values():
        if all(subhinge["kind"] != "free" for subhinge in hinge.subhinges):
            continue
        if len(hinge.subhinges) > 1 or hinge.body.parent is not None:
            text = f"hinge {hinge.name!r} of {model.name!r} is free and not alone on the base; MuJoCo has no such joint"
            raise _core.ModelError(text)
        yield _Free(hinge.q_slice.start, hinge.v_slice.start, hinge.placement)


def permutation(model: Described) -> tuple[np.ndarray, np.ndarray]:
    """Return MuJoCo's order of coordinates: `q[..., i]` is qpos and `v[..., j]` is in the order of qvel, i (nq,) and j (nv,).

    This is the whole conversion of positions if free hinges are placed at the world's origin; linear velocities of free
    hinges must be turned as well: see `to_mujoco`. Raises ModelError for a free hinge that is not on the base.
    """
    free_hinges = list(_free_hinges(model))
    i, j = np.arange(model.nq), np.arange(model.nv)
    for free in free_hinges:
        i[free.q : free.q + 7] = free.q + np.array([4, 5, 6, 0, 1, 2, 3])
        j[free.v : free.v + 6] = free.v + np.array([3, 4, 5, 0, 1, 2])
    return i, j


def to_mujoco(model: Described, q, v) -> tuple[np.ndarray, np.ndarray]:
    """Return qpos (..., nq) and qvel (..., nv) of the state q (..., nq), v (..., nv).

    Raises ModelError for a free hinge that is not on the base.

    Examples
    --------
    >>> import pycraft as pc
    >>> from pycraft.interop import mujoco
    >>> body = pc.chain(1, "free")
    >>> mujoco.to_mujoco(body, [1, 0, 0, 0, 5, 6, 7], [0, 0, 1, 2, 0, 0])[0]
    array([5., 6., 7., 1., 0., 0., 0.])
    """
    i, j = permutation(model)
    q, v = _sized(model, q, model.nq, "q"), _sized(model, v, model.nv, "v")
    qpos, qvel = q[..., i], v[..., j]
    for free in _free_hinges(model):
        R = free.placement[:3, :3]
        if not np.array_equal(free.placement, np.eye(4)):
            qpos[..., free.q : free.q + 3] = q[..., free.q + 4 : free.q + 7] @ R.T + free.placement[:3, 3]
            qpos[..., free.q + 3 : free.q + 7] = _product(_quaternion(R), q[..., free.q : free.q + 4])
        linear = slice(free.v, free.v + 3)
        qvel[..., linear] = _turn(R @ _rotations(q[..., free.q : free.q + 4]), qvel[..., linear])
    return qpos, qvel


def from_mujoco(model: Described, qpos, qvel) -> tuple[np.ndarray, np.ndarray]:
    """Return the state q (..., nq), v (..., nv) of MuJoCo's qpos (..., nq), qvel (..., nv): the inverse of `to_mujoco`."""
    i, j = permutation(model)
    qpos, qvel = _sized(model, qpos, model.nq, "qpos"), _sized(model, qvel, model.nv, "qvel")
    q, v = np.empty(qpos.shape), np.empty(qvel.shape)
    q[..., i], v[..., j] = qpos, qvel
    for free in _free_hinges(model):
        R = free.placement[:3, :3]
        if not np.array_equal(free.placement, np.eye(4)):
            q[..., free.q + 4 : free.q + 7] = (qpos[..., free.q : free.q + 3] - free.placement[:3, 3]) @ R
            q[..., free.q : free.q + 4] = _product(_quaternion(R) * [1, -1, -1, -1], qpos[..., free.q + 3 : free.q + 7])
        linear = slice(free.v + 3, free.v + 6)
        world = R @ _rotations(q[..., free.q : free.q + 4])
        v[..., linear] = _turn(np.swapaxes(world, -1, -2), v[..., linear])
    return q, v


def velocity_map(model: Described, q) -> np.ndarray:
    """Return T (nv, nv), orthogonal, with qvel = T v at the state q (nq,).

    Forces follow by duality, qfrc = T tau, and MuJoCo's mass matrix is T (ℳ + J) T*.
    """
    q = _sized(model, q, described(model, "velocity_map").nq, "q")
    return to_mujoco(model, np.broadcast_to(q, (model.nv, model.nq)), np.eye(model.nv))[1].T


def acceleration_to_mujoco(model: Described, q, v, vdot) -> np.ndarray:
    """Return qacc (nv,) of the accelerations vdot (nv,) at the state q (nq,), v (nv,): T v̇ + Ṫ v.

    MuJoCo's linear acceleration is the acceleration of the body's origin in world axes, R(v̇ + ω × v).
    """
    v, vdot = _sized(model, v, described(model, "acceleration_to_mujoco").nv, "v"), np.array(_sized(model, vdot, model.nv, "vdot"))
    for free in _free_hinges(model):
        angular, linear = slice(free.v, free.v + 3), slice(free.v + 3, free.v + 6)
        vdot[linear] += np.cross(v[angular], v[linear])
    return velocity_map(model, q) @ vdot


def name_of(compiled_model: Any) -> str:
    """Return the name of an MjModel: the first of its names."""
    return bytes(theirs(compiled_model, "njnt", "name_of", "an MjModel").names).split(b"\0", 1)[0].decode() or "model"


def joint_names(hinge: Any) -> list[str]:
    """Return the names of a hinge's joints in MuJoCo, one for each subhinge."""
    return [hinge.name] if len(hinge.subhinges) == 1 else [f"{hinge.name}[{i}]" for i in range(len(hinge.subhinges))]


def order(model: Described, compiled_model: Any) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
    """Return the places of the entries of `to_mujoco` in the MjModel's qpos (nq,) and qvel (nv,), and the first joint of every hinge by
    name.

    Hinges are matched by the name of their first joint, else by the name of the body. Raises ModelError for a joint that only one of the
    two has, and for matches with different numbers of coordinates.
    """
    mujoco = required("mujoco", "mjcf", "the order of MuJoCo's coordinates needs")
    theirs(compiled_model, "njnt", "order", "an MjModel")

    of_joint, of_body = (
        {mujoco.mj_id2name(compiled_model, kind, i) or f"{what}{i}": i for i in range(count)}
        for kind, what, count in (
            (mujoco.mjtObj.mjOBJ_JOINT, "joint", compiled_model.njnt),
            (mujoco.mjtObj.mjOBJ_BODY, "body", compiled_model.nbody),
        )
    )
    q, v, first = [], [], {}
    taken = 0
    for hinge in described(model, "order").hinges.values():
        size = hinge.v_slice.stop - hinge.v_slice.start
        if size == 0:
            continue
        joint = next((of_joint[name] for name in (hinge.name, f"{hinge.name}[0]") if name in of_joint), None)
        body = compiled_model.jnt_bodyid[joint] if joint is not None else of_body.get(hinge.body.name)
        if body is None or compiled_model.body_jntnum[body] == 0:
            raise _core.ModelError(f"hinge {hinge.name!r} of {model.name!r} has no joint in MuJoCo's model, and its body no joints")
        if compiled_model.body_dofnum[body] != size:
            text = f"hinge {hinge.name!r} has {compiled_model.body_dofnum[body]} velocities in MuJoCo and {size} here"
            raise _core.ModelError(text)
        first[hinge.name] = int(compiled_model.body_jntadr[body])
        q.append(compiled_model.jnt_qposadr[first[hinge.name]] + np.arange(hinge.q_slice.stop - hinge.q_slice.start))
        v.append(compiled_model.body_dofadr[body] + np.arange(size))
        taken += int(compiled_model.body_jntnum[body])
    if taken != compiled_model.njnt:
        raise _core.ModelError(f"MuJoCo's model has {compiled_model.njnt} joints, of which {taken} have a hinge in {model.name!r}")
    none = np.arange(0)
    return np.concatenate([none, *q]), np.concatenate([none, *v]), first


# Quaternions (w, x, y, z) with leading axes ---------------------------------------------------------------------------


def _sized(model: Described, x, size: int, name: str) -> np.ndarray:
    x = _core.real_array(x, f"{name} of {model.name!r}")
    if x.shape[-1:] != (size,):
        raise _core.ModelError(f"{name} of {model.name!r} takes {size} values, not an array {x.shape}")
    return x


def _rotations(q: np.ndarray) -> np.ndarray:
    """Return R(q/|q|), (..., 3, 3)."""
    length = np.linalg.norm(q, axis=-1, keepdims=True)
    if not np.all(length > 1e-8):
        raise _core.ModelError("a free hinge's quaternion has zero length; the identity is (1, 0, 0, 0)")
    w, x, y, z = np.moveaxis(q / length, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def _turn(R: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.einsum("...ij,...j->...i", R, x)


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    w, u, t, s = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    return np.concatenate([w * t - np.sum(u * s, -1, keepdims=True), w * s + t * u + np.cross(u, s)], axis=-1)


def _quaternion(R: np.ndarray) -> np.ndarray:
    """Return the quaternion of a rotation matrix: the eigenvector of Bar-Itzhack's matrix, well conditioned for every rotation."""
    K = np.array(
        [
            [np.trace(R), R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]],
            [0, R[0, 0] - R[1, 1] - R[2, 2], R[0, 1] + R[1, 0], R[0, 2] + R[2, 0]],
            [0, 0, R[1, 1] - R[0, 0] - R[2, 2], R[1, 2] + R[2, 1]],
            [0, 0, 0, R[2, 2] - R[0, 0] - R[1, 1]],
        ]
    )
    return np.linalg.eigh(K, UPLO="U")[1][:, -1]
