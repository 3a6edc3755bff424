"""Kepler's ellipse by a variational integrator: twenty turns on one line."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

period = 2 * np.pi * np.sqrt(8.0e6**3 / 3.986004418e14)
scene = pc.mechanisms.kepler(eccentricity=0.4)
run = scene.simulate(20 * period, integrator="variational4", step=period / 200, t_eval=np.linspace(0, 20 * period, 4000))
x = scene.model.pose("satellite", run.q)[:, :3, 3] / 1e6
figure, axes = plt.subplots(figsize=(5, 3.8), layout="constrained")
axes.plot(x[:, 0], x[:, 1], color="#1f4e79", lw=0.8)
axes.plot(0, 0, "o", color="#c55a11")
axes.set(title="twenty orbits", xlabel="x, 1000 km", ylabel="y, 1000 km", aspect="equal")
