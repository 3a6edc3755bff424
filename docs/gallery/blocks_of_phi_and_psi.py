"""φ reaches every ancestor; ψ decays through free hinges: norms of their blocks on a chain, with the chain beside ψ on hover."""

import matplotlib.pyplot as plt
from matplotlib.colors import LogNorm

import pycraft as pc

chain = pc.chain(24, seed=1)
figure, panels = plt.subplots(1, 2, figsize=(8, 3.6), layout="constrained")
for axes, name in zip(panels, ("phi", "psi"), strict=True):
    drawn = axes.imshow(getattr(chain.soa, name).blocks().norms(), norm=LogNorm(1e-3, 10), cmap="viridis")
    axes.set(title=f"norms of the blocks of {name}", xlabel="body", ylabel="body")
figure.colorbar(drawn, ax=panels)
page = chain.soa.psi.blocks().on_robot()
