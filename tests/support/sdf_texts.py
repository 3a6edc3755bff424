"""Random trees as SDF: every pose relative to a frame that was drawn, every axis expressed in one; the model itself is the truth."""

import numpy as np
from scipy.spatial.transform import Rotation

import pycraft as pc

TYPES = {"pin": "revolute", "slider": "prismatic", "screw": "screw", "ball": "ball", "universal": "universal", "weld": "fixed"}


def numbers(values):
    return " ".join(repr(float(x)) for x in np.ravel(values))


def pose_text(X, rng, relative_to=""):
    """A <pose> by angles in radians or degrees, or by a quaternion."""
    rotation = Rotation.from_matrix(X[:3, :3])
    attribute = f' relative_to="{relative_to}"' if relative_to else ""
    match int(rng.integers(3)):
        case 0:
            return f"<pose{attribute}>{numbers([*X[:3, 3], *rotation.as_euler('xyz')])}</pose>"
        case 1:
            return f'<pose{attribute} degrees="true">{numbers([*X[:3, 3], *np.degrees(rotation.as_euler("xyz"))])}</pose>'
        case _:
            return f'<pose{attribute} rotation_format="quat_xyzw">{numbers([*X[:3, 3], *rotation.as_quat()])}</pose>'


def random_pose(rng):
    X = np.eye(4)
    X[:3, :3], X[:3, 3] = Rotation.random(random_state=rng).as_matrix(), rng.normal(size=3)
    return X


def tree_as_sdf(model, seed, version="1.9"):
    """The text of an SDF file of a tree on a fixed base, and where its frames lie in the world at coordinates zero."""
    rng = np.random.default_rng(seed)
    bodies = model.description()["bodies"]
    frames = {"__model__": random_pose(rng)}  # the model's own pose in the world
    made, outer = [], pose_text(frames["__model__"], rng)
    loose = [f"frame{k}" for k in range(4)]

    def placed(name, X, element, inside="", default="__model__"):
        """An element with a pose relative to a frame that is there already, or to its default."""
        known = list(frames)
        chosen = known[int(rng.integers(len(known)))] if rng.random() < 0.7 else ""
        base = frames[chosen or default]
        frames[name] = X
        pose = pose_text(np.linalg.inv(base) @ X, rng, chosen)
        made.append(f"<{element}>{pose}{inside}</{element.split()[0]}>")

    for name in loose:
        placed(name, random_pose(rng), f'frame name="{name}"')
    world = {}
    for k, body in enumerate(bodies):
        parent = np.eye(4) if body["parent"] < 0 else world[body["parent"]]
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = body["hinge"]["placement"]["rotation"], body["hinge"]["placement"]["position"]
        world[k] = parent @ X
        R = Rotation.random(random_state=rng).as_matrix()
        moments = dict(
            zip(
                ("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), (R.T @ body["inertia"] @ R)[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], strict=True
            )
        )
        tensor = "".join(f"<{tag}>{value!r}</{tag}>" for tag, value in ((t, float(v)) for t, v in moments.items()))
        about = np.eye(4)
        about[:3, :3], about[:3, 3] = R, body["com"]
        inertial = f"<inertial>{pose_text(about, rng)}<mass>{float(body['mass'])!r}</mass><inertia>{tensor}</inertia></inertial>"
        placed(body["name"], world[k], f'link name="{body["name"]}"', inertial)
    for k, body in enumerate(bodies):
        hinge = body["hinge"]
        subhinges, kind = hinge["subhinges"], hinge["kind"]
        point = subhinges[-1]["point"] if subhinges else np.zeros(3)
        X = np.eye(4)
        X[:3, :3], X[:3, 3] = Rotation.random(random_state=rng).as_matrix(), world[k][:3, :3] @ point + world[k][:3, 3]
        parent = bodies[body["parent"]]["name"] if body["parent"] >= 0 else "world"
        inside = f"<parent>{parent}</parent><child>{body['name']}</child>"
        if kind == "screw":
            turn = 2 * np.pi * subhinges[0]["pitch"]
            inside += (
                f"<screw_thread_pitch>{turn!r}</screw_thread_pitch>"
                if rng.random() < 0.5
                else f"<thread_pitch>{-2 * np.pi / turn!r}</thread_pitch>"
            )
        for tag, subhinge in zip(("axis", "axis2"), subhinges if kind != "ball" else [], strict=False):
            known = [*frames, hinge["name"]]
            chosen = known[int(rng.integers(len(known)))] if rng.random() < 0.7 else ""
            R = X if chosen in ("", hinge["name"]) else frames[chosen]
            direction = R[:3, :3].T @ world[k][:3, :3] @ subhinge["axis"] * 2.5
            attribute = f' expressed_in="{chosen}"' if chosen else ""
            inside += f"<{tag}><xyz{attribute}>{numbers(direction)}</xyz></{tag}>"
        known = list(frames)
        placed(hinge["name"], X, f'joint name="{hinge["name"]}" type="{TYPES.get(kind, "revolute2")}"', inside, default=body["name"])
    order = rng.permutation(len(loose) + len(bodies))
    listed = [made[i] for i in order] + made[len(order) :]  # frames and links in any order, joints in theirs
    return f'<sdf version="{version}"><model name="{model.name}">{outer}{"".join(listed)}</model></sdf>', frames


def random_tree(seed, kinds=("pin", "slider", "screw", "ball", "universal"), size=7):
    rng = np.random.default_rng(seed)
    parents = [-1] + [int(rng.integers(-1, k)) for k in range(1, size)]
    return pc.tree(parents, [str(rng.choice(kinds)) for _ in range(size)], seed=seed)
