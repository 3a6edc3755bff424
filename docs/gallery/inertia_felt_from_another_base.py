"""The inertia at which each body of a flying tree is felt, in kg: outboard and inboard, for two bases, or any with the slider."""

import matplotlib.pyplot as plt

import pycraft as pc

robot = pc.tree([-1, 0, 1, 1, 0], ["free", "pin", "ball", "pin", "universal"], seed=1)
page = robot.rerootings(robot.random_state(0))
figure, axes = plt.subplots(1, 2, figsize=(7, 3), layout="constrained", sharey=True)
for ax, base in zip(axes, (0, 3), strict=True):
    outboard = page.P[base]
    ax.bar(page.bases, outboard, color="#0072b2", label="P(k), outboard")
    ax.bar(page.bases, page.inverse_of_Upsilon[base] - outboard, bottom=outboard, color="#d55e00", label="S⁺(k), inboard")
    ax.set(title=f"base: {page.bases[base]}", ylabel="mass felt, kg" if ax is axes[0] else "")
axes[0].set_ylim(0, 1.1 * page.inverse_of_Upsilon.max())
figure.legend(*axes[0].get_legend_handles_labels(), frameon=False, loc="outside lower center", ncols=2)
