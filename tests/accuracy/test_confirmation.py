"""References of accuracy tables: confirmed by a method of another family, and said loudly where they are not."""

import re
import warnings

import numpy as np
import pytest

import pycraft as pc
from pycraft.accuracy.tables import work_precision as tables
from pycraft.accuracy.tables.confirmation import confirmation
from pycraft.scenes import loop_comparison, scene_accuracy

TIMES = np.linspace(0, 1, 9)[:, None]


def worst(a, b):
    return float(np.abs(a - b).max())


def test_digits_are_relative_to_the_displacement():
    for size, apart, digits in ((1.0, 3e-9, 8), (1e-3, 3e-9, 5), (100.0, 0.0, 16), (0.0, 0.0, 16)):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", pc.ModelWarning)
            found = confirmation(size * TIMES, lambda size=size, apart=apart: size * TIMES + apart, worst, "another")
        assert found.digits == digits and found.confirmed == (digits >= 6) and found.distance == pytest.approx(apart, rel=1e-6, abs=1e-16)
        assert (f"confirmed to {digits} digits by another" in found.text) == found.confirmed


def test_what_is_not_confirmed_is_said():
    def nothing():
        raise pc.EvaluationError("no step could be taken")

    for second, words in (
        (lambda: TIMES + 0.03, "NOT CONFIRMED: another differs by 3.0e-02 rad or m, 1 digits agree"),
        (lambda: np.nan * TIMES, "NOT CONFIRMED: another differs by nan rad or m, 0 digits agree"),
        (nothing, "NOT CONFIRMED: another gives no motion .no step could be taken."),
    ):
        with pytest.warns(pc.ModelWarning, match="the reference is not confirmed"):
            found = confirmation(TIMES, second, worst, "another")
        assert not found.confirmed and re.search(words, found.text)


@pytest.fixture
def scene():
    return pc.mechanisms.double_pendulum()


def test_tables_say_to_how_many_digits_both_methods_agree(scene):
    """Regular motions of a second, in extended precision at 1e-16: twelve digits at least."""
    one = scene.accuracy(T=0.5, integrators="dopri5", tolerances=1e-6, forms="fast", precisions="double", seconds=0)
    two = pc.work_precision(scene.model, [0.3, 0.2], duration=0.5, integrators="dopri5", tolerances=1e-6, seconds=0)
    for table in (one, two):
        assert table.about["confirmed_digits"] >= 12 and table.reference_error < 1e-12
        assert "bulirsch-stoer in extended precision" in table.confirmation
        text = " ".join(repr(table).split())
        assert f"reference: dop853 in extended precision, tolerance 1e-16, confirmed to {table.about['confirmed_digits']} digits" in text
        assert "confirmed to" in table._repr_html_() and '"confirmed_digits"' in table.to_json()
    loops = pc.loops_compared(pc.mechanisms.slider_crank(), T=0.1, methods="augment", integrators="dopri5", tolerances=1e-6, seconds=0)
    assert loops.about["confirmed_digits"] >= 8 and "bulirsch-stoer" in loops.note


def test_a_reference_that_differs_resolves_nothing(scene, monkeypatch):
    """A second method that is 1e-3 off, whichever of them is wrong: no row below that is resolved, and the table reports it."""
    by = scene_accuracy._by

    def off(*args):
        run = by(*args)
        return lambda integrator, **options: _moved(run(integrator, **options), 1e-3 * (integrator == "bulirsch-stoer"))

    monkeypatch.setattr(scene_accuracy, "_by", off)
    with pytest.warns(pc.ModelWarning, match="the reference is not confirmed: bulirsch-stoer in extended precision differs by 1.0e-03"):
        table = scene.accuracy(T=0.5, integrators="dopri5", tolerances=1e-6, forms="fast", precisions="double", seconds=0)
    assert table.reference_error == pytest.approx(1e-3, rel=1e-3) and not any(
        row["resolved"] for row in table if row["varied"] != "effects"
    )
    assert table.about["confirmed_digits"] == 0 and "NOT CONFIRMED" in repr(table)


def _moved(run, by):
    return (run[0] + by * (np.arange(len(run[0])) > 0)[:, None], *run[1:])


def test_every_table_with_a_reference_confirms_it():
    """No table relies on one method: where REFERENCE is named, the second method is also named."""
    for module in (scene_accuracy, loop_comparison, tables):
        assert module.SECOND == "bulirsch-stoer" and module.confirmation is confirmation
