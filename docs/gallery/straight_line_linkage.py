"""Peaucellier's linkage, a closed chain: its pen stays on a straight line while the crank turns."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

scene = pc.mechanisms.peaucellier()
run = scene.simulate(1.2, t_eval=np.linspace(0, 1.2, 200))
figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
for body in scene.model.bodies:
    axes.plot(*scene.model.pose(body, run.q)[:, :2, 3].T, color="0.6", lw=1)
axes.plot(*scene.model.pose("pen", run.q)[:, :2, 3].T, color="#c55a11", lw=2, label="pen")
axes.set(title="Peaucellier's linkage: origins of its links", xlabel="x, m", ylabel="y, m", aspect="equal")
axes.legend()
