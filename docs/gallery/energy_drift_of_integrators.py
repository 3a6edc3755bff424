"""The energy of a double pendulum: it drifts with Runge-Kutta and stays in a band with a variational integrator."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
for integrator, color in (("variational2", "#1f4e79"), ("rk4", "#c55a11")):
    run = pc.mechanisms.double_pendulum().simulate(100.0, integrator=integrator, step=0.04, t_eval=np.linspace(0, 100, 1000))
    axes.plot(run.t, run.balance - run.balance[0], color=color, lw=0.8, label=integrator)
axes.set(title="energy error, steps of 40 ms", xlabel="t, s", ylabel="J")
axes.legend()
