"""Model descriptions for tests: parts to type a mechanism by hand, random trees, and the kinematics of their coordinates.

The format is that of `pycraft.reference`. Nothing here uses the package, and equal seeds give equal models.
"""

import numpy as np

Q_SIZE = {"pin": 1, "slider": 1, "screw": 1, "ball": 4, "free": 7}
V_SIZE = {"pin": 1, "slider": 1, "screw": 1, "ball": 3, "free": 6}
KINDS = ("weld", "pin", "slider", "screw", "universal", "gimbal", "cylindrical", "planar", "ball", "free", "custom")


# Parts ----------------------------------------------------------------------------------------------------------------


def subhinge(kind, axis=(0, 0, 1), point=(0, 0, 0), pitch=0.0):
    """One subhinge; the axis is normalised."""
    axis = np.asarray(axis, float) / np.linalg.norm(axis)
    return {"kind": kind, "axis": axis, "point": np.asarray(point, float), "pitch": float(pitch)}


def body(
    name,
    parent,
    subhinges,
    mass=1.0,
    com=(0, 0, 0),
    inertia=((0, 0, 0),) * 3,
    position=(0, 0, 0),
    rotation=((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    rotor=None,
    kind="custom",
):
    """One body on a hinge named "<name>_hinge", placed in its parent by position and rotation; a point mass without inertia."""
    size = sum(V_SIZE[s["kind"]] for s in subhinges)
    hinge = {
        "name": f"{name}_hinge",
        "kind": kind,
        "subhinges": list(subhinges),
        "placement": {"rotation": np.asarray(rotation, float), "position": np.asarray(position, float)},
        "rotor_inertia": np.zeros(size) if rotor is None else np.asarray(rotor, float),
    }
    return {
        "name": name,
        "parent": parent,
        "mass": float(mass),
        "com": np.asarray(com, float),
        "inertia": np.asarray(inertia, float),
        "hinge": hinge,
    }


def model(bodies, gravity=(0, 0, 0), nodes=(), name="model"):
    """The description of the given bodies."""
    return {"name": name, "gravity": np.asarray(gravity, float), "bodies": list(bodies), "nodes": list(nodes)}


# Random models --------------------------------------------------------------------------------------------------------


def random_unit(rng):
    """A direction, uniform on the sphere."""
    x = rng.normal(size=3)
    return x / np.linalg.norm(x)


def random_rotation(rng):
    """An orthonormal, right-handed (3, 3) matrix."""
    x = random_unit(rng)
    y = np.cross(random_unit(rng), x)
    y /= np.linalg.norm(y)
    return np.column_stack([x, y, np.cross(x, y)])


def random_inertia(rng, mass):
    """Inertia about the centre of mass of six equal point masses within about 0.3 m: any such is physically possible."""
    points = 0.3 * rng.normal(size=(6, 3))
    points -= points.mean(axis=0)
    return mass / 6 * sum(p @ p * np.eye(3) - np.outer(p, p) for p in points)


def random_subhinges(kind, rng):
    """Subhinges of a hinge of a kind of `KINDS`, or of a sequence of subhinge kinds such as ("ball", "slider")."""

    def draw(subhinge_kind, axis=None, point=None):
        axis = random_unit(rng) if axis is None else axis
        point = 0.3 * rng.normal(size=3) if point is None else point
        if subhinge_kind == "free":
            point = np.zeros(3)  # it turns about no point
        return subhinge(subhinge_kind, axis, point, 0.2 * rng.normal() if subhinge_kind == "screw" else 0.0)

    if kind == "cylindrical":
        axis, point = random_unit(rng), 0.3 * rng.normal(size=3)
        return [draw("pin", axis, point), draw("slider", axis, point)]
    if kind == "planar":
        x, y, z = random_rotation(rng).T
        return [draw("slider", x), draw("slider", y), draw("pin", z)]
    sequences = {"weld": (), "universal": ("pin", "pin"), "gimbal": ("pin", "pin", "pin"), "custom": ("pin", "slider", "pin")}
    sequence = sequences.get(kind, (kind,)) if isinstance(kind, str) else kind
    return [draw(subhinge_kind) for subhinge_kind in sequence]


def random_description(parents, kinds, seed, rotor_inertia=False):
    """A random tree: bodies "body0", ..., hinges "hinge0", ..., a node on every body ("node0", ...) and one on the base.

    Parameters
    ----------
    parents : index of each body's parent, −1 for the base; parents come before children
    kinds : a kind of `KINDS`, or a sequence of subhinge kinds, for each body's hinge
    seed : of the generator of poses, axes, points and inertias (all physically possible)
    rotor_inertia : whether hinges have one, per coordinate; zero otherwise
    """
    rng = np.random.default_rng(seed)
    bodies, nodes = [], []
    for k, (parent, kind) in enumerate(zip(parents, kinds, strict=True)):
        subhinges, mass = random_subhinges(kind, rng), rng.uniform(0.5, 3.0)
        com, inertia = 0.2 * rng.normal(size=3), random_inertia(rng, mass)
        position, rotation = 0.5 * rng.normal(size=3), random_rotation(rng)
        rotor = rng.uniform(0.1, 1.0, sum(V_SIZE[s["kind"]] for s in subhinges)) if rotor_inertia else None
        label = kind if isinstance(kind, str) else "custom"
        bodies.append(body(f"body{k}", parent, subhinges, mass, com, inertia, position, rotation, rotor, label))
        bodies[-1]["hinge"]["name"] = f"hinge{k}"
    for k in range(-1, len(bodies)):
        name = "base_node" if k < 0 else f"node{k}"
        nodes.append({"name": name, "body": k, "rotation": random_rotation(rng), "position": 0.4 * rng.normal(size=3)})
    return model(bodies, (1.1, -2.3, -9.4), nodes, f"random{seed}")


# Coordinates ----------------------------------------------------------------------------------------------------------


def subhinge_list(description):
    """All subhinges in the order of the coordinates."""
    return [s for b in description["bodies"] for s in b["hinge"]["subhinges"]]


def sizes(description):
    """(nq, nv)."""
    kinds = [s["kind"] for s in subhinge_list(description)]
    return sum(Q_SIZE[k] for k in kinds), sum(V_SIZE[k] for k in kinds)


def random_state(description, seed):
    """q (nq,) and v (nv,), standard normal; quaternions are left without unit length on purpose."""
    rng = np.random.default_rng(seed)
    nq, nv = sizes(description)
    return rng.normal(size=nq), rng.normal(size=nv)


def quaternion_product(p, q):
    """p⊗q for quaternions (w, x, y, z)."""
    return np.array([p[0] * q[0] - p[1:] @ q[1:], *(p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:]))])


def rotate(q, x):
    """The vector x turned by the quaternion q of any length: q⊗(0, x)⊗q̄ / q·q."""
    return quaternion_product(quaternion_product(q, np.array([0, *x])), q * [1, -1, -1, -1])[1:] / (q @ q)


def coordinate_rates(description, q, v):
    """q̇ (nq,) of the generalized velocities v: v itself; ball ½q⊗(0, ω); free that and the linear velocity turned by q."""
    rates, i, j = [np.zeros(0)], 0, 0
    for kind in (s["kind"] for s in subhinge_list(description)):
        x, u = q[i : i + Q_SIZE[kind]], v[j : j + V_SIZE[kind]]
        i, j = i + Q_SIZE[kind], j + V_SIZE[kind]
        if kind in ("ball", "free"):
            rates.append(0.5 * quaternion_product(x[:4], np.array([0, *u[:3]])))
            rates.append(rotate(x[:4], u[3:]) if kind == "free" else np.zeros(0))
        else:
            rates.append(u)
    return np.concatenate(rates)
