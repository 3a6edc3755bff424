"""Bodies with hardly any inertia along one coordinate: bobs, thin rods and their like, with I/mc² from 1e-8 to 1e-28.

A body whose inertia about a line through its hinge is a share of what it has across, on a ball, gimbal, universal, free hinge,
three pins in a row or a pin along that line; at the root or hung from a link, alone or with a body beyond; along an axis of
coordinates or askew; thin all round its centre, or about its own line alone. Forward dynamics under random torques, torques of
given accelerations, gravity alone, velocities alone, and all of these, against 100 digits. An answer is bad where it is off by more
than 1e-6 (the plain form: 1e-2) and by more than ten times what half a unit in the last place of the state, the torques, the lengths
and the inertias makes of the exact one.

    python tests/campaigns/faint.py --seeds 3
"""

import argparse
import copy
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import pycraft as pc

FORMS = ("fast", "ud", "square-root")
KINDS = ("ball", "gimbal", "universal", "free", "pins", "pin")
PLACES = ("root", "hung", "root, beyond", "hung, beyond")
SHARES = 10.0 ** -np.arange(8.0, 28.5)
BAD = {"fast": 1e-2, "ud": 1e-6, "square-root": 1e-6}
HALF = 2.0**-53


def thin(rng, share, kind, place, askew, all_round):
    """The model; None where it is refused as it is built."""
    arm, name, position = pc.Multibody("faint"), None, np.zeros(3)
    if place.startswith("hung"):
        arm.add_body("link", None, "pin", mass=1.0, axis=rng.normal(size=3), com=rng.normal(size=3), inertia=np.eye(3))
        name, position = "link", rng.normal(size=3)
    c, mass = rng.normal(size=3) if askew else np.array([0, 0, -1.0]), 10.0 ** rng.uniform(-3, 3)
    u, square = c / np.linalg.norm(c), mass * (c @ c)
    inertia = square * (share * np.eye(3) if all_round else (np.eye(3) - np.outer(u, u)) / 12 + share * np.outer(u, u))
    own = dict(mass=mass, com=c, inertia=(inertia + inertia.T) / 2)
    axes = np.linalg.qr(rng.normal(size=(3, 3)))[0] if askew else np.eye(3)
    try:
        if kind == "pins":
            for j in range(3):
                arm.add_body(f"pin{j}", name, "pin", axis=axes[j], position=position, **(own if j == 2 else dict(mass=0.0)))
                name, position = f"pin{j}", np.zeros(3)
        else:
            options = {"axis": u} if kind == "pin" else {}
            arm.add_body("thin", name, kind, position=position, **own, **options)
            name = "thin"
        if place.endswith("beyond"):
            axis = rng.normal(size=3) if kind == "pin" else u
            arm.add_body("beyond", name, "pin", axis=axis, position=0.7 * c, mass=mass, com=0.3 * c, inertia=share * square * np.eye(3))
    except pc.ModelError:
        return None
    arm.take_warnings()
    return arm


def loads(arm, state, rng):
    """Name -> (gravity, v, tau)."""
    n, none, down = arm.nv, (0.0, 0.0, 0.0), (0.3, 0.1, -9.81)
    v, tau = np.array(state.v), rng.normal(size=n)
    return {
        "torques": (none, 0 * v, tau),
        "torques of accelerations": (none, 0 * v, arm.mass_matrix(state.q) @ rng.normal(size=n)),
        "gravity": (down, 0 * v, 0 * v),
        "velocities": (none, v, 0 * v),
        "all": (down, v, tau),
    }


def exact(arm, q, v, tau):
    return arm.forward_dynamics(q, v, tau, form="ud", precision=100)


def off(got, truth):
    return float(np.linalg.norm(got - truth) / np.linalg.norm(truth))


def of_data(arm, q, v, tau, truth, rng):
    """How far half a unit in the last place of everything moves the exact answer: the largest of some draws of signs."""

    def moved(x):
        return np.asarray(x, float) * (1 + HALF * rng.choice([-1.0, 1.0], size=np.shape(x)))

    largest = 0.0
    for _ in range(4):
        other = copy.deepcopy(arm)
        for body in other.bodies.values():
            body.com = moved(body.com)
            shaken = moved(body.inertia)
            body.inertia = (shaken + shaken.T) / 2
        for hinge in other.hinges.values():
            pose = np.array(hinge.placement)
            pose[:3, 3] = moved(pose[:3, 3])
            hinge.placement = pose
        other.gravity = tuple(moved(arm.gravity))
        other.take_warnings()
        try:
            largest = max(largest, off(exact(other, moved(q), moved(v), moved(tau)), truth))
        except pc.SingularHingeError:
            return np.inf
    return largest


def bad(form, error, data):
    """Of what its own data do not tell to a digit (a shaft that coasts) nothing is bad."""
    return error is not None and error > max(BAD[form], 10 * data) and data < 0.1


def cases(seeds, kinds=KINDS, places=PLACES, shares=SHARES):
    for seed in seeds:
        for kind in kinds:
            for place in places:
                for askew in (False, True):
                    for all_round in (True, False):
                        for share in shares:
                            yield seed, kind, place, askew, all_round, share


def judged(seed, kind, place, askew, all_round, share, forms=FORMS):
    """Yields (form, load, error or None where refused, error of the data where the other is above its form's bound)."""
    rng = np.random.default_rng([seed, int(round(-10 * np.log10(share)))])
    arm = thin(rng, share, kind, place, askew, all_round)
    if arm is None:
        return
    state = arm.random_state(seed)
    for load, (gravity, v, tau) in loads(arm, state, rng).items():
        arm.gravity = gravity
        try:
            truth = exact(arm, state.q, v, tau)
        except pc.SingularHingeError:
            continue
        if not np.any(truth):
            continue
        data = None
        for form in forms:
            try:
                error = off(arm.forward_dynamics(state.q, v, tau, form=form), truth)
            except pc.SingularHingeError:
                yield form, load, None, 0.0
                continue
            if error > BAD[form] and data is None:
                data = of_data(arm, state.q, v, tau, truth, rng)
            yield form, load, error, data or 0.0


def run(seeds, **which):
    """(table: (form, share) -> [answers, refusals, worst error that is not the data's], bad answers, one line each)."""
    table, wrong = {}, []
    for case in cases(seeds, **which):
        for form, load, error, data in judged(*case):
            row = table.setdefault((form, case[-1]), [0, 0, 0.0])
            row[error is None] += 1
            if error is not None and error > 10 * data and data < 0.1:
                row[2] = max(row[2], error)
                if bad(form, error, data):
                    wrong.append(f"{form}, {load}: off by {error:.1e}, data {data:.1e}; {case}")
    return table, wrong


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=3)
    found, wrong = run(range(parser.parse_args().seeds))
    print("form         I/mc²   answers  refusals  worst")
    for (form, share), (answers, refusals, worst) in sorted(found.items(), key=lambda row: (row[0][0], -row[0][1])):
        print(f"{form:12} {share:.0e} {answers:8d} {refusals:9d}  {worst:.1e}")
    print("\n".join(wrong[:40]))
    sys.exit(f"{len(wrong)} bad answers" if wrong else 0)
