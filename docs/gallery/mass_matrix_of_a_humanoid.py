"""The mass matrix of a humanoid on a free base: blocks between different limbs are zero."""

import matplotlib.pyplot as plt
import numpy as np

import pycraft as pc

robot = pc.robots.g1()
H, phi, M = robot.soa("H phi M")
norms = (H @ phi @ M @ phi.T @ H.T).blocks().norms()
figure, axes = plt.subplots(figsize=(5.2, 4.4), layout="constrained")
drawn = axes.imshow(np.log10(np.where(norms > 0, norms, np.nan)), cmap="viridis")
axes.set(title="mass matrix of g1", xlabel="hinge", ylabel="hinge")
figure.colorbar(drawn, label="log₁₀ of the norm; white: exactly zero")
