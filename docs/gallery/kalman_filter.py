"""The articulated-body recursion as a Kalman filter and smoother: a track, its measurements and its estimates."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

h = 0.1
track = pc.kalman(A=[[1, h], [0, 1]], B=[[h * h / 2], [h]], C=[[1, 0]], Q=2.0, R=0.3, x0=[0, 0], P0=np.eye(2), steps=120)
x, y = track.sample(seed=1)
t = h * np.arange(len(y))
figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
axes.plot(t, y, ".", color="0.6", label="measured")
axes.plot(t, np.asarray(x)[: len(t), 0], "k:", label="truth")
axes.plot(t, track.filter(y).filtered[:, 0], color="#c55a11", lw=1, label="filtered")
axes.plot(t, track.smooth(y).states[: len(t), 0], color="#1f4e79", lw=1, label="smoothed")
axes.set(title="a track", xlabel="t, s", ylabel="m")
axes.legend()
