"""Twelve double pendulums released within a milliradian: they stay together at first, then diverge."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

scene = pc.mechanisms.double_pendulum()
figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
t = np.linspace(0, 14, 500)
for offset in np.linspace(0, 1e-3, 12):
    run = scene.simulate(14.0, [-1.2 + offset, 0.2], [0.0, 0.0], rtol=1e-9, t_eval=t)
    axes.plot(t, run.q[:, 1], lw=0.7, color=plt.cm.viridis(offset * 1e3))
axes.set(title="a milliradian apart", xlabel="t, s", ylabel="angle of the lower rod, rad")
