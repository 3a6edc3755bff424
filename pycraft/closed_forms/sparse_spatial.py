"""Spatial algebra in sparse matrices: skew matrices, cross products, poses and rotations, angular part first."""

from __future__ import annotations

from collections.abc import Sequence

import sympy

from ..proofs.rational import Rationals
from .sparse import Matrix

Pose = tuple[Matrix, Matrix]  # rotation (3, 3) and position (3, 1)


def skew(u: Matrix) -> Matrix:
    """Return ũ of a column (3, 1)."""
    x, y, z = (row.get(0, u.field.zero) for row in u.rows)
    rows = [{1: -z, 2: y}, {0: z, 2: -x}, {0: -y, 1: x}]
    return Matrix(u.field, [{j: e for j, e in row.items() if e} for row in rows], 3)


def in_blocks(a: Matrix | None, b: Matrix | None, c: Matrix | None, d: Matrix | None) -> Matrix:
    """Return [[a, b], [c, d]] of (3, 3) blocks, zero for None."""
    made = Matrix.zeros(next(x.field for x in (a, b, c, d) if x is not None), 6, 6)
    for i, j, block in ((0, 0, a), (0, 3, b), (3, 0, c), (3, 3, d)):
        if block is not None:
            made.place(slice(i, i + 3), slice(j, j + 3), block)
    return made


def skew_parts(x: Matrix) -> tuple[Matrix, Matrix]:
    """Return the angular and the linear part of a spatial vector, each as its skew matrix."""
    column = slice(0, 1)
    return skew(x.block(slice(0, 3), column)), skew(x.block(slice(3, 6), column))


def crm(x: Matrix) -> Matrix:
    """Return Ṽ: [[ω̃, 0], [ṽ, ω̃]]."""
    w, v = skew_parts(x)
    return in_blocks(w, None, v, w)


def crf(x: Matrix) -> Matrix:
    """Return V̄: [[ω̃, ṽ], [0, ω̃]] = −Ṽ*."""
    w, v = skew_parts(x)
    return in_blocks(w, v, None, w)


def momentum_cross(p: Matrix) -> Matrix:
    """Return 𝓑: −[[ñ, f̃], [f̃, 0]] of a momentum (n; f)."""
    n, f = skew_parts(p)
    return -in_blocks(n, f, f, None)


def force_transform(pose: Pose) -> Matrix:
    """Return φ(p,k): [[R, l̃R], [0, R]]."""
    R, l = pose
    return in_blocks(R, skew(l) @ R, None, R)


def composed(a: Pose, b: Pose) -> Pose:
    """Return the pose b of a frame relative to a frame with the pose a, composed."""
    return a[0] @ b[0], a[1] + a[0] @ b[1]


def still(field: Rationals) -> Pose:
    """Return the identity pose."""
    return Matrix.identity(field, 3), Matrix.zeros(field, 3, 1)


def rotation_of(field: Rationals, q: Sequence[sympy.Expr], unit: bool) -> Matrix:
    """Return R(q): (w² − u·u)I + 2uu* + 2wũ of the quaternion, over |q|² unless |q| is assumed to be 1."""
    w, x, y, z = q
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    length = 1 if unit else w * w + x * x + y * y + z * z
    return Matrix.of(field, [[e / length for e in row] for row in rows])
