"""Precession and nutation of a heavy top under gravity: the path of its centre of mass."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

scene = pc.mechanisms.heavy_top()
run = scene.simulate(2.0, rtol=1e-9, t_eval=np.linspace(0, 2, 2000))
centre = scene.model.pose("top", run.q)[:, :3, 1]  # one metre along the axis y
figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
axes.plot(np.unwrap(np.arctan2(centre[:, 1], centre[:, 0])), centre[:, 2], color="#c55a11", lw=1)
axes.set(title="the centre of mass of a heavy top", xlabel="azimuth, rad", ylabel="height, m")
