"""Errors of theorems with the hypothesis J = 0, on a chain whose hinges have rotors."""

import matplotlib.pyplot as plt

import pycraft as pc

broken = pc.hypothesis_switches(bodies=3).broken("J > 0", "chain", "single-DOF", "free")
broken = sorted((finding for finding in broken if finding.states), key=lambda finding: finding.residual)
figure, ax = plt.subplots(figsize=(6.4, 4.6), layout="constrained")
ax.barh([finding.name for finding in broken], [finding.residual for finding in broken], color="#d55e00")
ax.set(xscale="log", xlim=(0.01, 1.1), xlabel="relative residual", title="J > 0, hypothesis J = 0")
ax.tick_params(axis="y", labelsize=7)
