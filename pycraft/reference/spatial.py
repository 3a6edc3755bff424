"""Spatial algebra, and the kinematics of hinges, of the oracle. See `pycraft.reference`."""

from functools import reduce

import numpy as np

from .numbers import converted, exponential, mpmath_context

Q_SIZE = {"pin": 1, "slider": 1, "screw": 1, "ball": 4, "free": 7}
V_SIZE = {"pin": 1, "slider": 1, "screw": 1, "ball": 3, "free": 6}


# Spatial algebra ------------------------------------------------------------------------------------------------------


def skew(u):
    """ũ, (3, 3): ũ w = u × w."""
    return np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])


def crm(V):
    """Ṽ, (6, 6), cross product of motions: [[ω̃, 0], [ṽ, ω̃]] for V = (ω; v)."""
    return np.block([[skew(V[:3]), np.zeros((3, 3))], [skew(V[3:]), skew(V[:3])]])


def crf(V):
    """V̄, (6, 6), cross product of a motion and a force: [[ω̃, ṽ], [0, ω̃]] = −Ṽ*."""
    return np.block([[skew(V[:3]), skew(V[3:])], [np.zeros((3, 3)), skew(V[:3])]])


def pose(rotation, position):
    """X, (4, 4): the frame with the given orientation and origin; X maps its coordinates to coordinates of the reference."""
    return np.block([[np.asarray(rotation), np.reshape(position, (3, 1))], [np.zeros((1, 3)), np.ones((1, 1))]])


def force_transform(X):
    """φ(p,k), (6, 6), carries forces from frame k to frame p: [[R, l̃R], [0, R]], X = (R, l) the pose of k in p."""
    R, l = X[:3, :3], X[:3, 3]
    return np.block([[R, skew(l) @ R], [np.zeros((3, 3)), R]])


def rotation_from_quaternion(q):
    """R(q), (3, 3): (w² − u·u)I + 2uu* + 2wũ of q/|q| = (w, u). Raises ValueError if |q| < 1e-8 or is not finite."""
    norm = np.dot(q, q) ** 0.5
    if not 1e-8 <= abs(norm) < np.inf:  # false for NaN as well
        raise ValueError(f"the quaternion {np.array2string(np.asarray(q))} has no direction")
    w, u = q[0] / norm, q[1:] / norm
    return (w * w - u @ u) * np.eye(3) + 2 * np.outer(u, u) + 2 * w * skew(u)


def quaternion_from_rotation(R):
    """A quaternion of the rotation R, of any length, from the largest of its four squares: 4w² = 1 + tr R, 4x² = 1 + 2R₀₀ − tr R, ..."""
    trace, (a, b, c) = np.trace(R), (R - R.T)[[2, 0, 1], [1, 2, 0]]
    symmetric = R + R.T + (1 - trace) * np.eye(3)
    i = np.argmax([trace, *np.diag(R)])
    return np.array([1 + trace, a, b, c]) if i == 0 else np.array([(a, b, c)[i - 1], *symmetric[i - 1]])


def spatial_inertia(body):
    """M(k), (6, 6): [[𝓘 − m c̃c̃, m c̃], [−m c̃, m I]], 𝓘 about the centre of mass c, about the body frame's origin."""
    m, c = body["mass"], skew(body["com"])
    return np.block([[np.asarray(body["inertia"]) - m * c @ c, m * c], [-m * c, m * np.eye(3)]])


# Hinges ---------------------------------------------------------------------------------------------------------------


def subhinge_rows(subhinge):
    """Rows of H of one subhinge, (n_v, 6), in the frame after its own step: axis a through the point c.

    pin (a; c×a), slider (0; a), screw (a; c×a + pitch a), ball (e_i; c×e_i), free: the identity.
    """
    a, c = np.asarray(subhinge["axis"]), np.asarray(subhinge["point"])
    return {
        "pin": lambda: np.array([[*a, *np.cross(c, a)]]),
        "slider": lambda: np.array([[0, 0, 0, *a]]),
        "screw": lambda: np.array([[*a, *(np.cross(c, a) + subhinge["pitch"] * a)]]),
        "ball": lambda: np.array([[*e, *np.cross(c, e)] for e in np.eye(3)]),
        "free": lambda: np.eye(6),
    }[subhinge["kind"]]()


def subhinge_step(subhinge, q):
    """Pose of the frame after the subhinge in the frame before it, (4, 4), at its coordinates q (Q_SIZE of its kind).

    pin, slider, screw: exp(h q) on SE(3); ball: R(q) about the point c, which stays; free: (R(q₀..₃), q₄..₆).
    """
    if subhinge["kind"] == "free":
        return pose(rotation_from_quaternion(q[:4]), q[4:])
    if subhinge["kind"] == "ball":
        R, c = rotation_from_quaternion(q), np.asarray(subhinge["point"])
        return pose(R, c - R @ c)
    (h,) = subhinge_rows(subhinge)
    return exponential(np.block([[skew(h[:3]), h[3:, None]], [np.zeros((1, 4))]]) * q[0])


def hinge_kinematics(body, q):
    """X, (4, 4), the body frame in the parent's frame: placement · step₁(q₁) · step₂(q₂) · ..., and the rows of H(k).

    One (n_v, 6) array of rows per subhinge, carried to the body frame: h_j' = φ*(later steps) h_j.
    Raises ValueError, naming hinge and body, for a quaternion without direction.
    """
    hinge = body["hinge"]
    pieces = split(q, [Q_SIZE[s["kind"]] for s in hinge["subhinges"]])
    try:
        steps = [subhinge_step(s, x) for s, x in zip(hinge["subhinges"], pieces, strict=True)]
    except ValueError as error:
        raise ValueError(f"hinge '{hinge['name']}' of body '{body['name']}': {error}") from None
    X, rows = pose(**hinge["placement"]), []
    for j, subhinge in enumerate(hinge["subhinges"]):
        X = X @ steps[j]
        later = reduce(np.matmul, steps[j + 1 :], np.eye(4))
        rows.append(subhinge_rows(subhinge) @ force_transform(later))  # (φ*h)* = h*φ
    return X, rows


def split(x, sizes):
    """Return the array x cut into consecutive pieces of the given sizes; ValueError unless they add up to its length."""
    x, ends = np.asarray(x), np.cumsum(np.array(sizes, int))
    if x.shape != (sum(sizes),):
        raise ValueError(f"expected an array of shape ({sum(sizes)},), got {x.shape}")
    return [x[end - size : end] for end, size in zip(ends, sizes, strict=True)]


def hinge_sizes(description, table):
    """Return the number of coordinates of each body's hinge: table is Q_SIZE (sums to nq) or V_SIZE (sums to nv)."""
    return [sum(table[s["kind"]] for s in body["hinge"]["subhinges"]) for body in description["bodies"]]


def in_the_numbers_of(q, description):
    """Return the description in the numbers of q: doubles are exact, except unit axes and orthogonal rotations, computed to the digits."""
    context = mpmath_context(np.asarray(q))
    if context is None:
        return description

    def number(x):
        return converted(np.asarray(x, float), context)[()]

    def subhinge(s):
        axis = number(s["axis"])
        return {**s, "axis": axis / (axis @ axis) ** 0.5, "point": number(s["point"]), "pitch": number(s["pitch"])}

    def placed(x):
        return {"rotation": rotation_from_quaternion(quaternion_from_rotation(number(x["rotation"]))), "position": number(x["position"])}

    def hinge(h):
        rotors, subhinges = number(h["rotor_inertia"]), [subhinge(s) for s in h["subhinges"]]
        return {**h, "rotor_inertia": rotors, "placement": placed(h["placement"]), "subhinges": subhinges}

    bodies = [{**b, "hinge": hinge(b["hinge"]), **{x: number(b[x]) for x in ("mass", "com", "inertia")}} for b in description["bodies"]]
    nodes = [{**node, **placed(node)} for node in description["nodes"]]
    return {**description, "gravity": number(description["gravity"]), "bodies": bodies, "nodes": nodes}
