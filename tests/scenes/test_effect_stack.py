"""Effects as a stack: the widths of the bars are what the table says, and nothing overlaps."""

import matplotlib as mpl
import matplotlib.pyplot
import numpy as np
import pytest

import pycraft as pc
from pycraft.scenes.comparison import ComparisonTable
from pycraft.scenes.effect_stack import COLOURS

mpl.use("Agg")


def row(names, **numbers):
    known = {"acceleration": 0.1, "trajectory": 0.01, "evaluation": 1e-6, "saved": 0.0, "run": 1.0, "saved of run": 0.0, "resolved": True}
    made = dict.fromkeys(ComparisonTable.columns) | {"left out": names, "together": len(names) > 1, "pareto": False, "refused": ""}
    return made | known | numbers


def table(*rows):
    return ComparisonTable("Effects", [row([], trajectory=0.0, resolved=False), *rows], {"own_error": 1e-9, "noise": 0.005})


def bars(ax):
    return {round(p.get_y() + p.get_height() / 2): p for p in ax.patches if p.get_width()}


def test_bars_go_on_where_the_one_above_ends():
    made = table(row(["a"], saved=0.3), row(["b"], saved=-0.1), row(["c"], saved=0.2, trajectory=1e-3), row(["a", "b"], saved=0.9))
    costs, changes = made.stack()
    assert [t.get_text() for t in costs.get_yticklabels()] == ["a", "b", "c", "all the rest"]  # no row of several effects
    found = {i: (p.get_x(), p.get_width()) for i, p in bars(costs).items()}
    assert {i: tuple(np.round(x, 9)) for i, x in found.items()} == {0: (0, 30), 2: (30, 20), 3: (50, 50)}
    assert {i: p.get_width() for i, p in bars(changes).items()} == pytest.approx({0: 0.01, 1: 0.01, 2: 1e-3})
    for i in (0, 2):  # an effect has one colour in both
        assert bars(costs)[i].get_facecolor() == bars(changes)[i].get_facecolor()
    told = [t.get_text() for t in (*costs.texts, *changes.texts)]
    assert any("below 0.5 %" in t for t in told) and any("v̇ by 1.0e-01" in t for t in told) and "(%)" in costs.get_xlabel()


def test_more_than_the_whole_more_than_the_colours_and_refusals():
    """Effects that share a pass can each save more than their part; the rest is then nothing, not less."""
    made = table(
        *(row([f"effect {i}"], saved=0.2) for i in range(9)), row(["last"], refused="it holds the loop", saved=None, trajectory=None)
    )
    costs, changes = made.stack()
    assert max(p.get_x() + p.get_width() for p in costs.patches) == pytest.approx(180) and costs.get_xlim()[1] > 180
    styles = [(p.get_facecolor(), p.get_hatch()) for i, p in sorted(bars(costs).items())]
    assert len(set(styles)) == 9 > len(COLOURS)
    assert "  refused" in [t.get_text() for t in costs.texts] and "does not run without it" in [t.get_text() for t in changes.texts]


def test_what_is_not_resolved_is_hollow_and_nothing_is_an_empty_frame():
    _, changes = table(row(["a"], trajectory=1e-12, resolved=False), row(["b"])).stack()
    assert bars(changes)[0].get_facecolor()[:3] == (1, 1, 1) != bars(changes)[1].get_facecolor()[:3]
    assert bars(changes)[0].get_width() == pytest.approx(1e-9)  # the run's own error, as the table says
    costs, changes = table().stack()
    assert not costs.patches and not changes.axison


def test_a_scene_has_a_stack():
    scene = pc.Scene(pc.chain(3)).add(pc.effects.Gravity((0, 0, -9.81)), pc.effects.Damping(0.1))
    made = scene.compare(T=0.05, seconds=0.001)
    figure, given = mpl.pyplot.subplots(1, 2)
    assert made.stack(given) is given and [t.get_text() for t in given[0].get_yticklabels()] == ["gravity", "damping", "all the rest"]
    mpl.pyplot.close("all")
