"""The picture at the head of the README: `PYTHONPATH=docs python -m making.landing` writes docs/static/landing.png.

The picture has a formula, a robot, the blocks of a factor, and the recursion. Its background is light, so
that it is also readable on a dark page.
"""

from pathlib import Path

import numpy as np

import pycraft as pc

PICTURE = Path(__file__).parents[1] / "static" / "landing.png"
FORMULA = r"$\mathcal{M}^{-1} = [I - H\psi\mathcal{K}]^{*}\,\mathcal{D}^{-1}\,[I - H\psi\mathcal{K}]$"
GROUND, INK = "#f6f8fa", "#1f2328"


def draw(path: Path) -> None:
    """Draw the picture into a file."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    robot, standing = pc.robots.g1(), pc.robots.g1()
    robot.q = robot.random_state(seed=0).q
    H, phi, M, D, K, psi, I = robot.soa("H phi M D K psi I")
    recursion = str((H @ phi @ M @ phi.T @ H.T).inv().algorithm()).splitlines()
    lines = [line for line in recursion[2:] if not line.startswith(("given", "cost"))]
    norms = (I - H @ psi @ K).blocks().norms()

    figure = plt.figure(figsize=(11, 4.2), facecolor=GROUND)
    figure.text(0.5, 0.93, FORMULA, ha="center", va="center", fontsize=19, color=INK)
    left = figure.add_axes((0.0, -0.05, 0.33, 0.96), projection="3d", facecolor=GROUND)
    standing.plot(ax=left)
    left.set_axis_off()
    left.set_title("")
    if left.get_legend():
        left.get_legend().remove()
    middle = figure.add_axes((0.35, 0.1, 0.27, 0.68), facecolor=GROUND)
    middle.imshow(np.log10(np.where(norms > 1e-9, norms, np.nan)), cmap="viridis")
    middle.set_title("I − HψK: who feels whom", fontsize=10, color=INK)
    middle.set(xticks=[], yticks=[], xlabel="hinges of a humanoid, base to tip")
    middle.xaxis.label.set(fontsize=9, color=INK)
    figure.text(0.655, 0.47, "\n".join(lines), family="DejaVu Sans Mono", fontsize=8.5, va="center", color=INK, linespacing=1.45)
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, dpi=140, facecolor=GROUND)
    plt.close(figure)


if __name__ == "__main__":
    draw(PICTURE)
