"""Accuracy against time for every form of the articulated-inertia sweep, on an arm with a heavy tip."""

import pycraft as pc

arm = pc.chain(6, seed=0)
arm.bodies[list(arm.bodies)[-1]].mass = 1e6
pc.accuracy(arm, seconds=0.002, precisions=["single", "double"]).plot()
