"""The pictures of the three tours: `PYTHONPATH=docs python -m making.tours` writes docs/static/tour_researcher.png and the others.

Their background is light, so that they are readable on a dark page.
"""

from pathlib import Path
from typing import Any

import numpy as np

import pycraft as pc

from .landing import GROUND, INK

FOLDER = Path(__file__).parents[1] / "static"
SIZE = (3.4, 2.0)


def researcher(figure: Any) -> None:
    """Draw the blocks that a conjecture omits, on a tree with two branches."""
    tree = pc.tree([-1, 0, 1, 2, 0, 4, 5], ["pin"] * 7, seed=1)
    tree.q = tree.random_state(seed=1).q
    O, U, psi_tilde = tree.soa("Omega Upsilon psi_tilde")
    axes = figure.subplots(1, 2)
    for one, title, operator in (
        (axes[0], "$\\Omega$", O),
        (axes[1], "$\\Omega - (\\Upsilon+\\tilde\\psi^*\\Upsilon+\\Upsilon\\tilde\\psi)$", O - (U + psi_tilde.T @ U + U @ psi_tilde)),
    ):
        norms = operator.blocks().norms()
        one.imshow(np.log10(np.where(norms > 1e-9, norms, np.nan)), cmap="viridis")
        one.set_title(title, fontsize=11, color=INK)
        one.set(xticks=[], yticks=[])
    axes[1].set_xlabel("missing: siblings", fontsize=9.5, color=INK)
    axes[0].set_xlabel("a branched tree", fontsize=9.5, color=INK)


def teacher(figure: Any) -> None:
    """Draw the factorization of the mass matrix, block by block."""
    arm = pc.chain(6, seed=3)
    arm.q = arm.random_state(seed=0).q
    H, phi, M, D, K, I = arm.soa("H phi M D K I")
    factor = I + H @ phi @ K
    axes = figure.subplots(1, 4, gridspec_kw={"left": 0.04, "right": 0.96, "wspace": 0.3})
    parts = (("$\\mathcal{M}$", H @ phi @ M @ phi.T @ H.T), ("$[I+H\\phi K]$", factor), ("$D$", D), ("$[I+H\\phi K]^*$", factor.T))
    for number, (one, (title, operator)) in enumerate(zip(axes, parts, strict=True)):
        norms = operator.blocks().norms()
        one.imshow(np.log10(np.where(norms > 1e-9, norms, np.nan)), cmap="viridis")
        one.set_title(title, fontsize=9.5, color=INK)
        one.set(xticks=[], yticks=[])
        if number == 0:
            one.text(1.12, 0.5, "=", transform=one.transAxes, va="center", ha="center", fontsize=13, color=INK)
    figure.text(0.5, 0.12, "for k from tip to base:  ε(k) = T(k) − H(k) z(k)", ha="center", fontsize=9.5, color=INK)


def engineer(figure: Any) -> None:
    """Draw a robot that a servo moves to a posture, and its coordinates over time."""
    arm = pc.robots.panda()
    target = [0.3, -0.4, 0.2, -1.8, 0.1, 1.6, 0.5]
    scene = pc.Scene(arm).add(pc.effects.Gravity(), pc.effects.Servo(target=target))
    run = scene.simulate(1.0, [0, 0, 0, -0.1, 0, 0.1, 0], progress=False)
    arm.q = run.q[-1]
    left = figure.add_axes((-0.05, -0.12, 0.55, 1.2), projection="3d", facecolor=GROUND)
    arm.plot(ax=left)
    left.set_axis_off()
    left.set_title("")
    if left.get_legend():
        left.get_legend().remove()
    right = figure.add_axes((0.56, 0.2, 0.4, 0.66), facecolor=GROUND)
    right.plot(run.t, run.q, lw=1.4)
    right.set_title("servo and gravity", fontsize=9.5, color=INK)
    right.set_xlabel("t, s", fontsize=8.5, color=INK)
    right.set_ylabel("q, rad", fontsize=8.5, color=INK)
    right.tick_params(labelsize=7.5, colors=INK)


def draw(made: Any, path: Path) -> None:
    """Draw one picture into a file."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=SIZE, facecolor=GROUND)
    made(figure)
    figure.savefig(path, dpi=190, facecolor=GROUND)
    plt.close(figure)


if __name__ == "__main__":
    for made in (researcher, teacher, engineer):
        draw(made, FOLDER / f"tour_{made.__name__}.png")
