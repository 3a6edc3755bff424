"""Theorems that suppose J = 0, on a chain whose hinges have rotors: by how much each is wrong there."""

import matplotlib.pyplot as plt

import pycraft as pc

broken = pc.hypothesis_switches(bodies=3).broken("J > 0", "chain", "single-DOF", "free")
broken = sorted((finding for finding in broken if finding.states), key=lambda finding: finding.residual)
figure, ax = plt.subplots(figsize=(6.4, 4.6), layout="constrained")
ax.barh([finding.name for finding in broken], [finding.residual for finding in broken], color="#d55e00")
ax.set(xscale="log", xlim=(0.01, 1.1), xlabel="relative residual", title="where J > 0, with J = 0 supposed")
ax.tick_params(axis="y", labelsize=7)
