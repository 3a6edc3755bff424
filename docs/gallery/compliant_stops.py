"""A pendulum between compliant stops: every bounce costs some energy."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

scene = pc.mechanisms.pendulum().add(pc.effects.Limits(2e3, 0.3, lower=1.0, upper=2.0))
run = scene.simulate(12.0, [1.5], [4.0], rtol=1e-8, t_eval=np.linspace(0, 12, 1500))
figure, axes = plt.subplots(figsize=(6, 3.4), layout="constrained")
axes.axhspan(1.0, 2.0, color="0.93")
axes.plot(run.t, run.q[:, 0], color="#1f4e79", lw=1)
axes.set(title="a pendulum between stops", xlabel="t, s", ylabel="angle below the horizontal, rad")
