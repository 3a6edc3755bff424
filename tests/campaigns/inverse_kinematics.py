"""Inverse kinematics of random reachable poses of the package's arms: the table of docs/inverse_kinematics.md.

    python tests/campaigns/inverse_kinematics.py [--poses 1000] [--seed 0]

Poses are those of random configurations within limits; the search begins at the neutral configuration, and of those that are marked
"near" at one 0.2 rad from the pose's own in every coordinate. Reached means 1e-9 rad and 1e-9 m. CPU time, all poses in one call and
one call a pose.
"""

import argparse
from time import process_time

import numpy as np

import pycraft as pc

ARMS = {"panda": "panda_link8", "ur5": "wrist_3_link", "puma560": "link6"}


def seconds(call):
    began = process_time()
    value = call()
    return value, process_time() - began


def rows(poses, seed):
    rng = np.random.default_rng(seed)
    for name, end in ARMS.items():
        arm = getattr(pc.robots, name)()
        Q = np.array([arm.random_state(rng).q for _ in range(poses)])
        X = arm.pose(end, Q)
        near = arm.clamped(Q + 0.2 * rng.choice([-1, 1], Q.shape))
        arm.solve_ik({end: X[0]}, Q[0])  # what is imported and made once
        for start, q0, restarts in (("neutral", arm.neutral(), 0), ("neutral", arm.neutral(), 20), ("near", near, 20)):
            found, together = seconds(lambda: arm.solve_ik({end: X}, q0, restarts=restarts))  # noqa: B023 - called at once
            few = range(min(50, poses))
            _, apart = seconds(lambda: [arm.solve_ik({end: X[i]}, np.broadcast_to(q0, Q.shape)[i], restarts=restarts) for i in few])  # noqa: B023 - called at once
            yield (
                f"| {name} | {start} | {restarts} | {100 * np.mean(found.reached):.1f} | {int(np.median(found.iterations))} "
                f"| {np.mean(found.descents):.2f} | {1e3 * together / poses:.2f} | {1e3 * apart / len(few):.1f} |"
            )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--poses", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    for row in rows(given.poses, given.seed):
        print(row)
